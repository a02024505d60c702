// A plain cloth on an NVIDIA GPU: a thread for each particle, springs in rows, contact found by bins that are made anew in every
// substep, the substeps of a frame in one CUDA graph. README.md in this folder says what is computed, and how it is built and run.
//
//   explicit_cuda SIDE,...                         a table of times
//   explicit_cuda state SCENE CONTACT SIDE FRAMES  positions after some frames, a particle in each line
//
// SCENE is hang or sphere, CONTACT none or grid. The kernels alone are what NVIDIA's run-time compiler sees of this file.

#ifndef __CUDACC_RTC__
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>
#endif

constexpr float spacing = 0.02f;           // m
constexpr float particle_mass = 1e-4f;     // kg
constexpr float spring_damping = 0.005f;   // N s/m
constexpr float drag = 0.5f;               // 1/s
constexpr float gravity_z = -9.81f;        // m/s^2
constexpr int substeps = 17;               // of a frame of 1/60 s
constexpr float time_step = 1.0f / (60 * substeps);

constexpr float contact_distance = 0.016f;  // m, below the spacing
constexpr float contact_stiffness = 10;     // N/m
constexpr float contact_damping = 0.002f;   // N s/m
constexpr float friction = 0.3f;

constexpr int block_size = 128;
/// Threads of a block of the prefix sum, and the cells that it sums.
constexpr int scan_size = 1024;

struct Spring {
    int other;
    float rest_length, stiffness;
};

/// What all kernels are told.
struct Scene {
    int particles;
    /// Cells along x and y, a power of two; four along z.
    int cells;
    bool has_ball;
    float ball_radius;
    float3 ball_centre;
};

__device__ float3 operator+(float3 a, float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
__device__ float3 operator*(float s, float3 a) { return {s * a.x, s * a.y, s * a.z}; }
__device__ float dot(float3 a, float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
__device__ float3 apart(float4 a, float4 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

__device__ int3 cell_of(float4 position) {
    constexpr float scale = 1 / contact_distance;
    return {__float2int_rd(position.x * scale), __float2int_rd(position.y * scale),
            __float2int_rd(position.z * scale)};
}

/// Cells repeat in space, so that their number does not depend on how far the cloth spreads.
__device__ int cell_index(int cells, int x, int y, int z) {
    return ((z & 3) * cells + (y & (cells - 1))) * cells + (x & (cells - 1));
}

/// Counts the particles of each cell. `place` gets the cell of each particle, and its number among those of the cell.
extern "C" __global__ void bins_count(Scene scene, const float4* positions, int* counts, int2* place) {
    const int i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= scene.particles) return;
    const int3 cell = cell_of(positions[i]);
    const int index = cell_index(scene.cells, cell.x, cell.y, cell.z);
    place[i] = {index, atomicAdd(&counts[index], 1)};
}

/// Sums of what lies before each entry within its block; `totals` gets the sum of each block. The entries are whole blocks.
extern "C" __global__ void blocks_scan(const int* counts, int* sums, int* totals) {
    __shared__ int of_warp[32];
    const int i = blockIdx.x * scan_size + threadIdx.x;
    const int lane = threadIdx.x % 32, warp = threadIdx.x / 32;
    const int count = counts[i];
    int sum = count;
    for (int step = 1; step < 32; step *= 2) {
        const int before = __shfl_up_sync(~0u, sum, step);
        if (lane >= step) sum += before;
    }
    if (lane == 31) of_warp[warp] = sum;
    __syncthreads();
    if (warp == 0) {
        int warps = of_warp[lane];
        for (int step = 1; step < 32; step *= 2) {
            const int before = __shfl_up_sync(~0u, warps, step);
            if (lane >= step) warps += before;
        }
        of_warp[lane] = warps;
    }
    __syncthreads();
    sum += warp > 0 ? of_warp[warp - 1] : 0;
    sums[i] = sum - count;
    if (threadIdx.x == scan_size - 1 && totals) totals[blockIdx.x] = sum;
}

/// Adds what lies before each block to the sums within it. The last entry becomes the number of all.
extern "C" __global__ void blocks_add(int* sums, const int* before, int entries, int all) {
    const int i = blockIdx.x * scan_size + threadIdx.x;
    sums[i] += before[blockIdx.x];
    if (i == 0) sums[entries] = all;
}

/// Copies particles to where those of their cell lie.
extern "C" __global__ void bins_fill(Scene scene, const float4* positions, const float4* velocities, const int* first,
                                     const int2* place, float4* sorted_positions, float4* sorted_velocities) {
    const int i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= scene.particles) return;
    const int to = first[place[i].x] + place[i].y;
    sorted_positions[to] = positions[i];
    sorted_velocities[to] = velocities[i];
}

/// One substep of a particle. The fourth number of a position is 1, or 0 for a particle that is held.
extern "C" __global__ void substep(Scene scene, const float4* __restrict__ positions,
                                   const float4* __restrict__ velocities, float4* __restrict__ positions_next,
                                   float4* __restrict__ velocities_next, const int* __restrict__ row_begin,
                                   const Spring* __restrict__ springs, const int* __restrict__ first,
                                   const float4* __restrict__ sorted_positions,
                                   const float4* __restrict__ sorted_velocities) {
    const int i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= scene.particles) return;
    const float4 here = positions[i], moving = velocities[i];
    if (here.w == 0) {
        positions_next[i] = here;
        velocities_next[i] = moving;
        return;
    }
    float3 force = {0, 0, 0};
    for (int s = row_begin[i]; s < row_begin[i + 1]; ++s) {
        const Spring spring = springs[s];
        const float3 across = apart(positions[spring.other], here);
        const float square = dot(across, across);
        const float inverse = rsqrtf(square);
        const float rate = dot(apart(velocities[spring.other], moving), across) * inverse;
        const float tension = spring.stiffness * (square * inverse - spring.rest_length) + spring_damping * rate;
        force = force + (tension * inverse) * across;
    }
    if (first) {
        const int3 middle = cell_of(here);
        for (int k = 0; k < 27; ++k) {
            const int cell = cell_index(scene.cells, middle.x + k % 3 - 1, middle.y + k / 3 % 3 - 1, middle.z + k / 9 - 1);
            for (int s = first[cell]; s < first[cell + 1]; ++s) {
                const float3 away = apart(here, sorted_positions[s]);
                const float square = dot(away, away);
                // At distance zero is the particle itself.
                if (square >= contact_distance * contact_distance || square == 0) continue;
                const float inverse = rsqrtf(square);
                const float rate = dot(apart(moving, sorted_velocities[s]), away) * inverse;
                const float push = contact_stiffness * (contact_distance - square * inverse) - contact_damping * rate;
                force = force + (push * inverse) * away;
            }
        }
    }
    float3 velocity = {moving.x, moving.y, moving.z};
    const float3 acceleration = (1 / particle_mass) * force + float3{0, 0, gravity_z} + -drag * velocity;
    velocity = velocity + time_step * acceleration;
    float3 position = float3{here.x, here.y, here.z} + time_step * velocity;
    if (scene.has_ball) {
        const float reach = scene.ball_radius + 0.5f * contact_distance;
        const float3 outwards = position + -1.0f * scene.ball_centre;
        const float square = dot(outwards, outwards);
        if (square < reach * reach) {
            const float3 normal = rsqrtf(square) * outwards;
            position = scene.ball_centre + reach * normal;
            const float into = -dot(velocity, normal);
            if (into > 0) {
                const float3 along = velocity + into * normal;
                const float speed = sqrtf(dot(along, along));
                velocity = (speed > 0 ? fmaxf(0, 1 - friction * into / speed) : 0) * along;
            }
        }
    }
    positions_next[i] = {position.x, position.y, position.z, 1};
    velocities_next[i] = {velocity.x, velocity.y, velocity.z, 0};
}

#ifndef __CUDACC_RTC__

namespace {

void check(cudaError_t outcome, const char* what) {
    if (outcome == cudaSuccess) return;
    std::fprintf(stderr, "%s: %s\n", what, cudaGetErrorString(outcome));
    std::exit(1);
}

/// An array in device memory, zero unless it is given something.
template <typename T>
class Array {
public:
    explicit Array(size_t length) : length(length) {
        check(cudaMalloc(&data, length * sizeof(T)), "memory");
        check(cudaMemset(data, 0, length * sizeof(T)), "memory");
    }
    explicit Array(const std::vector<T>& from) : Array(from.size()) {
        check(cudaMemcpy(data, from.data(), length * sizeof(T), cudaMemcpyHostToDevice), "copy");
    }
    Array(const Array&) = delete;
    Array& operator=(const Array&) = delete;
    ~Array() { cudaFree(data); }

    operator T*() { return data; }

    std::vector<T> read() const {
        std::vector<T> out(length);
        check(cudaMemcpy(out.data(), data, length * sizeof(T), cudaMemcpyDeviceToHost), "copy");
        return out;
    }

private:
    T* data = nullptr;
    size_t length;
};

/// A patch as it starts, on the host.
struct Start {
    std::vector<float4> positions;
    std::vector<int> row_begin;
    std::vector<Spring> springs;

    Start(int side, bool has_ball) {
        for (int row = 0; row < side; ++row) {
            for (int column = 0; column < side; ++column) {
                positions.push_back({column * spacing, row * spacing, 0, 1});
                row_begin.push_back(static_cast<int>(springs.size()));
                springs_add(side, column, row);
            }
        }
        row_begin.push_back(static_cast<int>(springs.size()));
        if (!has_ball) positions[0].w = positions[side - 1].w = 0;
    }

    /// Springs to the eight neighbours, and to those two away along rows and columns.
    void springs_add(int side, int column, int row) {
        for (int dy = -2; dy <= 2; ++dy) {
            for (int dx = -2; dx <= 2; ++dx) {
                const int square = dx * dx + dy * dy;
                const bool is_spring = square == 1 || square == 2 || (square == 4 && (dx == 0 || dy == 0));
                const int x = column + dx, y = row + dy;
                if (!is_spring || x < 0 || y < 0 || x >= side || y >= side) continue;
                springs.push_back({y * side + x, spacing * std::sqrt(static_cast<float>(square)), square == 4 ? 2.0f : 10.0f});
            }
        }
    }
};

Scene scene_of(int side, bool has_ball) {
    const float edge = spacing * (side - 1), radius = 0.25f * edge;
    int cells = 64;
    while (cells < spacing / contact_distance * side) {
        cells *= 2;
    }
    return {side * side, cells, has_ball, radius, {0.5f * edge, 0.5f * edge, -(radius + 0.5f * spacing)}};
}

class Patch {
public:
    Patch(int side, bool has_ball, bool has_contact)
        : side(side), has_contact(has_contact), scene(scene_of(side, has_ball)), start(side, has_ball),
          entries(4 * scene.cells * scene.cells), positions{Array(start.positions), Array(start.positions)},
          velocities{Array<float4>(scene.particles), Array<float4>(scene.particles)}, row_begin(start.row_begin),
          springs(start.springs), counts(entries), first(entries + 1), totals(round_up(entries / scan_size)),
          before(round_up(entries / scan_size)), above(scan_size), place(scene.particles),
          sorted_positions(scene.particles), sorted_velocities(scene.particles) {
        check(cudaStreamCreate(&stream), "stream");
        // Substeps go from one array to the other and a frame has an odd number of them: two graphs take turns.
        for (cudaGraphExec_t& frame : frames) {
            cudaGraph_t graph;
            check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capture");
            for (int k = 0; k < substeps; ++k) {
                substep_add();
            }
            check(cudaStreamEndCapture(stream, &graph), "capture");
            check(cudaGraphInstantiate(&frame, graph, 0), "graph");
            check(cudaGraphDestroy(graph), "graph");
        }
        now = 0;
    }

    Patch(const Patch&) = delete;
    Patch& operator=(const Patch&) = delete;
    ~Patch() {
        cudaGraphExecDestroy(frames[0]);
        cudaGraphExecDestroy(frames[1]);
        cudaStreamDestroy(stream);
    }

    void frame() {
        check(cudaGraphLaunch(frames[now], stream), "frame");
        now ^= 1;
    }

    std::vector<float4> places() {
        check(cudaStreamSynchronize(stream), "frame");
        return positions[now].read();
    }

    cudaStream_t stream = nullptr;

private:
    int side;
    bool has_contact;
    Scene scene;
    Start start;
    int entries;
    Array<float4> positions[2], velocities[2];
    Array<int> row_begin;
    Array<Spring> springs;
    Array<int> counts, first, totals, before, above;
    Array<int2> place;
    Array<float4> sorted_positions, sorted_velocities;
    cudaGraphExec_t frames[2] = {};
    int now = 0;

    /// Whole blocks of a sum.
    static int round_up(int count) { return (count + scan_size - 1) / scan_size * scan_size; }

    void bins_add(int blocks) {
        check(cudaMemsetAsync(counts, 0, entries * sizeof(int), stream), "bins");
        bins_count<<<blocks, block_size, 0, stream>>>(scene, positions[now], counts, place);
        // Up to three levels: cells, their blocks, and blocks of these.
        const int level_1 = entries / scan_size, level_2 = round_up(level_1) / scan_size;
        blocks_scan<<<level_1, scan_size, 0, stream>>>(counts, first, totals);
        blocks_scan<<<level_2, scan_size, 0, stream>>>(totals, before, above);
        if (level_2 > 1) {
            blocks_scan<<<1, scan_size, 0, stream>>>(above, above, nullptr);
            blocks_add<<<level_2, scan_size, 0, stream>>>(before, above, 0, 0);
        }
        blocks_add<<<level_1, scan_size, 0, stream>>>(first, before, entries, scene.particles);
        bins_fill<<<blocks, block_size, 0, stream>>>(scene, positions[now], velocities[now], first, place, sorted_positions,
                                                     sorted_velocities);
    }

    void substep_add() {
        const int blocks = (scene.particles + block_size - 1) / block_size;
        if (has_contact) bins_add(blocks);
        substep<<<blocks, block_size, 0, stream>>>(scene, positions[now], velocities[now], positions[now ^ 1], velocities[now ^ 1],
                                                   row_begin, springs, has_contact ? first : static_cast<int*>(nullptr), sorted_positions,
                                                   sorted_velocities);
        now ^= 1;
    }
};

/// Mean of |l/L - 1| over the sides of all cells.
double strain_mean(const std::vector<float4>& places, int side) {
    double sum = 0;
    long count = 0;
    const auto add = [&](int a, int b) {
        const double x = places[a].x - places[b].x, y = places[a].y - places[b].y, z = places[a].z - places[b].z;
        sum += std::fabs(std::sqrt(x * x + y * y + z * z) / spacing - 1);
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

/// Times of frames 10 to 70 by the clock of the device.
void time_print(const char* scene, const char* contact, int side) {
    Patch patch(side, std::string(scene) == "sphere", std::string(contact) == "grid");
    for (int k = 0; k < 10; ++k) {
        patch.frame();
    }
    cudaEvent_t begin, end;
    check(cudaEventCreate(&begin), "event");
    check(cudaEventCreate(&end), "event");
    std::vector<float> times(60);
    for (float& time : times) {
        check(cudaEventRecord(begin, patch.stream), "event");
        patch.frame();
        check(cudaEventRecord(end, patch.stream), "event");
        check(cudaEventSynchronize(end), "event");
        check(cudaEventElapsedTime(&time, begin, end), "event");
    }
    cudaEventDestroy(begin);
    cudaEventDestroy(end);
    std::sort(times.begin(), times.end());
    const double median = 0.5 * (times[29] + times[30]);
    std::printf("%s,%s,%d,%.4f,60,%.5f\n", scene, contact, side, median, strain_mean(patch.places(), side));
    std::fflush(stdout);
}

int state_print(const std::string& scene, const std::string& contact, int side, int frames) {
    if (side < 3 || (scene != "hang" && scene != "sphere") || (contact != "none" && contact != "grid")) return 2;
    Patch patch(side, scene == "sphere", contact == "grid");
    for (int k = 0; k < frames; ++k) {
        patch.frame();
    }
    for (const float4& place : patch.places()) {
        std::printf("%.9g %.9g %.9g\n", place.x, place.y, place.z);
    }
    return 0;
}

}  // namespace

int main(int count, char** words) {
    if (count == 6 && std::string(words[1]) == "state") {
        return state_print(words[2], words[3], std::atoi(words[4]), std::atoi(words[5]));
    }
    std::vector<int> sides;
    if (count == 2) {
        std::stringstream list(words[1]);
        for (std::string side; std::getline(list, side, ',');) {
            sides.push_back(std::atoi(side.c_str()));
        }
    }
    if (sides.empty() || *std::min_element(sides.begin(), sides.end()) < 3) {
        std::fprintf(stderr, "usage: explicit_cuda SIDE,... | explicit_cuda state hang|sphere none|grid SIDE FRAMES\n");
        return 2;
    }
    std::printf("scene,self,N,ms_per_frame,frames,mean_strain\n");
    for (const char* scene : {"hang", "sphere"}) {
        for (const char* contact : {"none", "grid"}) {
            for (const int side : sides) {
                time_print(scene, contact, side);
            }
        }
    }
}

#endif
