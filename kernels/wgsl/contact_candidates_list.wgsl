// NUMERICS section 8, last pass: for each particle its partners in contact at the present positions.
//!include model substep status motion group contact_turn group_box group_boxes group_rows contact_pair
//!if exclusions
//!include contact_exclusions
//!end
//!if not exclusions
//!include contact_exclusions_none
//!end
//!include contact_kept contact_search contact_spill contact_next

@group(0) @binding(17) var<storage, read_write> contact_rows: array<vec2<u32>>;

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
    let member = group_members[group * GROUP + lane];
    let exists = member != NONE;
    let particle = select(group_members[group * GROUP], member, exists);
    var partners = partners_of(group, lane, particle, position_in[particle].xyz);
    if !exists || is_stopped() {
        return;
    }
    var first = partners.place;
    if first == NOWHERE {
        // Every particle has room for as many as are kept.
        first = particle * KEPT;
        for (var k = 0u; k < partners.count; k += 1u) {
            contact_entries[first + k] = partner_next(&partners);
        }
    }
    contact_rows[particle] = vec2<u32>(first, partners.count);
}
