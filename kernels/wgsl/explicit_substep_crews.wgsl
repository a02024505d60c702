// The composite stage of a model of few groups with contact by penalties (`explicit_substep.wgsl`).
//
// So few workgroups leave most of a device idle, and the time is that of one of them: springs, particles to compare and partners are
// shared out among several threads for each particle, and what one waits for is asked for before it is needed. The substep before
// leaves behind the box of each group and, side by side, its particles.
//!include model substep status motion motion_out finite field spring spring_batch integrate collider procedural
//!if grids
//!include distance_grid
//!end
//!if not grids
//!include distance_grid_none
//!end
//!if feedback
//!include feedback
//!end
//!if not feedback
//!include feedback_none
//!end
//!if buckling
//!include spring_buckling
//!end
//!if not buckling
//!include spring_linear
//!end
//!if air
//!include triangles air air_add
//!end
//!if not air
//!include air_add_none
//!end
//!include particle_advance contact_pair contact_counts contact_penalty group crews contact_turn_crews group_box group_boxes
//!include group_boxes_out group_positions group_positions_out group_rows group_region group_check contact_spill
//!include contact_search_crews contact_force_crews

// For each particle the sum over its springs so far.
var<workgroup> spring_sums: array<vec3f, GROUP>;

@compute @workgroup_size(THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let group = group_index(workgroup, groups);
    if group >= contact.group_count {
        return;
    }
    let lane = thread % GROUP;
    let crew = thread / GROUP;
    let own = group_positions_in[group * GROUP + lane];
    let first = group_positions_in[group * GROUP];
    let row = group_row(group);
    let other = row_entry(row, thread);
    let listed = group_rows[row].w;
    let region = group_region(group);
    let box = box_in(group);
    let is_over = is_over();
    // Threads without a particle look at the first one, and store nothing.
    let exists = own.w != NONE;
    let particle = select(first.w, own.w, exists);
    let position = bitcast<vec3f>(select(first.xyz, own.xyz, exists));
    var other_box = box;
    if thread < listed {
        other_box = box_in(other);
    }
    // Crew 1 has the first batch of springs, crew 2 the second, and crew 0 what follows, as it ends the sum. A barrier is needed before
    // the next one adds to it: there are two anyway, but not a third one, which crew 3 would take.
    let has_springs = crew < 3u;
    var velocity = vec4f(0.0);
    var springs = SpringRow(0u, 0u, 1u);
    var springs_at = 0u;
    if has_springs {
        velocity = velocity_in[particle];
        springs = spring_row(particle);
        springs_at = springs.first + SPRING_BATCH * ((crew + 2u) % 3u) * springs.stride;
    }
    search_begin(thread, own);
    var entries: SpringEntries;
    if has_springs {
        entries = spring_entries_of(springs, springs_at);
    }
    var before = vec4f(position, 0.0);
    if crew == 0u {
        before = position_in[particle];
    }
    if group == 0u && thread == 0u {
        atomicStore(&status.contact_spilled[1u - (substep.contact_tick & 1u)], 0u);
    }
    if thread == 0u && !is_over && !region_holds(region, box) {
        atomicOr(&status.invalid, INVALID_LIST);
    }
    let seeker = Seeker(group, crew, lane, own.w, position, box_grown(box, contact_reach(box)), NOWHERE);
    workgroupBarrier();
    if thread < listed {
        near_add(seeker, other, other_box);
    }
    let count = workgroupUniformLoad(&near_count);
    var members = members_of(seeker, 0u, count);
    // While these are on their way.
    compare_own(seeker);
    var pulls: SpringPulls;
    if has_springs {
        pulls = spring_pulls(springs, springs_at, entries, particle, position, velocity.xyz);
    }
    if crew == 1u {
        var sum = field_force(velocity.w, velocity.xyz);
        sum = procedural_force(sum, particle, position, velocity.xyz, velocity.w);
        spring_sums[lane] = spring_pulls_add(sum, pulls, springs, springs_at);
    }
    var is_short = listed > THREADS;
    for (var at = 0u; at == 0u || at < count; at += MEMBERS * CREWS) {
        if at != 0u {
            members = members_of(seeker, at, count);
            stage_clear(seeker);
        }
        member_stage(seeker, members.a);
        member_stage(seeker, members.b);
        let staged = workgroupUniformLoad(&stage_count);
        is_short = is_short || staged > STAGE;
        compare_others(seeker, min(staged, STAGE));
    }
    if crew == 2u {
        spring_sums[lane] = spring_pulls_add(spring_sums[lane], pulls, springs, springs_at);
    }
    let partners_found = workgroupUniformLoad(&partners_most);
    var force = vec3f(0.0);
    if crew == 0u {
        force = spring_pulls_add(spring_sums[lane], pulls, springs, springs_at);
        force = springs_add(force, springs, springs_at + SPRING_BATCH * springs.stride, particle, position, velocity.xyz);
        force = air_add(force, particle);
    }
    if partners_found != 0u || is_short {
        force += contact_force(seeker, listed, is_short, velocity.xyz, partners_found);
    }
    var moved = Moved(position, velocity.xyz);
    if crew == 0u {
        if exists {
            moved = particle_advance(particle, before, velocity, force, is_over);
            if (substep.flags & FLAG_COUNT_CONTACTS) != 0u {
                contact_counts[particle] = atomicLoad(&partner_counts[lane]);
            }
        }
        position_keep(group, lane, own.w, moved.position);
        region_check(region, moved.position, moved.velocity, substep.contact_tick + 1u);
    }
    box_keep(group, thread, moved.position);
}
