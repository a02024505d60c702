// NUMERICS section 8, second pass: gives each group a region that it is expected to stay in, and puts that into the
// cells it touches, if the list is to be built.
//!include model substep status motion group contact_turn group_box contact_wanted cells

var<workgroup> is_wanted: u32;

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
        is_wanted = select(0u, 1u, contact_list_is_wanted(atomicLoad(&status.contact_built)));
    }
    if workgroupUniformLoad(&is_wanted) == 0u {
        return;
    }
    // Nothing that is written here is read in this pass.
    let table = status.contact_rebuilds & 1u;
    if group == 0u && lane == 0u {
        status.contact_table = table;
        atomicStore(&status.contact_listed, 0u);
    }
    let member = group_members[group * GROUP + lane];
    let particle = select(member, group_members[group * GROUP], member == NONE);
    let position = position_in[particle].xyz;
    let later = add_scaled(position, contact.horizon, velocity_in[particle].xyz);
    let now = group_box(lane, position);
    let then = group_box(lane, later);
    let ways = Box(min(now.low, then.low), max(now.high, then.high));
    // What moves fast strays far.
    let margin = contact.margin + 0.25 * ((now.low - ways.low) + (ways.high - now.high));
    let region = box_grown(ways, margin);
    if lane == 0u {
        let row = group_row(group);
        group_rows[row] = vec4<u32>(bitcast<vec3<u32>>(region.low), 0u);
        group_rows[row + 1u] = vec4<u32>(bitcast<vec3<u32>>(region.high), 0u);
    }
    let cover = cover_of(region);
    if cover.count > COVER_MAX {
        if lane == 0u {
            atomicMax(&status.contact_large, substep.contact_tick);
        }
    } else if lane < cover.count {
        let cell = cover_cell(cover, lane);
        let node = group * COVER_MAX + lane;
        let next = atomicExchange(&cell_heads[cell_place(table, cell)], node + 1u);
        cell_nodes[node] = vec2<u32>(next, cell_name(cell));
    }
}
