// NUMERICS section 8: the pairs in contact of a group, by all threads of its workgroup together.
//
// Of the groups that its row names those are left whose boxes come near its own, and of their particles those that
// are near its box. These are put side by side in workgroup memory, and each thread compares them with its own.
// `is_left_out` has the pairs that are no contact.

var<workgroup> near: array<u32, GROUP>;
var<workgroup> near_count: atomic<u32>;
var<workgroup> stage_count: atomic<u32>;
// Whether some thread of the workgroup has found more than it keeps.
var<workgroup> is_more: atomic<u32>;

struct Member {
    particle: u32,
    position: vec3f,
}

// The particle of this thread in number `at` of `count` groups near by, if there is such a group.
fn member_of(at: u32, count: u32, lane: u32) -> Member {
    let group = min(near[min(at, count - 1u)], contact.group_count - 1u);
    let particle = group_members[group * GROUP + lane];
    let position = position_in[select(particle, 0u, particle == NONE)].xyz;
    return Member(select(NONE, particle, at < count), position);
}

// Puts it beside others, if it is near the box.
fn member_stage(around: Box, member: Member) {
    if member.particle != NONE && box_holds(around, member.position) {
        let at = atomicAdd(&stage_count, 1u);
        stage[at] = vec4<u32>(bitcast<vec3<u32>>(member.position), member.particle);
    }
}

// The bit of an entry of the stage if that is in contact with the particle of this thread.
fn hit(particle: u32, position: vec3f, at: u32, bit: u32) -> u32 {
    let other = stage[at];
    let is_hit = is_in_contact(pair_of(position, bitcast<vec3f>(other.xyz))) && other.w != particle;
    return select(0u, bit, is_hit);
}

// The bits of eight entries from `at` on, of which `left` are in use. Eight at a time, so that the device waits once
// for what they read; the stage has room for a multiple of eight.
fn hits_of(particle: u32, position: vec3f, at: u32, left: u32) -> u32 {
    let low = hit(particle, position, at, 1u) | hit(particle, position, at + 1u, 2u)
        | hit(particle, position, at + 2u, 4u) | hit(particle, position, at + 3u, 8u);
    let high = hit(particle, position, at + 4u, 16u) | hit(particle, position, at + 5u, 32u)
        | hit(particle, position, at + 6u, 64u) | hit(particle, position, at + 7u, 128u);
    return (low | high) & ((1u << min(left, 8u)) - 1u);
}

struct Found {
    // Partners of the particle of this thread; as many as there is room for are kept.
    count: u32,
    kept: Kept,
}

// The partners of the particle of this thread. All are written from `place` on, in any order, if that is somewhere.
fn contacts_search(group: u32, lane: u32, particle: u32, position: vec3f, place: u32) -> Found {
    let row = group_row(group);
    let listed = group_rows[row].w;
    let box = box_in(group);
    let around = box_grown(box, contact_reach(box));
    if lane == 0u {
        atomicStore(&near_count, 0u);
        atomicStore(&stage_count, 0u);
        atomicStore(&is_more, 0u);
    }
    var kept = kept_none();
    var found = 0u;
    for (var first = 0u; first < listed; first += GROUP) {
        workgroupBarrier();
        // Read before it is known whether it is one, so that nothing waits for that.
        let entry = min(first + lane, contact.group_capacity - 1u);
        let other = min(group_rows[row + ROW_HEADER + entry / 4u][entry % 4u], contact.group_count - 1u);
        if boxes_meet(around, box_in(other)) && first + lane < listed {
            near[atomicAdd(&near_count, 1u)] = other;
        }
        let count = workgroupUniformLoad(&near_count);
        if lane == 0u {
            atomicStore(&near_count, 0u);
        }
        // TURN groups at a time; the next ones are on their way while these are compared.
        var next_a = member_of(0u, count, lane);
        var next_b = member_of(1u, count, lane);
        for (var at = 0u; at < count; at += TURN) {
            member_stage(around, next_a);
            member_stage(around, next_b);
            let staged = workgroupUniformLoad(&stage_count);
            if lane == 0u {
                atomicStore(&stage_count, 0u);
            }
            next_a = member_of(at + TURN, count, lane);
            next_b = member_of(at + TURN + 1u, count, lane);
            for (var k = 0u; k < staged; k += 8u) {
                var hits = hits_of(particle, position, k, staged - k);
                while hits != 0u {
                    let partner = stage[k + firstTrailingBit(hits)].w;
                    hits &= hits - 1u;
                    if is_left_out(particle, partner) {
                        continue;
                    }
                    if place == NOWHERE {
                        kept = kept_add(kept, partner);
                    } else {
                        contact_entries[place + found] = partner;
                    }
                    found += 1u;
                }
            }
            workgroupBarrier();
        }
    }
    if found > KEPT {
        atomicStore(&is_more, 1u);
    }
    return Found(found, kept);
}
