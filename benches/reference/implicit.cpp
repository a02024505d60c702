// A plain cloth on one thread: backward Euler after Baraff and Witkin (1998), the matrix assembled in every step in rows of 3 x 3
// blocks, thirty iterations of conjugate gradients with a diagonal preconditioner. README.md in this folder says what is computed.
//
//   implicit SECONDS            a table of times, with so many seconds for each size
//   implicit state SIDE STEPS   positions after some steps, a particle in each line

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

using Real = float;
using Vec = std::array<Real, 3>;
using Block = std::array<Real, 9>;
using Vecs = std::vector<Vec>;

Vec operator-(const Vec& a, const Vec& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Real dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Sums are in double precision: those of a hundred thousand numbers in single precision would lose too much.
double dot(const Vecs& a, const Vecs& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        for (int k = 0; k < 3; ++k) {
            sum += static_cast<double>(a[i][k]) * b[i][k];
        }
    }
    return sum;
}

constexpr Real spacing = 0.02f;         // m
constexpr Real particle_mass = 1e-4f;   // kg
constexpr Real spring_damping = 0.005f; // N s/m
constexpr Real gravity_z = -9.81f;      // m/s^2
constexpr Real time_step = Real(1) / 60;
constexpr int iterations = 30;

class Patch {
public:
    explicit Patch(int side) : side(side) {
        for (int row = 0; row < side; ++row) {
            for (int column = 0; column < side; ++column) {
                positions.push_back({column * spacing, row * spacing, 0});
                row_begin.push_back(static_cast<int>(entries.size()));
                entries_add(column, row);
            }
        }
        row_begin.push_back(static_cast<int>(entries.size()));
        blocks.resize(entries.size());
        const size_t count = positions.size();
        for (Vecs* vector : {&velocities, &change, &residual, &scaled, &search, &image, &inverse_diagonal}) {
            vector->assign(count, Vec{});
        }
    }

    /// One step; returns the residual that the linear solver leaves, relative to the right side.
    double step() {
        assemble();
        const double left = solve();
        for (size_t i = 0; i < positions.size(); ++i) {
            for (int k = 0; k < 3; ++k) {
                velocities[i][k] += change[i][k];
                positions[i][k] += time_step * velocities[i][k];
            }
        }
        return left;
    }

    const Vecs& places() const { return positions; }

    /// Mean of |l/L - 1| over the sides of all cells.
    double strain_mean() const {
        double sum = 0;
        long count = 0;
        const auto add = [&](int a, int b) {
            const Vec across = positions[a] - positions[b];
            sum += std::fabs(std::sqrt(dot(across, across)) / spacing - 1);
            ++count;
        };
        for (int row = 0; row < side; ++row) {
            for (int column = 0; column < side; ++column) {
                const int at = row * side + column;
                if (column + 1 < side) add(at, at + 1);
                if (row + 1 < side) add(at, at + side);
            }
        }
        return sum / static_cast<double>(count);
    }

private:
    /// What a block of the matrix stands for: a spring, or the particle of the row itself.
    struct Entry {
        int column;
        Real rest_length, stiffness;
    };

    int side;
    Vecs positions, velocities, change, residual, scaled, search, image, inverse_diagonal;
    std::vector<int> row_begin;
    std::vector<Entry> entries;
    std::vector<Block> blocks;

    bool is_held(size_t particle) const {
        return particle == 0 || particle == static_cast<size_t>(side) - 1;
    }

    /// Springs to all others of the block of 5 x 5 around a particle, the weaker the longer.
    void entries_add(int column, int row) {
        for (int y = std::max(0, row - 2); y <= std::min(side - 1, row + 2); ++y) {
            for (int x = std::max(0, column - 2); x <= std::min(side - 1, column + 2); ++x) {
                const Real cells = std::hypot(static_cast<Real>(x - column), static_cast<Real>(y - row));
                entries.push_back({y * side + x, spacing * cells, cells > 0 ? 10 / cells : 0});
            }
        }
    }

    /// The matrix M + h D + h^2 K and the right side h (f + h K v), row by row: each spring is computed for both of its ends.
    void assemble() {
        const Real h = time_step;
        for (size_t i = 0; i < positions.size(); ++i) {
            Block own = {particle_mass, 0, 0, 0, particle_mass, 0, 0, 0, particle_mass};
            Vec right = {0, 0, particle_mass * gravity_z};
            size_t own_at = 0;
            for (int s = row_begin[i]; s < row_begin[i + 1]; ++s) {
                const Entry& spring = entries[s];
                const size_t j = spring.column;
                if (j == i) {
                    own_at = s;
                    continue;
                }
                Vec along = positions[j] - positions[i];
                const Real distance = std::sqrt(dot(along, along));
                for (Real& coordinate : along) {
                    coordinate /= distance;
                }
                const Vec relative = velocities[j] - velocities[i];
                const Real rate = dot(along, relative);
                const Real tension = spring.stiffness * (distance - spring.rest_length) + spring_damping * rate;
                // Across the spring only tension is stiff: under compression the matrix would lose its definiteness.
                const Real across = spring.stiffness * std::max(Real(0), 1 - spring.rest_length / distance);
                const Real lengthwise = spring.stiffness - across;
                const Real outer = h * h * lengthwise + h * spring_damping;
                for (int a = 0; a < 3; ++a) {
                    right[a] += tension * along[a] + h * (across * relative[a] + lengthwise * rate * along[a]);
                    for (int b = 0; b < 3; ++b) {
                        const Real entry = outer * along[a] * along[b] + (a == b ? h * h * across : 0);
                        blocks[s][3 * a + b] = -entry;
                        own[3 * a + b] += entry;
                    }
                }
            }
            blocks[own_at] = own;
            for (int k = 0; k < 3; ++k) {
                residual[i][k] = is_held(i) ? 0 : h * right[k];
                inverse_diagonal[i][k] = 1 / own[4 * k];
            }
        }
    }

    /// The matrix times `search`; rows of held particles are zero.
    void multiply() {
        for (size_t i = 0; i < positions.size(); ++i) {
            Vec sum = {};
            for (int s = row_begin[i]; s < row_begin[i + 1]; ++s) {
                const Block& block = blocks[s];
                const Vec& x = search[entries[s].column];
                for (int a = 0; a < 3; ++a) {
                    sum[a] += block[3 * a] * x[0] + block[3 * a + 1] * x[1] + block[3 * a + 2] * x[2];
                }
            }
            image[i] = is_held(i) ? Vec{} : sum;
        }
    }

    void precondition() {
        for (size_t i = 0; i < residual.size(); ++i) {
            for (int k = 0; k < 3; ++k) {
                scaled[i][k] = inverse_diagonal[i][k] * residual[i][k];
            }
        }
    }

    /// Conjugate gradients from zero (Shewchuk 1994, appendix B3), a fixed number of iterations.
    double solve() {
        std::fill(change.begin(), change.end(), Vec{});
        const double first = std::sqrt(dot(residual, residual));
        if (first == 0) return 0;
        precondition();
        search = scaled;
        double product = dot(residual, scaled);
        for (int k = 0; k < iterations && product > 0; ++k) {
            multiply();
            const Real step = static_cast<Real>(product / dot(search, image));
            for (size_t i = 0; i < change.size(); ++i) {
                for (int a = 0; a < 3; ++a) {
                    change[i][a] += step * search[i][a];
                    residual[i][a] -= step * image[i][a];
                }
            }
            precondition();
            const double before = product;
            product = dot(residual, scaled);
            const Real turn = static_cast<Real>(product / before);
            for (size_t i = 0; i < search.size(); ++i) {
                for (int a = 0; a < 3; ++a) {
                    search[i][a] = scaled[i][a] + turn * search[i][a];
                }
            }
        }
        return std::sqrt(dot(residual, residual)) / first;
    }
};

double seconds_now() {
    using Clock = std::chrono::steady_clock;
    return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

/// Times of steps 5 to 65, fewer if they take longer than `budget` seconds.
void time_print(int side, double budget) {
    Patch patch(side);
    for (int k = 0; k < 5; ++k) {
        patch.step();
    }
    std::vector<double> times;
    double left = 0;
    const double begin = seconds_now();
    while (times.size() < 60 && (times.size() < 5 || seconds_now() - begin < budget)) {
        const double start = seconds_now();
        left = patch.step();
        times.push_back(1e3 * (seconds_now() - start));
    }
    std::sort(times.begin(), times.end());
    const double median = times[times.size() / 2];
    std::printf("hang,%d,%.4f,%zu,%.5f,%.3e\n", side, median, times.size(), patch.strain_mean(), left);
    std::fflush(stdout);
}

int state_print(int side, int steps) {
    if (side < 3) return 2;
    Patch patch(side);
    for (int k = 0; k < steps; ++k) {
        patch.step();
    }
    for (const Vec& place : patch.places()) {
        std::printf("%.9g %.9g %.9g\n", place[0], place[1], place[2]);
    }
    return 0;
}

}  // namespace

int main(int count, char** words) {
    if (count == 4 && std::string(words[1]) == "state") {
        return state_print(std::atoi(words[2]), std::atoi(words[3]));
    }
    const double budget = count > 1 ? std::atof(words[1]) : 10;
    if (count > 2 || budget <= 0) {
        std::fprintf(stderr, "usage: implicit SECONDS | implicit state SIDE STEPS\n");
        return 2;
    }
    std::printf("scene,N,ms_per_frame,frames,mean_strain,rel_residual\n");
    for (const int side : {60, 128, 160, 256}) {
        time_print(side, budget);
    }
}
