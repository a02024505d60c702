// NUMERICS sections 11 and 12, implicit_assemble: what triangles and folds of fabric add to the diagonal blocks and to the right-hand side, after the blocks
// off the diagonal.
//!include model status fabric_gather element_sums

@group(0) @binding(66) var<storage, read> element_entries: array<u32>;

const SLICE: u32 = 32u;
const ENTRY_WORDS: u32 = 320u;
const NO_COLUMN: u32 = 0xffffffffu;

fn block_number(at: u32, number: u32) -> f32 {
    return bitcast<f32>(element_entries[at + (1u + number) * SLICE]);
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    // Minus the sum of the row, by which products stand for the diagonal block.
    var on = vec3f(0.0);
    var off = vec3f(0.0);
    let slice = particle / SLICE;
    let end = element_entries[slice + 1u];
    for (var at = element_entries[slice] + particle % SLICE; at < end; at += ENTRY_WORDS) {
        if element_entries[at] == NO_COLUMN {
            break;
        }
        on -= vec3f(block_number(at, 0u), block_number(at, 4u), block_number(at, 8u));
        off -= vec3f(block_number(at, 1u), block_number(at, 2u), block_number(at, 5u));
    }
    element_sums[3u * particle] = vec4f(on, 0.0);
    element_sums[3u * particle + 1u] = vec4f(off, 0.0);
    element_sums[3u * particle + 2u] = vec4f(membrane_force(particle) + bending_force(particle), 0.0);
}
