// NUMERICS sections 11 and 12, implicit_assemble: the blocks off the diagonal that triangles and folds of fabric add. A thread for each.
//!include model status fabric

@group(0) @binding(65) var<storage, read> fabric_tangents: array<vec4f>;
@group(0) @binding(66) var<storage, read_write> element_entries: array<u32>;
// Where the terms of each place of the rows begin, and the end; then the terms: the number of a triangle or fold, the place of the particle of the row in
// it, and that of the column, of two bits each.
@group(0) @binding(83) var<storage, read> fabric_terms: array<u32>;

const OF_FOLD: u32 = 0x80000000u;
const TERM_SHIFT: u32 = 4u;
const SLICE: u32 = 32u;
const ENTRY_WORDS: u32 = 320u;
const NO_COLUMN: u32 = 0xffffffffu;

// Derivatives of the hat function of a corner by u and v.
fn corner_gradient(inverse: vec4f, corner: u32) -> vec2f {
    if corner == 0u {
        return -(inverse.xy + inverse.zw);
    }
    return select(inverse.zw, inverse.xy, corner == 1u);
}

// The block of corners a and b of a triangle, by rows.
fn membrane_block(number: u32, a: u32, b: u32) -> mat3x3f {
    let inverse = bitcast<vec4f>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_INVERSE]);
    let u = fabric_tangents[4u * number].xyz;
    let shear = fabric_tangents[4u * number].w;
    let v = fabric_tangents[4u * number + 1u].xyz;
    let k = fabric_tangents[4u * number + 2u].xyz;
    let stress = fabric_tangents[4u * number + 3u].xyz;
    let own = corner_gradient(inverse, a);
    let other = corner_gradient(inverse, b);
    let shear_a = fma(vec3f(own.x), v, own.y * u);
    let shear_b = fma(vec3f(other.x), v, other.y * u);
    let along_u = fma(vec3f(k.y * other.y), v, k.x * other.x * u);
    let along_v = fma(vec3f(k.z * other.y), v, k.y * other.x * u);
    let isotropic = own.x * fma(stress.z, other.y, stress.x * other.x) + own.y * fma(stress.y, other.y, stress.z * other.x);
    var rows: mat3x3f;
    for (var row = 0u; row < 3u; row += 1u) {
        var sum = own.x * u[row] * along_u;
        sum = fma(vec3f(own.y * v[row]), along_v, sum);
        sum = fma(vec3f(shear * shear_a[row]), shear_b, sum);
        sum[row] += isotropic;
        rows[row] = sum;
    }
    return rows;
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let place = particle_index(id, groups);
    let slices = (model.particle_count + SLICE - 1u) / SLICE;
    let at = slices + 1u + place / SLICE * ENTRY_WORDS + place % SLICE;
    if is_stopped() || at >= element_entries[slices] || element_entries[at] == NO_COLUMN {
        return;
    }
    var rows: mat3x3f;
    let end = fabric_terms[place + 1u];
    for (var k = fabric_terms[place]; k < end; k += 1u) {
        let term = fabric_terms[k];
        let number = (term & ~OF_FOLD) >> TERM_SHIFT;
        let a = (term >> 2u) & 3u;
        let b = term & 3u;
        if (term & OF_FOLD) != 0u {
            let vectors = 4u * (model.element_count + number);
            let own = fabric_tangents[vectors + a].xyz;
            let other = fabric_tangents[vectors + b].xyz;
            rows[0] = fma(vec3f(own.x), other, rows[0]);
            rows[1] = fma(vec3f(own.y), other, rows[1]);
            rows[2] = fma(vec3f(own.z), other, rows[2]);
            continue;
        }
        // Below the diagonal it is that of the other row, turned around.
        let corners = fabric_elements[number * ELEMENT_WORDS];
        let is_below = corners[b] < corners[a];
        var block = membrane_block(number, select(a, b, is_below), select(b, a, is_below));
        if is_below {
            block = transpose(block);
        }
        rows += block;
    }
    for (var row = 0u; row < 3u; row += 1u) {
        for (var column = 0u; column < 3u; column += 1u) {
            element_entries[at + (1u + 3u * row + column) * SLICE] = bitcast<u32>(rows[row][column]);
        }
    }
}
