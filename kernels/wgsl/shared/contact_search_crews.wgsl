// NUMERICS section 8: the pairs in contact of a group in a model of few groups, by a workgroup of several threads for
// each of its particles.
//
// The particles of the group lie first in the stage. Of the groups that its row names those are left whose boxes come near
// its own, and of their particles those that are near its box: these are put behind. Each particle is compared with
// all of them by its threads, a share each.

// Groups of which a thread brings a particle at a time.
const MEMBERS: u32 = 2u;
// Further away than any contact [m^2].
const FAR: f32 = 3e38;

var<workgroup> near: array<u32, THREADS>;
var<workgroup> near_count: atomic<u32>;
var<workgroup> stage_count: atomic<u32>;
// For each particle how many partners were found, and KEPT of them in any order: the first ones of all particles, then
// the second ones.
var<workgroup> partner_counts: array<atomic<u32>, GROUP>;
var<workgroup> partners: array<u32, KEPT * GROUP>;
// Most partners of a particle.
var<workgroup> partners_most: atomic<u32>;

// What a thread looks for.
struct Seeker {
    group: u32,
    crew: u32,
    lane: u32,
    // NONE if there is none.
    particle: u32,
    position: vec3f,
    // The box of the group with all that may touch something in it.
    around: Box,
    // Where partners are noted in memory; NOWHERE if in workgroup memory.
    place: u32,
}

// What the searches of a workgroup begin with; `own` is the particle of a thread of crew 0. A barrier has to follow.
fn search_begin(thread: u32, own: vec4<u32>) {
    if thread < GROUP {
        atomicStore(&partner_counts[thread], 0u);
        // Where there is no particle nothing is near.
        stage[thread] = select(own, vec4<u32>(vec3<u32>(bitcast<u32>(FAR)), NONE), own.w == NONE);
    }
    if thread == 0u {
        atomicStore(&near_count, 0u);
        atomicStore(&stage_count, GROUP);
        atomicStore(&partners_most, 0u);
    }
}

// The group at a place of a row, some group if there is none.
fn row_entry(row: u32, at: u32) -> u32 {
    let entry = min(at, contact.group_capacity - 1u);
    return min(group_rows[row + ROW_HEADER + entry / 4u][entry % 4u], contact.group_count - 1u);
}

// Notes a group that comes near.
fn near_add(seeker: Seeker, other: u32, box: Box) {
    if other != seeker.group && boxes_meet(seeker.around, box) {
        near[atomicAdd(&near_count, 1u)] = other;
    }
}

// Of number `at` of `count` groups near by the particle of this thread, if there is such a group.
fn member_of(seeker: Seeker, at: u32, count: u32) -> vec4<u32> {
    let group = min(near[min(at, THREADS - 1u)], contact.group_count - 1u);
    let member = group_positions_in[group * GROUP + seeker.lane];
    return vec4<u32>(member.xyz, select(NONE, member.w, at < count));
}

struct Members {
    a: vec4<u32>,
    b: vec4<u32>,
}

// Those of the groups from number `at` on that are its share.
fn members_of(seeker: Seeker, at: u32, count: u32) -> Members {
    let first = at + seeker.crew;
    return Members(member_of(seeker, first, count), member_of(seeker, first + CREWS, count));
}

// Puts one behind others, if it is near the box. Those that there is no room for are counted.
fn member_stage(seeker: Seeker, member: vec4<u32>) {
    if member.w != NONE && box_holds(seeker.around, bitcast<vec3f>(member.xyz)) {
        let at = atomicAdd(&stage_count, 1u);
        if at < STAGE {
            stage[at] = member;
        }
    }
}

// Makes room for others, between barriers.
fn stage_clear(seeker: Seeker) {
    workgroupBarrier();
    if seeker.crew == 0u && seeker.lane == 0u {
        atomicStore(&stage_count, GROUP);
    }
    workgroupBarrier();
}

fn partner_note(seeker: Seeker, partner: u32) {
    let at = atomicAdd(&partner_counts[seeker.lane], 1u);
    atomicMax(&partners_most, at + 1u);
    if seeker.place != NOWHERE {
        contact_entries[seeker.place + at] = partner;
    } else if at < KEPT {
        partners[at * GROUP + seeker.lane] = partner;
    }
}

// How far from the particle entry `at` of the stage is [m^2]; FAR for the particle itself, which is entry `own`.
fn distance_squared(seeker: Seeker, other: vec4<u32>, at: u32, own: u32) -> f32 {
    let pair = pair_of(seeker.position, bitcast<vec3f>(other.xyz));
    return select(pair.length_squared, FAR, at == own);
}

// Compares with those of four entries that are before `end`. Mostly none is in contact: that takes one question.
fn compare_four(seeker: Seeker, at: u32, end: u32, own: u32) {
    let last = end - 1u;
    let a = stage[at];
    let b = stage[min(at + 1u, last)];
    let c = stage[min(at + 2u, last)];
    let d = stage[min(at + 3u, last)];
    let to_a = distance_squared(seeker, a, at, own);
    let to_b = distance_squared(seeker, b, at + 1u, own);
    let to_c = distance_squared(seeker, c, at + 2u, own);
    let to_d = distance_squared(seeker, d, at + 3u, own);
    let most = model.contact_distance * model.contact_distance;
    if min(min(to_a, to_b), min(to_c, to_d)) < most && seeker.particle != NONE {
        if to_a < most {
            partner_note(seeker, a.w);
        }
        if to_b < most && at + 1u < end {
            partner_note(seeker, b.w);
        }
        if to_c < most && at + 2u < end {
            partner_note(seeker, c.w);
        }
        if to_d < most && at + 3u < end {
            partner_note(seeker, d.w);
        }
    }
}

// Compares with the particles of the group.
fn compare_own(seeker: Seeker) {
    let share = GROUP / CREWS;
    for (var at = seeker.crew * share; at < (seeker.crew + 1u) * share; at += 4u) {
        compare_four(seeker, at, GROUP, seeker.lane);
    }
}

// Compares with those behind them.
fn compare_others(seeker: Seeker, staged: u32) {
    for (var at = GROUP + 4u * seeker.crew; at < staged; at += 4u * CREWS) {
        compare_four(seeker, at, staged, NONE);
    }
}

// All of the search once more, for any number of groups and of particles near: none of them takes more room than there is.
fn search_again(seeker: Seeker, listed: u32) {
    compare_own(seeker);
    let row = group_row(seeker.group);
    let thread = seeker.crew * GROUP + seeker.lane;
    for (var first = 0u; first < listed; first += THREADS) {
        workgroupBarrier();
        if thread == 0u {
            atomicStore(&near_count, 0u);
        }
        workgroupBarrier();
        if first + thread < listed {
            let other = row_entry(row, first + thread);
            near_add(seeker, other, box_in(other));
        }
        let count = workgroupUniformLoad(&near_count);
        for (var at = 0u; at < count; at += CREWS) {
            stage_clear(seeker);
            member_stage(seeker, member_of(seeker, at + seeker.crew, count));
            compare_others(seeker, workgroupUniformLoad(&stage_count));
        }
    }
}
