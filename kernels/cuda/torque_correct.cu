// NUMERICS section 6, `torque_correct`, in three passes: sums over blocks of the particles of each free piece; the rotation of
// each piece; that rotation taken out of the solution. Sums are in double precision, in trees of fixed shape.

#define NO_PIECE 0xffffffffu
#define TORQUE_THREADS 256
// Mass; its moments, squares and products; momentum; angular momentum.
#define TORQUE_SUMS 16
#define TURN_NUMBERS 9
// An axis has no inertia if it has less than this share of the largest one.
#define INERTIA_SHARE_MIN 1e-12

// As `semi_implicit.rs` of the backend lays it out.
struct Pieces {
    // First block of each piece, and the one after the last.
    const uint2* rows;
    // Piece, first particle, and the one after the last.
    const uint4* blocks;
    const uint* particles;
    // The piece of each particle.
    const uint* piece_of;
    double* sums;
    // First particle of each piece, centre of mass as seen from there, and angular velocity. Apart, as far from the origin a sum of the
    // first two would lose what the correction needs.
    double* turns;
};

struct double_vec {
    double x, y, z;
};

__device__ __forceinline__ double_vec double_of(const vec3& a) { return {(double)a.x, (double)a.y, (double)a.z}; }
__device__ __forceinline__ double_vec cross_of(const double_vec& a, const double_vec& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// The first particle of a piece, from which places are measured.
__device__ __forceinline__ double_vec piece_origin(const Solver& s, const Pieces& pieces, uint piece) {
    return double_of(xyz(s.position[s.present][pieces.particles[pieces.blocks[pieces.rows[piece].x].y]]));
}

extern "C" __global__ void torque_correct_sums(const __grid_constant__ Solver s, const __grid_constant__ Linear l, const __grid_constant__ Pieces pieces, double length) {
    __shared__ double memory[TORQUE_THREADS];
    uint4 block = pieces.blocks[blockIdx.x];
    double_vec origin = piece_origin(s, pieces, block.x);
    double sums[TORQUE_SUMS] = {};
    for (uint at = block.y + threadIdx.x; at < block.z; at += TORQUE_THREADS) {
        uint i = pieces.particles[at];
        double mass = s.velocity[s.present][i].w;
        double_vec x = double_of(xyz(s.position[s.present][i]));
        double_vec d = {x.x - origin.x, x.y - origin.y, x.z - origin.z};
        double_vec y = double_of(xyz(l.vectors[SOLUTION][i])), f = double_of(xyz(s.force[i]));
        double_vec p = {mass * y.x - length * f.x, mass * y.y - length * f.y, mass * y.z - length * f.z};
        double_vec turning = cross_of(d, p);
        double terms[TORQUE_SUMS] = {
            mass, mass * d.x, mass * d.y, mass * d.z,
            mass * d.x * d.x, mass * d.y * d.y, mass * d.z * d.z,
            mass * d.x * d.y, mass * d.y * d.z, mass * d.z * d.x,
            p.x, p.y, p.z, turning.x, turning.y, turning.z,
        };
#pragma unroll
        for (uint q = 0; q < TORQUE_SUMS; q++) sums[q] += terms[q];
    }
#pragma unroll
    for (uint q = 0; q < TORQUE_SUMS; q++) {
        __syncthreads();
        memory[threadIdx.x] = sums[q];
        for (uint half = TORQUE_THREADS / 2; half > 0; half /= 2) {
            __syncthreads();
            if (threadIdx.x < half) memory[threadIdx.x] += memory[threadIdx.x + half];
        }
        if (threadIdx.x == 0) pieces.sums[(size_t)blockIdx.x * TORQUE_SUMS + q] = memory[0];
    }
}

// The angular velocity of a body with this inertia tensor and angular momentum, by elimination with diagonal pivots.
// Without inertia about an axis all particles lie on it: the component along it is zero.
__device__ void turning_rate(double tensor[3][3], double momentum[3], double rate[3]) {
    uint order[3] = {0, 1, 2};
    double largest = fmax(fmax(tensor[0][0], tensor[1][1]), tensor[2][2]);
    uint rank = 0;
    for (; rank < 3; rank++) {
        uint pivot = rank;
        for (uint k = rank; k < 3; k++) {
            if (tensor[order[k]][order[k]] > tensor[order[pivot]][order[pivot]]) pivot = k;
        }
        uint p = order[pivot];
        order[pivot] = order[rank];
        order[rank] = p;
        if (tensor[p][p] <= INERTIA_SHARE_MIN * largest) break;
        for (uint i = rank + 1; i < 3; i++) {
            double factor = tensor[order[i]][p] / tensor[p][p];
            for (uint j = rank + 1; j < 3; j++) tensor[order[i]][order[j]] -= factor * tensor[p][order[j]];
            momentum[order[i]] -= factor * momentum[p];
        }
    }
    rate[0] = rate[1] = rate[2] = 0;
    for (uint left = rank; left > 0; left--) {
        uint p = order[left - 1];
        double known = 0;
        for (uint k = left; k < rank; k++) known += tensor[p][order[k]] * rate[order[k]];
        rate[p] = (momentum[p] - known) / tensor[p][p];
    }
}

extern "C" __global__ void torque_correct_turn(const __grid_constant__ Solver s, const __grid_constant__ Pieces pieces) {
    __shared__ double memory[TORQUE_SUMS];
    uint2 row = pieces.rows[blockIdx.x];
    if (threadIdx.x < TORQUE_SUMS) {
        double sum = 0;
        for (uint block = row.x; block < row.y; block++) sum += pieces.sums[(size_t)block * TORQUE_SUMS + threadIdx.x];
        memory[threadIdx.x] = sum;
    }
    __syncthreads();
    if (threadIdx.x > 0) return;
    const double* q = memory;
    double mass = q[0];
    double_vec c = {q[1] / mass, q[2] / mass, q[3] / mass};
    double_vec moved = cross_of(c, {q[10], q[11], q[12]});
    // About the centre of mass.
    double momentum[3] = {q[13] - moved.x, q[14] - moved.y, q[15] - moved.z};
    double xx = q[4] - mass * c.x * c.x, yy = q[5] - mass * c.y * c.y, zz = q[6] - mass * c.z * c.z;
    double xy = q[7] - mass * c.x * c.y, yz = q[8] - mass * c.y * c.z, zx = q[9] - mass * c.z * c.x;
    double tensor[3][3] = {{yy + zz, -xy, -zx}, {-xy, zz + xx, -yz}, {-zx, -yz, xx + yy}};
    double rate[3];
    turning_rate(tensor, momentum, rate);
    double_vec origin = piece_origin(s, pieces, blockIdx.x);
    double turn[TURN_NUMBERS] = {origin.x, origin.y, origin.z, c.x, c.y, c.z, rate[0], rate[1], rate[2]};
    for (uint k = 0; k < TURN_NUMBERS; k++) pieces.turns[TURN_NUMBERS * blockIdx.x + k] = turn[k];
}

extern "C" __global__ void torque_correct(const __grid_constant__ Solver s, const __grid_constant__ Linear l, const __grid_constant__ Pieces pieces) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    uint piece = pieces.piece_of[i];
    if (piece == NO_PIECE) return;
    const double* turn = pieces.turns + TURN_NUMBERS * piece;
    double_vec x = double_of(xyz(s.position[s.present][i]));
    double_vec arm = {x.x - turn[0] - turn[3], x.y - turn[1] - turn[4], x.z - turn[2] - turn[5]};
    double_vec change = cross_of({turn[6], turn[7], turn[8]}, arm);
    real4 y = l.vectors[SOLUTION][i];
    y.x = (real)((double)y.x - change.x);
    y.y = (real)((double)y.y - change.y);
    y.z = (real)((double)y.z - change.z);
    l.vectors[SOLUTION][i] = y;
}
