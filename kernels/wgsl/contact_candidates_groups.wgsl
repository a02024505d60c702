// NUMERICS section 8, third pass: for each group the groups whose regions come near its own, if the list is to be
// built. In no particular order: what is made of it does not depend on that.
//!include model substep status group contact_wanted cells group_region

var<workgroup> is_building: u32;
var<workgroup> found: atomic<u32>;

fn row_add(row: u32, other: u32) {
    let k = atomicAdd(&found, 1u);
    if k < contact.group_capacity {
        group_rows[row + ROW_HEADER + k / 4u][k % 4u] = other;
    }
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let group = group_index(workgroup, groups);
    if group >= contact.group_count {
        return;
    }
    if lane == 0u {
        // The list counts as built as soon as one workgroup gets here.
        let built = atomicLoad(&status.contact_built);
        is_building = select(0u, 1u, built == substep.contact_tick || contact_list_is_wanted(built));
        atomicStore(&found, 0u);
    }
    if workgroupUniformLoad(&is_building) == 0u {
        return;
    }
    let table = status.contact_table;
    let cells = contact.cell_mask + 1u;
    for (var cell = group * GROUP + lane; cell < cells; cell += contact.group_count * GROUP) {
        atomicStore(&cell_heads[(1u - table) * cells + cell], 0u);
    }
    let row = group_row(group);
    let region = group_region(group);
    let around = box_grown(region, contact_reach(region));
    let cover = cover_of(region);
    if atomicLoad(&status.contact_large) == substep.contact_tick {
        // Some region has too many cells: that happens to what flies apart, and takes long.
        for (var other = lane; other < contact.group_count; other += GROUP) {
            if boxes_meet(around, group_region(other)) {
                row_add(row, other);
            }
        }
    } else if lane < cover.count {
        let cell = cover_cell(cover, lane);
        let name = cell_name(cell);
        var node = atomicLoad(&cell_heads[cell_place(table, cell)]);
        while node != 0u {
            let entry = cell_nodes[node - 1u];
            let other = (node - 1u) / COVER_MAX;
            node = entry.x;
            if entry.y != name {
                continue;
            }
            let theirs = group_region(other);
            // Two regions share cells, and are listed in the lowest.
            if boxes_meet(around, theirs) && all(cell == max(cover.low, cover_of(theirs).low)) {
                row_add(row, other);
            }
        }
    }
    let total = workgroupUniformLoad(&found);
    if lane == 0u {
        group_rows[row].w = min(total, contact.group_capacity);
        if total > contact.group_capacity {
            atomicOr(&status.invalid, INVALID_OVERFLOW);
            atomicMax(&status.contact_group_needed, total);
        }
        atomicAdd(&status.contact_listed, total);
        if group == 0u {
            atomicStore(&status.contact_built, substep.contact_tick);
            status.contact_rebuilds += 1u;
        }
    }
}
