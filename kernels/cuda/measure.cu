// NUMERICS section 10, `measure`: sums over blocks of 512 particles, within a block in the order of
// particles, packets of 16 where the CPU has them; the host adds the blocks in order.

#define BLOCK 512
#define LANES 16
// Numbers of a block: strain_max, strain_particle, strain_sum, ends, elastic, force 3, magnitude, momentum 3,
// kinetic, potential, penetration, non-finite particle or -1.
#define FIGURES 16

extern "C" __global__ void __launch_bounds__(512) measure(const __grid_constant__ Solver s, double ax, double ay, double az, uint collider_first) {
    __shared__ double values[5 * BLOCK];
    real* numbers = (real*)values;
    uint t = threadIdx.x;
    uint i = blockIdx.x * BLOCK + t;
    bool exists = i < s.count;
    Motion motion = present_motion(s);
    double* out = s.partials + (size_t)blockIdx.x * FIGURES;
    uint used = min(s.count - blockIdx.x * BLOCK, (uint)BLOCK);
    real4 x = {0, 0, 0, 0}, v = {0, 0, 0, 0};
    if (exists) {
        x = motion.x[i];
        v = motion.v[i];
    }
    real strain_max = -1, strain_sum = 0, elastic = 0, magnitude = 0, ends = 0;
    vec3 force = {0, 0, 0};
    if (exists) {
        SpringRow row = spring_row(s, i);
        for (uint k = 0; k < row.count; k++) {
            uint2 entry = spring_entry(s, row, k);
            uint j = i + entry.x;
            SpringKind kind = spring_kind(s, entry.y);
            Spring spring = spring_at(kind, xyz(x), xyz(v), xyz(motion.x[j]), xyz(motion.v[j]));
            real strain = spring.stretch / kind.rest_length;
            // The last number of a kind is zero if its strain is measured.
            if (s.spring_kinds[entry.y].w == 0) strain_max = maximum(strain, strain_max);
            strain_sum += absolute(strain);
            elastic += kind.energy_doubled(spring.stretch);
            magnitude += absolute(spring.tension);
            ends += 1;
            force = force + spring.force();
        }
    }
    // In two rounds, as shared memory holds five numbers of double precision a particle.
    numbers[t] = strain_sum;
    numbers[BLOCK + t] = ends;
    numbers[2 * BLOCK + t] = elastic;
    numbers[3 * BLOCK + t] = strain_max;
    __syncthreads();
    if (t < 2) {
        double sum = 0;
        for (uint k = 0; k < used; k++) sum += (double)numbers[t * BLOCK + k];
        out[2 + t] = sum;
    } else if (t == 32) {
        double sum = 0;
        for (uint k = 0; k < used; k++) sum += 0.25 * (double)numbers[2 * BLOCK + k];
        out[4] = sum;
    } else if (t == 64) {
        double largest = -1;
        uint where = 0;
        for (uint k = 0; k < used; k++) {
            double value = (double)numbers[3 * BLOCK + k];
            if (value > largest) {
                largest = value;
                where = blockIdx.x * BLOCK + k;
            }
        }
        out[0] = largest;
        out[1] = (double)where;
    }
    __syncthreads();
    numbers[t] = force.x;
    numbers[BLOCK + t] = force.y;
    numbers[2 * BLOCK + t] = force.z;
    numbers[3 * BLOCK + t] = magnitude;
    __syncthreads();
    if ((t & 31) == 0 && t / 32 < 4) {
        double sum = 0;
        for (uint k = 0; k < used; k++) sum += (double)numbers[t / 32 * BLOCK + k];
        out[5 + t / 32] = sum;
    }
    __syncthreads();
    double mass = v.w;
    double m[3] = {mass * (double)v.x, mass * (double)v.y, mass * (double)v.z};
    double p[3] = {x.x, x.y, x.z}, a[3] = {ax, ay, az}, w[3] = {v.x, v.y, v.z};
    double kinetic = 0, potential = 0;
    for (uint axis = 0; axis < 3; axis++) {
        kinetic += 0.5 * (mass * w[axis] * w[axis]);
        potential -= mass * (a[axis] * p[axis]);
        values[axis * BLOCK + t] = m[axis];
    }
    values[3 * BLOCK + t] = kinetic;
    values[4 * BLOCK + t] = potential;
    __syncthreads();
    if ((t & 31) == 0 && t / 32 < 5) {
        double sum = 0;
        uint packets = (used + LANES - 1) / LANES;
        for (uint packet = 0; packet < packets; packet++) {
            double part = 0;
            for (uint lane = 0; lane < LANES; lane++) part += values[t / 32 * BLOCK + packet * LANES + lane];
            sum += part;
        }
        out[9 + t / 32] = sum;
    }
    __syncthreads();
    real deepest = 0;
    if (exists && x.w > 0) {
        real offset = s.offsets[i];
        for (uint k = 0; k < s.collider_count; k++) {
            const Collider& c = s.colliders[collider_first + k];
            deepest = maximum(offset - surface_of(c, xyz(x) - collider_translation(c)).distance, deepest);
        }
    }
    bool finite = is_finite(xyz(x)) && is_finite(xyz(v));
    values[t] = deepest;
    values[BLOCK + t] = exists && !finite ? 1 : 0;
    __syncthreads();
    if (t == 0) {
        double largest = 0, broken = -1;
        for (uint k = 0; k < used; k++) {
            largest = values[k] > largest ? values[k] : largest;
            if (broken < 0 && values[BLOCK + k] != 0) broken = (double)(blockIdx.x * BLOCK + k);
        }
        out[14] = largest;
        out[15] = broken;
    }
}
