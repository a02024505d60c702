// NUMERICS sections 11 and 12, implicit_assemble: what triangles of fabric add to the rows of the matrix, and to the right-hand side, in the order of the
// triangles. Four rows of a workgroup, each with sixteen threads, one for each place of a patch.
//!include model status fabric element_sums

@group(0) @binding(63) var<storage, read> fabric_rows: array<u32>;
@group(0) @binding(64) var<storage, read> fabric_vectors: array<vec4f>;
@group(0) @binding(65) var<storage, read> fabric_tangents: array<f32>;
@group(0) @binding(66) var<storage, read_write> element_entries: array<u32>;

const TANGENT_WORDS: u32 = 121u;
const TANGENT_PATCH: u32 = 13u;
const SLICE: u32 = 32u;
const ENTRY_WORDS: u32 = 320u;
const NO_COLUMN: u32 = 0xffffffffu;
const NO_BLOCK: u32 = 0xffffffffu;
const ROWS: u32 = 4u;
const ROW_THREADS: u32 = 16u;
// Blocks off the diagonal of a row that are summed up at once; the diagonal block is behind them.
const ROW_BLOCKS: u32 = 64u;
const ROW_NUMBERS: u32 = 585u;

var<workgroup> columns: array<u32, 256>;
var<workgroup> sums: array<f32, 2340>;
// The largest numbers of triangles and of patches around a row; where the entries of the slice begin, and how many there are.
var<workgroup> shared_span: vec4<u32>;

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

// Where the sum of the block of a column is, if it is among these.
fn block_find(k: u32, j: u32, is_own: bool) -> u32 {
    if is_own {
        return k * ROW_NUMBERS + 9u * ROW_BLOCKS;
    }
    var place = 0u;
    for (var step = ROW_BLOCKS / 2u; step > 0u; step /= 2u) {
        // Empty places are behind all columns.
        place += select(0u, step, columns[k * ROW_BLOCKS + place + step - 1u] < j);
    }
    return select(NO_BLOCK, k * ROW_NUMBERS + 9u * place, columns[k * ROW_BLOCKS + place] == j);
}

fn block_add(at: u32, rows: mat3x3f) {
    for (var row = 0u; row < 3u; row += 1u) {
        sums[at + 3u * row] += rows[row].x;
        sums[at + 3u * row + 1u] += rows[row].y;
        sums[at + 3u * row + 2u] += rows[row].z;
    }
}

// What a triangle adds to the block of row i and one of its corners.
fn membrane_add(k: u32, i: u32, entry: u32, corner: u32) {
    let number = entry / 3u;
    let j = patch_particle(number, corner);
    let at = block_find(k, j, j == i);
    if at == NO_BLOCK {
        return;
    }
    // Below the diagonal it is that of the other row, turned around.
    if j < i {
        block_add(at, transpose(membrane_block(number, corner, entry % 3u)));
    } else {
        block_add(at, membrane_block(number, entry % 3u, corner));
    }
}

// What a patch adds to the block of row i and one of its places. Vertices that come again have nothing of their own.
fn bending_add(k: u32, i: u32, entry: u32, place: u32) {
    let number = entry / PATCH_VERTICES;
    let j = patch_particle(number, place);
    if ((j | patch_particle(number, entry % PATCH_VERTICES)) & COMES_AGAIN) != 0u {
        return;
    }
    let at = block_find(k, j, j == i);
    if at == NO_BLOCK {
        return;
    }
    let vectors = number * TANGENT_WORDS + TANGENT_PATCH;
    var rows: mat3x3f;
    for (var part = 0u; part < 9u; part += 3u) {
        let own = tangent_vector(vectors + 9u * (entry % PATCH_VERTICES) + part);
        let other = tangent_vector(vectors + 9u * place + part);
        rows[0] = fma(vec3f(own.x), other, rows[0]);
        rows[1] = fma(vec3f(own.y), other, rows[1]);
        rows[2] = fma(vec3f(own.z), other, rows[2]);
    }
    block_add(at, rows);
}

// Where rows of particles are in `fabric_rows`: those of triangles, of patches, of folds.
fn row_of(kind: u32, i: u32) -> u32 {
    return kind * (model.particle_count + 1u) + i;
}

fn row_length(kind: u32, i: u32) -> u32 {
    return fabric_rows[row_of(kind, i) + 1u] - fabric_rows[row_of(kind, i)];
}

fn impulses_sum(kind: u32, i: u32) -> vec3f {
    var sum = vec3f(0.0);
    let end = fabric_rows[row_of(kind, i) + 1u];
    for (var at = fabric_rows[row_of(kind, i)]; at < end; at += 1u) {
        sum += fabric_vectors[fabric_rows[at]].xyz;
    }
    return sum;
}

@compute @workgroup_size(64)
fn main(
    @builtin(local_invocation_index) t: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let first = ROWS * (group.x + group.y * groups.x);
    let lane = t % ROW_THREADS;
    let k = t / ROW_THREADS;
    let i = first + k;
    let acts = i < model.particle_count && !is_stopped();
    if t == 0u {
        var found = vec4<u32>(0u);
        if acts {
            for (var row = first; row < min(first + ROWS, model.particle_count); row += 1u) {
                found.x = max(found.x, row_length(0u, row));
                found.y = max(found.y, row_length(1u, row));
            }
            found.z = element_entries[first / SLICE];
            found.w = (element_entries[first / SLICE + 1u] - found.z) / ENTRY_WORDS;
        }
        shared_span = found;
    }
    let span = workgroupUniformLoad(&shared_span);
    if acts && lane == 0u {
        element_sums[3u * i + 2u] = vec4f(impulses_sum(0u, i) + impulses_sum(2u, i), 0.0);
    }
    // Once for rows without any neighbours as well.
    for (var base = 0u; base == 0u || base < span.w; base += ROW_BLOCKS) {
        for (var at = t; at < ROWS * ROW_BLOCKS; at += 64u) {
            let row = at % ROWS;
            let entry = base + at / ROWS;
            var column = NO_COLUMN;
            if entry < span.w {
                column = element_entries[span.z + entry * ENTRY_WORDS + (first + row) % SLICE];
            }
            columns[row * ROW_BLOCKS + at / ROWS] = column;
        }
        for (var at = t; at < ROWS * ROW_NUMBERS; at += 64u) {
            sums[at] = 0.0;
        }
        workgroupBarrier();
        for (var turn = 0u; turn < span.x; turn += 1u) {
            if acts && lane < 3u && turn < row_length(0u, i) {
                membrane_add(k, i, fabric_rows[fabric_rows[row_of(0u, i)] + turn], lane);
            }
            workgroupBarrier();
        }
        for (var turn = 0u; turn < span.y; turn += 1u) {
            if acts && lane < PATCH_VERTICES && turn < row_length(1u, i) {
                let entry = fabric_rows[fabric_rows[row_of(1u, i)] + turn] - 3u * model.element_count;
                bending_add(k, i, entry, lane);
            }
            workgroupBarrier();
        }
        if base == 0u && acts && lane == 0u {
            let at = k * ROW_NUMBERS + 9u * ROW_BLOCKS;
            element_sums[3u * i] = vec4f(sums[at], sums[at + 4u], sums[at + 8u], 0.0);
            element_sums[3u * i + 1u] = vec4f(sums[at + 1u], sums[at + 2u], sums[at + 5u], 0.0);
        }
        if acts {
            for (var place = lane; place < min(ROW_BLOCKS, span.w - base); place += ROW_THREADS) {
                if columns[k * ROW_BLOCKS + place] == NO_COLUMN {
                    continue;
                }
                let at = span.z + (base + place) * ENTRY_WORDS + i % SLICE;
                for (var number = 0u; number < 9u; number += 1u) {
                    element_entries[at + (1u + number) * SLICE] = bitcast<u32>(sums[k * ROW_NUMBERS + 9u * place + number]);
                }
            }
        }
        workgroupBarrier();
    }
}
