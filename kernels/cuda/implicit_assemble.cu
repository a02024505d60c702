// NUMERICS section 5, `implicit_assemble`: B, the diagonal blocks D, and the right-hand side.

// Minus the derivative of a third of the force of the air on a triangle by its velocity [N s/m].
__device__ __forceinline__ void air_jacobian_add(const Solver& s, const Motion& motion, const uint4& corners, const real* wind, vec3& on, vec3& off) {
    Flow flow = flow_at(motion, corners, wind);
    real pressure = s.air[2 * corners.w], friction = s.air[2 * corners.w + 1];
    real inverse = (real)1 / maximum(flow.speed, LENGTH_MIN);
    vec3 n = flow.normal, t = flow.along * inverse;
    real across = (real)2 * pressure * absolute(flow.across);
    real along = friction * flow.speed;
    on.x += flow.area * (across * (n.x * n.x) + along * ((real)1 - n.x * n.x + t.x * t.x)) * THIRD;
    on.y += flow.area * (across * (n.y * n.y) + along * ((real)1 - n.y * n.y + t.y * t.y)) * THIRD;
    on.z += flow.area * (across * (n.z * n.z) + along * ((real)1 - n.z * n.z + t.z * t.z)) * THIRD;
    off.x += flow.area * (across * (n.x * n.y) + along * ((real)0 - n.x * n.y + t.x * t.y)) * THIRD;
    off.y += flow.area * (across * (n.x * n.z) + along * ((real)0 - n.x * n.z + t.x * t.z)) * THIRD;
    off.z += flow.area * (across * (n.y * n.z) + along * ((real)0 - n.y * n.z + t.y * t.z)) * THIRD;
}

extern "C" __global__ void implicit_assemble(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint is_iterate) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    Motion motion = present_motion(s);
    real length = l.length;
    real4 own = motion.x[i], rate = motion.v[i];
    vec3 xi = xyz(own), vi = xyz(rate);
    real mass = rate.w;
    vec3 on = {
        mass * ((real)1 + length * s.drag_rate[0]),
        mass * ((real)1 + length * s.drag_rate[1]),
        mass * ((real)1 + length * s.drag_rate[2]),
    };
    vec3 off = {0, 0, 0};
    if (s.has_air) {
        vec3 jacobian_on = {0, 0, 0}, jacobian_off = {0, 0, 0};
        uint end = s.triangle_rows[i + 1];
        for (uint at = s.triangle_rows[i]; at < end; at++) {
            air_jacobian_add(s, motion, s.triangles[at], s.substeps[0].wind, jacobian_on, jacobian_off);
        }
        on = on + length * jacobian_on;
        off = length * jacobian_off;
    }
    l.base[0][i] = with_w(on, 0);
    if (l.is_full) l.base[1][i] = with_w(off, 0);
    if (l.has_elements) {
        on = on + xyz(l.element_sums[i]);
        off = off + xyz(l.element_sums[s.count + i]);
    }
    vec3 right = length * xyz(s.force[i]);
    if (is_iterate) {
        vec3 change = vi - xyz(s.kept_velocity[i]);
        right = {right.x + -(mass * change.x), right.y + -(mass * change.y), right.z + -(mass * change.z)};
    }
    real smallest = LENGTH_MIN * LENGTH_MIN;
    SpringRow row = spring_row(s, i);
    for (uint k = 0; k < row.count; k++) {
        uint at = row.first + (k << row.shift);
        uint2 link = l.links[at];
        uint j = i + link.x;
        vec3 w = xyz(motion.v[j]) - vi;
        vec3 d = xyz(motion.x[j]) - xi;
        SpringBlock spring = spring_block(l, at, factor_place(s, l, link.y, i, j), d);
        vec3 f = spring.u;
        real g = spring.g;
        real along = f.x * w.x + f.y * w.y + f.z * w.z;
        real across = g;
        SpringKind kind = spring_kind(s, s.spring_entries[at].y);
        if (is_iterate) {
            real share = length * kind.damping / maximum(f.x * f.x + f.y * f.y + f.z * f.z, smallest);
            along = share * along;
            across = 0;
        }
        real distance = root(dot(d, d));
        real pull = length * kind.tension(distance - kind.rest_length) / maximum(distance, LENGTH_MIN);
        right.x += pull * d.x + (across * w.x + f.x * along);
        right.y += pull * d.y + (across * w.y + f.y * along);
        right.z += pull * d.z + (across * w.z + f.z * along);
        on.x += g + f.x * f.x;
        on.y += g + f.y * f.y;
        on.z += g + f.z * f.z;
        off.x += f.x * f.y;
        off.y += f.x * f.z;
        off.z += f.y * f.z;
    }
    if (l.has_pairs) {
        real share = is_iterate ? (real)0 : l.pair_share;
        uint count = l.pair_counts[i];
        for (uint k = 0; k < count; k++) {
            vec3 u = xyz(l.pair_factors[(size_t)k * s.count + i]);
            real along = dot(u, xyz(motion.v[l.pair_partners[(size_t)k * s.count + i]]) - vi);
            right.x += share * (u.x * along);
            right.y += share * (u.y * along);
            right.z += share * (u.z * along);
            on = on + make_vec3(u.x * u.x, u.y * u.y, u.z * u.z);
            off = off + make_vec3(u.x * u.y, u.x * u.z, u.y * u.z);
        }
    }
    if (l.has_contacts && contacts_any(l.contacts, i)) {
        // The velocities at the start have moved what touches.
        if (!is_iterate) {
            vec3 sum = contacts_row(l.contacts, motion.v, i);
            for (uint k = l.contacts.offsets[i], end = l.contacts.offsets[i + 1]; k < end; k++) {
                const TriangleContact& contact = l.contacts.contacts[l.contacts.places[k] / 4];
                const real* v = contact.carried;
                sum = sum + contact.weights[l.contacts.places[k] % 4] * make_vec3(v[0], v[1], v[2]);
            }
            right = right + negative(sum);
        }
        vec3 block_on = {0, 0, 0}, block_off = {0, 0, 0};
        for (uint k = l.contacts.offsets[i], end = l.contacts.offsets[i + 1]; k < end; k++) {
            const TriangleContact& contact = l.contacts.contacts[l.contacts.places[k] / 4];
            real w = contact.weights[l.contacts.places[k] % 4];
            const real* m = contact.rows;
            block_on = block_on + (w * w) * make_vec3(m[0], m[1], m[2]);
            block_off = block_off + (w * w) * make_vec3(m[3], m[4], m[5]);
        }
        on = on + block_on;
        off = off + block_off;
    }
    if (l.has_elements) right = right + (fabric_gather(s.membrane_rows, s.membrane_entries, s.membrane_forces, i) + bending_force(s, i));
    l.diagonal[0][i] = with_w(on, 0);
    l.diagonal[1][i] = with_w(off, 0);
    l.vectors[RIGHT_SIDE][i] = with_w(right, 0);
    if (l.has_constraints && l.touch_counts[i] > 0) {
        drag_add(l, i, l.constraints[i].touches, l.touch_counts[i], (real)1, vi);
    }
}

// Rows of a block, each with half a warp, a lane for each place of a patch; and blocks off the diagonal of a row that are summed up at once.
#define ROW_LANES 16
#define ASSEMBLED_ROWS 16
#ifdef CLOTH_F64
#define ROW_BLOCKS 32
#else
#define ROW_BLOCKS 64
#endif

// The sums of a row; the diagonal block comes last.
struct RowSums {
    real blocks[ROW_BLOCKS + 1][9];
    uint columns[ROW_BLOCKS];

    // The block of a column; none if it is not among these.
    __device__ __forceinline__ real* block(uint j, bool is_own) {
        if (is_own) return blocks[ROW_BLOCKS];
        uint place = 0;
#pragma unroll
        for (uint step = ROW_BLOCKS / 2; step > 0; step /= 2) {
            if (columns[place + step - 1] < j) place += step;
        }
        return columns[place] == j ? blocks[place] : nullptr;
    }
};

// What triangles of fabric add to the rows of the matrix, in the order of the triangles. Vertices of a patch that come again have nothing of their own.
extern "C" __global__ void __launch_bounds__(ROW_LANES * ASSEMBLED_ROWS) implicit_assemble_fabric(const __grid_constant__ Solver s, const __grid_constant__ Linear l) {
    __shared__ RowSums rows[ASSEMBLED_ROWS];
    uint t = threadIdx.x, lane = t % ROW_LANES, first = blockIdx.x * ASSEMBLED_ROWS, i = first + t / ROW_LANES;
    RowSums& row = rows[t / ROW_LANES];
    bool exists = i < s.count;
    // Both rows of a warp take as many turns.
    auto turns = [&](const uint* starts) {
        uint count = exists ? starts[i + 1] - starts[i] : 0;
        return max(count, __shfl_xor_sync(ALL_LANES, count, ROW_LANES));
    };
    uint membranes = turns(s.membrane_rows), patches = turns(s.bending_rows);
    uint begin = l.element_slices[first / SLICE], end = l.element_slices[first / SLICE + 1];
    // Once for rows without any neighbours as well.
    for (uint base = begin; base == begin || base < end; base += ROW_BLOCKS) {
        for (uint at = t; at < ROW_BLOCKS * ASSEMBLED_ROWS; at += ROW_LANES * ASSEMBLED_ROWS) {
            uint entry = base + at / ASSEMBLED_ROWS, k = at % ASSEMBLED_ROWS;
            rows[k].columns[at / ASSEMBLED_ROWS] = entry < end ? l.element_columns[entry * SLICE + (first + k) % SLICE] : NONE;
        }
        for (uint at = lane; at < 9 * (ROW_BLOCKS + 1); at += ROW_LANES) row.blocks[0][at] = 0;
        __syncthreads();
        for (uint k = 0; k < membranes; k++) {
            uint at = exists ? s.membrane_rows[i] + k : 0;
            if (exists && at < s.membrane_rows[i + 1] && lane < 3) {
                uint number = s.membrane_entries[at] / 3, own = s.membrane_entries[at] % 3;
                const MembraneTriangle& triangle = s.membranes[number];
                uint j = triangle.particles[lane];
                real* to = row.block(j, j == i);
                if (to) {
                    // Below the diagonal it is that of the other row, turned around.
                    bool is_below = j < i;
                    ElementBlock block = membrane_block(triangle, l.membrane_tangents[number], is_below ? lane : own, is_below ? own : lane);
#pragma unroll
                    for (uint n = 0; n < 9; n++) to[n] += is_below ? block.entries[n % 3][n / 3] : block.entries[n / 3][n % 3];
                }
            }
            __syncwarp();
        }
        for (uint k = 0; k < patches; k++) {
            uint at = exists ? s.bending_rows[i] + k : 0;
            bool is_there = exists && at < s.bending_rows[i + 1];
            uint own = 0, j = COMES_AGAIN;
            real of[9] = {};
            if (is_there && lane < PATCH_VERTICES) {
                uint entry = s.bending_entries[at], number = entry / PATCH_VERTICES;
                own = entry % PATCH_VERTICES;
                j = ((const uint*)s.patches[number].particles)[lane];
                const real* tangent = l.bending_tangents + (size_t)number * BENDING_TANGENT;
                const real4 a = ((const real4*)tangent)[lane], b = ((const real4*)tangent)[PATCH_VERTICES + lane];
                of[0] = a.x;
                of[1] = a.y;
                of[2] = a.z;
                of[3] = a.w;
                of[4] = b.x;
                of[5] = b.y;
                of[6] = b.z;
                of[7] = b.w;
                of[8] = tangent[tangent_place(lane, 8)];
            }
            uint source = t % WARP / ROW_LANES * ROW_LANES + own;
            bool comes_again = __shfl_sync(ALL_LANES, j, source) & COMES_AGAIN;
            real self[9];
#pragma unroll
            for (uint n = 0; n < 9; n++) self[n] = __shfl_sync(ALL_LANES, of[n], source);
            if (!comes_again && !(j & COMES_AGAIN)) {
                real* to = row.block(j, j == i);
                if (to) {
#pragma unroll
                    for (uint n = 0; n < 9; n++) {
                        uint r = n / 3, c = n % 3;
                        to[n] += of[c] * self[r] + of[3 + c] * self[3 + r] + of[6 + c] * self[6 + r];
                    }
                }
            }
            __syncwarp();
        }
        __syncthreads();
        if (base == begin && t < ASSEMBLED_ROWS && first + t < s.count) {
            const real* b = rows[t].blocks[ROW_BLOCKS];
            l.element_sums[first + t] = {b[0], b[4], b[8], 0};
            l.element_sums[s.count + first + t] = {b[1], b[2], b[5], 0};
        }
        // Rows are side by side in memory.
        for (uint at = t; at < 9 * ROW_BLOCKS * ASSEMBLED_ROWS; at += ROW_LANES * ASSEMBLED_ROWS) {
            uint k = at % ASSEMBLED_ROWS, n = at / ASSEMBLED_ROWS % 9, place = at / (9 * ASSEMBLED_ROWS);
            if (base + place >= end) break;
            if (rows[k].columns[place] != NONE) l.element_blocks[element_place(base + place, first + k) + n * SLICE] = rows[k].blocks[place][n];
        }
        __syncthreads();
    }
}
