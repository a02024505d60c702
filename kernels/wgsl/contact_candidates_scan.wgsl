// NUMERICS section 8, building the candidate list, second pass: gives each cell a range of places.
// Within a block of cells ranges follow each other; blocks come in any order.
//!include model substep status contact_list

@group(0) @binding(25) var<storage, read_write> cell_counts: array<u32>;
// First place and end of each cell.
@group(0) @binding(26) var<storage, read_write> cell_ranges: array<vec2<u32>>;

const SCAN_THREADS: u32 = 256u;
const CELLS_PER_THREAD: u32 = 4u;

var<workgroup> sums: array<u32, SCAN_THREADS>;
var<workgroup> block_start: u32;

@compute @workgroup_size(SCAN_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let wanted = contact_list_is_wanted();
    let block = workgroup.x + workgroup.y * groups.x;
    let first = (block * SCAN_THREADS + thread) * CELLS_PER_THREAD;
    let is_inside = wanted && first <= contact.cell_mask;
    var counts: array<u32, CELLS_PER_THREAD>;
    var sum = 0u;
    if is_inside {
        for (var k = 0u; k < CELLS_PER_THREAD; k += 1u) {
            counts[k] = cell_counts[first + k];
            cell_counts[first + k] = 0u;
            sum += counts[k];
        }
    }
    sums[thread] = sum;
    // Hillis and Steele (1986), "Data parallel algorithms".
    for (var distance = 1u; distance < SCAN_THREADS; distance *= 2u) {
        workgroupBarrier();
        var before = 0u;
        if thread >= distance {
            before = sums[thread - distance];
        }
        workgroupBarrier();
        sums[thread] += before;
    }
    workgroupBarrier();
    if thread == SCAN_THREADS - 1u && wanted {
        block_start = atomicAdd(&status.cell_particles, sums[thread]);
    }
    workgroupBarrier();
    if is_inside {
        var place = block_start + sums[thread] - sum;
        for (var k = 0u; k < CELLS_PER_THREAD; k += 1u) {
            cell_ranges[first + k] = vec2<u32>(place, place + counts[k]);
            place += counts[k];
        }
    }
    if wanted && block == 0u && thread == 0u {
        status.contact_building = substep.contact_tick;
    }
}
