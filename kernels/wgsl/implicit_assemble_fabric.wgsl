// NUMERICS sections 11 and 12, implicit_assemble: what triangles of fabric add. A thread for each block of row i and a larger column, which is
// that of the row of the column too, and one for the diagonal block and the right-hand side.
//!include model status fabric element_sums

@group(0) @binding(63) var<storage, read> fabric_rows: array<u32>;
@group(0) @binding(64) var<storage, read> fabric_vectors: array<vec4f>;
@group(0) @binding(65) var<storage, read> fabric_tangents: array<f32>;
@group(0) @binding(66) var<storage, read_write> element_entries: array<u32>;

const TANGENT_WORDS: u32 = 122u;
const TANGENT_CURVATURES: u32 = 13u;
const TANGENT_WEIGHT: u32 = 121u;
const PATCH_VERTICES: u32 = 12u;
const SLICE: u32 = 32u;
const ENTRY_WORDS: u32 = 320u;
const NO_COLUMN: u32 = 0xffffffffu;

fn tangent_vector(at: u32) -> vec3f {
    return vec3f(fabric_tangents[at], fabric_tangents[at + 1u], fabric_tangents[at + 2u]);
}

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
    let at = number * TANGENT_WORDS;
    let u = tangent_vector(at);
    let v = tangent_vector(at + 3u);
    let k = tangent_vector(at + 6u);
    let shear = fabric_tangents[at + 9u];
    let stress = tangent_vector(at + 10u);
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

// The block of places a and b of a patch, by rows.
fn bending_block(number: u32, a: u32, b: u32) -> mat3x3f {
    let weight = fabric_tangents[number * TANGENT_WORDS + TANGENT_WEIGHT];
    let plate = weight * bitcast<vec4f>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_PLATE]);
    let curvatures = number * TANGENT_WORDS + TANGENT_CURVATURES;
    let own = curvatures + 9u * a;
    let other = curvatures + 9u * b;
    // The moments of the three curvatures for a motion of place b.
    let k11 = tangent_vector(other);
    let k22 = tangent_vector(other + 3u);
    let m11 = fma(vec3f(plate.z), k22, plate.x * k11);
    let m22 = fma(vec3f(plate.y), k22, plate.z * k11);
    let m12 = plate.w * tangent_vector(other + 6u);
    var moments = mat3x3f(m11, m22, m12);
    var rows: mat3x3f;
    for (var k = 0u; k < 3u; k += 1u) {
        let gradient = tangent_vector(own + 3u * k);
        rows[0] = fma(vec3f(gradient.x), moments[k], rows[0]);
        rows[1] = fma(vec3f(gradient.y), moments[k], rows[1]);
        rows[2] = fma(vec3f(gradient.z), moments[k], rows[2]);
    }
    return rows;
}

// The block of particles i and j: the sum over the triangles of i in their order.
fn element_block(i: u32, j: u32) -> mat3x3f {
    var block: mat3x3f;
    let end = fabric_rows[i + 1u];
    for (var at = fabric_rows[i]; at < end; at += 1u) {
        let entry = fabric_rows[at];
        for (var b = 0u; b < 3u; b += 1u) {
            if patch_particle(entry / 3u, b) == j {
                block += membrane_block(entry / 3u, entry % 3u, b);
            }
        }
    }
    let row = model.particle_count + 1u + i;
    let end_of_patches = fabric_rows[row + 1u];
    for (var at = fabric_rows[row]; at < end_of_patches; at += 1u) {
        let entry = fabric_rows[at] - 3u * model.element_count;
        let number = entry / PATCH_VERTICES;
        for (var b = 0u; b < PATCH_VERTICES; b += 1u) {
            if patch_particle(number, b) == j {
                block += bending_block(number, entry % PATCH_VERTICES, b);
            }
        }
    }
    return block;
}

fn impulses_sum(start: vec3f, row: u32) -> vec3f {
    var sum = start;
    let end = fabric_rows[row + 1u];
    for (var at = fabric_rows[row]; at < end; at += 1u) {
        sum += fabric_vectors[fabric_rows[at]].xyz;
    }
    return sum;
}

// Where the entry of row j with column i is.
fn entry_find(j: u32, i: u32) -> u32 {
    let start = element_entries[j / SLICE] + j % SLICE;
    var first = 0u;
    var last = (element_entries[j / SLICE + 1u] - element_entries[j / SLICE]) / ENTRY_WORDS;
    while first < last {
        let middle = (first + last) / 2u;
        // Empty places are behind all columns.
        if element_entries[start + middle * ENTRY_WORDS] < i {
            first = middle + 1u;
        } else {
            last = middle;
        }
    }
    return start + first * ENTRY_WORDS;
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let index = particle_index(id, groups);
    let rows = (model.particle_count + SLICE - 1u) / SLICE * SLICE;
    let i = index % rows;
    let k = index / rows;
    if i >= model.particle_count || is_stopped() {
        return;
    }
    if k == 0u {
        let block = element_block(i, i);
        let right = impulses_sum(impulses_sum(vec3f(0.0), i), model.particle_count + 1u + i);
        element_sums[3u * i] = vec4f(block[0].x, block[1].y, block[2].z, 0.0);
        element_sums[3u * i + 1u] = vec4f(block[0].y, block[0].z, block[1].z, 0.0);
        element_sums[3u * i + 2u] = vec4f(right, 0.0);
        return;
    }
    let at = element_entries[i / SLICE] + (k - 1u) * ENTRY_WORDS + i % SLICE;
    if at >= element_entries[i / SLICE + 1u] {
        return;
    }
    let j = element_entries[at];
    if j == NO_COLUMN || j < i {
        return;
    }
    var block = element_block(i, j);
    let other = entry_find(j, i);
    for (var row = 0u; row < 3u; row += 1u) {
        for (var column = 0u; column < 3u; column += 1u) {
            let number = bitcast<u32>(block[row][column]);
            element_entries[at + (1u + 3u * row + column) * SLICE] = number;
            element_entries[other + (1u + 3u * column + row) * SLICE] = number;
        }
    }
}
