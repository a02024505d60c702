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
        // By which products stand for the diagonal block.
        vec3 rest_on = {0, 0, 0}, rest_off = {0, 0, 0};
        for (uint entry = l.element_slices[i / SLICE], end = l.element_slices[i / SLICE + 1]; entry < end; entry++) {
            if (l.element_columns[entry * SLICE + i % SLICE] == NONE) break;
            const real* b = l.element_blocks + element_place(entry, i);
            rest_on = rest_on - make_vec3(b[0], b[4 * SLICE], b[8 * SLICE]);
            rest_off = rest_off - make_vec3(b[1 * SLICE], b[2 * SLICE], b[5 * SLICE]);
        }
        on = on + rest_on;
        off = off + rest_off;
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

// What triangles and folds add to the blocks of the matrix off its diagonal, in this order: a thread for each block.
extern "C" __global__ void implicit_assemble_fabric(const __grid_constant__ Solver s, const __grid_constant__ Linear l) {
    uint place = blockIdx.x * blockDim.x + threadIdx.x;
    uint entries = l.element_slices[(s.count + SLICE - 1) / SLICE];
    if (place >= entries * SLICE || l.element_columns[place] == NONE) return;
    real sum[9] = {};
    uint k = l.term_offsets[place], end = l.term_offsets[place + 1];
    for (; k < end && !(l.terms[k] & OF_FOLD); k++) {
        uint term = l.terms[k], number = term >> TERM_SHIFT, own = term >> 2 & 3, other = term & 3;
        const MembraneTriangle& triangle = s.membranes[number];
        // Below the diagonal it is that of the other row, turned around.
        bool is_below = triangle.particles[other] < triangle.particles[own];
        ElementBlock block = membrane_block(triangle, l.membrane_tangents[number], is_below ? other : own, is_below ? own : other);
#pragma unroll
        for (uint n = 0; n < 9; n++) sum[n] += is_below ? block.entries[n % 3][n / 3] : block.entries[n / 3][n % 3];
    }
    for (; k < end; k++) {
        uint term = l.terms[k];
        const real4* tangent = l.fold_tangents + 4 * (size_t)((term & ~OF_FOLD) >> TERM_SHIFT);
        vec3 own = xyz(tangent[term >> 2 & 3]), other = xyz(tangent[term & 3]);
#pragma unroll
        for (uint n = 0; n < 9; n++) sum[n] += component(other, n % 3) * component(own, n / 3);
    }
    real* block = l.element_blocks + element_place(place / SLICE, place % SLICE);
#pragma unroll
    for (uint n = 0; n < 9; n++) block[n * SLICE] = sum[n];
}
