// A plain cloth on one thread: symplectic Euler, springs in rows, contact found by bins that are made anew in every
// substep. README.md in this folder says what is computed, and how it is built and run.
//
//   explicit SECONDS                          a table of times, with so many seconds for each size
//   explicit state SCENE CONTACT SIDE FRAMES  positions after some frames, a particle in each line
//
// SCENE is hang or sphere, or fold, which hangs with its far half laid over the near one; CONTACT none or grid.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

struct Vec {
    float x = 0, y = 0, z = 0;
};

Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(float s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
float dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
float length(Vec a) { return std::sqrt(dot(a, a)); }

constexpr float spacing = 0.02f;           // m
constexpr float particle_mass = 1e-4f;     // kg
constexpr float spring_damping = 0.005f;   // N s/m
constexpr float drag = 0.5f;               // 1/s
constexpr Vec gravity = {0, 0, -9.81f};    // m/s^2
constexpr int substeps = 17;               // of a frame of 1/60 s
constexpr float time_step = 1.0f / (60 * substeps);

constexpr float contact_distance = 0.016f;  // m, below the spacing
constexpr float contact_stiffness = 10;     // N/m
constexpr float contact_damping = 0.002f;   // N s/m
constexpr float friction = 0.3f;

struct Spring {
    int other;
    float rest_length, stiffness;
};

struct Particle {
    Vec position, velocity;
};

/// Particles sorted by the cell of side `contact_distance` that they are in. Cells repeat in space, so that their
/// number does not depend on how far the cloth spreads.
class Bins {
public:
    /// Enough cells for a flat patch of `side` particles to have one of its own for each place.
    explicit Bins(int side) {
        while (width < spacing / contact_distance * side) {
            width *= 2;
        }
        first.resize(static_cast<size_t>(width) * width * depth + 1);
    }

    void fill(const std::vector<Particle>& particles) {
        std::fill(first.begin(), first.end(), 0);
        cell_of.resize(particles.size());
        sorted.resize(particles.size());
        for (size_t i = 0; i < particles.size(); ++i) {
            cell_of[i] = index(cell(particles[i].position));
            ++first[cell_of[i]];
        }
        // Where each cell ends; taken down to where it begins as it is filled from its end.
        int sum = 0;
        for (int& entry : first) {
            sum += entry;
            entry = sum;
        }
        for (size_t i = particles.size(); i-- > 0;) {
            sorted[--first[cell_of[i]]] = particles[i];
        }
    }

    /// Calls `visit` with each particle in the 27 cells around a position.
    template <typename Visit>
    void around(Vec position, Visit visit) const {
        const Cell middle = cell(position);
        for (int dz = -1; dz <= 1; ++dz) {
            for (int dy = -1; dy <= 1; ++dy) {
                for (int dx = -1; dx <= 1; ++dx) {
                    const int at = index({middle.x + dx, middle.y + dy, middle.z + dz});
                    for (int k = first[at]; k < first[at + 1]; ++k) {
                        visit(sorted[k]);
                    }
                }
            }
        }
    }

private:
    struct Cell {
        int x, y, z;
    };

    static constexpr int depth = 4;
    int width = 1;
    std::vector<int> first, cell_of;
    std::vector<Particle> sorted;

    static Cell cell(Vec position) {
        const auto coordinate = [](float x) {
            return static_cast<int>(std::floor(x * (1 / contact_distance)));
        };
        return {coordinate(position.x), coordinate(position.y), coordinate(position.z)};
    }

    /// Sides are powers of two, so that the remainder is a mask, also of negative numbers.
    int index(Cell cell) const {
        const int x = cell.x & (width - 1), y = cell.y & (width - 1), z = cell.z & (depth - 1);
        return (z * width + y) * width + x;
    }
};

class Patch {
public:
    Patch(int side, bool has_ball, bool has_contact)
        : side(side), has_ball(has_ball), has_contact(has_contact), bins(side) {
        const float edge = spacing * (side - 1);
        ball_radius = 0.25f * edge;
        ball_centre = {0.5f * edge, 0.5f * edge, -(ball_radius + 0.5f * spacing)};
        for (int row = 0; row < side; ++row) {
            for (int column = 0; column < side; ++column) {
                now.push_back({{column * spacing, row * spacing, 0}, {}});
                row_begin.push_back(static_cast<int>(springs.size()));
                springs_add(column, row);
            }
        }
        row_begin.push_back(static_cast<int>(springs.size()));
        next = now;
        is_held.assign(now.size(), 0);
        if (!has_ball) {
            is_held[0] = is_held[side - 1] = 1;
        }
    }

    /// Lays the far half of the rows over the near one, so near that all of it is in contact.
    void fold() {
        for (int row = (side + 1) / 2; row < side; ++row) {
            for (int column = 0; column < side; ++column) {
                now[row * side + column].position = {column * spacing, (side - 1 - row) * spacing, 0.75f * contact_distance};
            }
        }
    }

    void frame() {
        for (int k = 0; k < substeps; ++k) {
            substep();
        }
    }

    const std::vector<Particle>& particles() const { return now; }

    /// Mean and largest relative elongation of the sides of all cells.
    std::pair<double, double> strain() const {
        double sum = 0, largest = 0;
        long count = 0;
        const auto add = [&](int a, int b) {
            const double stretched = length(now[a].position - now[b].position) / spacing - 1;
            sum += std::fabs(stretched);
            largest = std::max(largest, stretched);
            ++count;
        };
        for (int row = 0; row < side; ++row) {
            for (int column = 0; column < side; ++column) {
                const int at = row * side + column;
                if (column + 1 < side) add(at, at + 1);
                if (row + 1 < side) add(at, at + side);
            }
        }
        return {sum / static_cast<double>(count), largest};
    }

private:
    int side;
    bool has_ball, has_contact;
    float ball_radius;
    Vec ball_centre;
    std::vector<Particle> now, next;
    std::vector<char> is_held;
    std::vector<int> row_begin;
    std::vector<Spring> springs;
    Bins bins;

    /// Springs to the eight neighbours, and to those two away along rows and columns.
    void springs_add(int column, int row) {
        for (int dy = -2; dy <= 2; ++dy) {
            for (int dx = -2; dx <= 2; ++dx) {
                const int square = dx * dx + dy * dy;
                const bool is_spring = square == 1 || square == 2 || (square == 4 && (dx == 0 || dy == 0));
                const int x = column + dx, y = row + dy;
                if (!is_spring || x < 0 || y < 0 || x >= side || y >= side) continue;
                const float rest_length = spacing * std::sqrt(static_cast<float>(square));
                springs.push_back({y * side + x, rest_length, square == 4 ? 2.0f : 10.0f});
            }
        }
    }

    void substep() {
        if (has_contact) bins.fill(now);
        for (size_t i = 0; i < now.size(); ++i) {
            next[i] = is_held[i] ? now[i] : moved(static_cast<int>(i));
        }
        now.swap(next);
    }

    Particle moved(int i) const {
        Particle p = now[i];
        Vec force;
        for (int s = row_begin[i]; s < row_begin[i + 1]; ++s) {
            const Spring& spring = springs[s];
            const Particle& q = now[spring.other];
            const Vec across = q.position - p.position;
            const float distance = length(across);
            const Vec direction = (1 / distance) * across;
            const float tension = spring.stiffness * (distance - spring.rest_length)
                + spring_damping * dot(q.velocity - p.velocity, direction);
            force = force + tension * direction;
        }
        if (has_contact) {
            bins.around(p.position, [&](const Particle& q) { force = force + contact(p, q); });
        }
        const Vec acceleration = (1 / particle_mass) * force + gravity - drag * p.velocity;
        p.velocity = p.velocity + time_step * acceleration;
        p.position = p.position + time_step * p.velocity;
        if (has_ball) ball_stop(p);
        return p;
    }

    /// The force on `p` of a particle nearby; none of itself, which is at distance zero.
    static Vec contact(const Particle& p, const Particle& q) {
        const Vec apart = p.position - q.position;
        const float square = dot(apart, apart);
        if (square >= contact_distance * contact_distance || square == 0) return {};
        const float distance = std::sqrt(square);
        const Vec normal = (1 / distance) * apart;
        const float push = contact_stiffness * (contact_distance - distance)
            - contact_damping * dot(p.velocity - q.velocity, normal);
        return push * normal;
    }

    /// Puts a particle that has come too near back onto the ball, and takes the motion into it away; friction slows
    /// the motion along it.
    void ball_stop(Particle& p) const {
        const float reach = ball_radius + 0.5f * contact_distance;
        const Vec outwards = p.position - ball_centre;
        const float square = dot(outwards, outwards);
        if (square >= reach * reach) return;
        const Vec normal = (1 / std::sqrt(square)) * outwards;
        p.position = ball_centre + reach * normal;
        const float into = -dot(p.velocity, normal);
        if (into <= 0) return;
        const Vec along = p.velocity + into * normal;
        const float speed = length(along);
        p.velocity = speed > 0 ? std::max(0.0f, 1 - friction * into / speed) * along : Vec{};
    }
};

double seconds_now() {
    using Clock = std::chrono::steady_clock;
    return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

/// Times of frames 10 to 70, fewer if they take longer than `budget` seconds: cloth that folds costs more, so that only the same
/// frames compare.
void time_print(const char* scene, const char* contact, int side, double budget) {
    Patch patch(side, std::string(scene) == "sphere", std::string(contact) == "grid");
    for (int k = 0; k < 10; ++k) {
        patch.frame();
    }
    std::vector<double> times;
    const double begin = seconds_now();
    while (times.size() < 60 && (times.size() < 5 || seconds_now() - begin < budget)) {
        const double start = seconds_now();
        patch.frame();
        times.push_back(1e3 * (seconds_now() - start));
    }
    std::sort(times.begin(), times.end());
    const auto [mean, largest] = patch.strain();
    std::printf("%s,%s,%d,%.4f,%zu,%.5f,%.5f\n", scene, contact, side, times[times.size() / 2], times.size(), mean, largest);
    std::fflush(stdout);
}

int state_print(const std::string& scene, const std::string& contact, int side, int frames) {
    if (side < 3 || (scene != "hang" && scene != "sphere" && scene != "fold") || (contact != "none" && contact != "grid")) return 2;
    Patch patch(side, scene == "sphere", contact == "grid");
    if (scene == "fold") patch.fold();
    for (int k = 0; k < frames; ++k) {
        patch.frame();
    }
    for (const Particle& p : patch.particles()) {
        std::printf("%.9g %.9g %.9g\n", p.position.x, p.position.y, p.position.z);
    }
    return 0;
}

}  // namespace

int main(int count, char** words) {
    if (count == 6 && std::string(words[1]) == "state") {
        return state_print(words[2], words[3], std::atoi(words[4]), std::atoi(words[5]));
    }
    const double budget = count > 1 ? std::atof(words[1]) : 10;
    if (count > 2 || budget <= 0) {
        std::fprintf(stderr, "usage: explicit SECONDS | explicit state hang|sphere|fold none|grid SIDE FRAMES\n");
        return 2;
    }
    std::printf("scene,self,N,ms_per_frame,frames,mean_strain,max_strain\n");
    for (const char* scene : {"hang", "sphere"}) {
        for (const char* contact : {"none", "grid"}) {
            for (const int side : {32, 160, 256}) {
                time_print(scene, contact, side, budget);
            }
        }
    }
}
