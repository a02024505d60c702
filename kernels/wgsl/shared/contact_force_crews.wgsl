// NUMERICS section 8: the penalty force on the particles of a group in a model of few groups.
//
// The threads of a particle compute what its partners do to it, one each, in ascending order; one of them adds it up.

// Where the partners of a particle with more than KEPT are.
var<workgroup> places: array<u32, GROUP>;

// How many of `count` partners come before one.
fn partner_rank(lane: u32, count: u32, partner: u32) -> u32 {
    var rank = 0u;
    for (var other = 0u; other < count; other += 1u) {
        rank += select(0u, 1u, partners[other * GROUP + lane] < partner);
    }
    return rank;
}

// The partner before which `rank` of `count` come.
fn partner_ranked(lane: u32, count: u32, rank: u32) -> u32 {
    for (var k = 0u; k < count; k += 1u) {
        let partner = partners[k * GROUP + lane];
        if partner_rank(lane, count, partner) == rank {
            return partner;
        }
    }
    return NONE;
}

// Keeps what a partner does to the particle of this thread, as number `at` of those that crew 0 adds up next.
fn push_keep(seeker: Seeker, partner: u32, at: u32) {
    let push = push_of(seeker.position, velocity_in[seeker.particle].xyz, partner);
    stage[(1u + at) * GROUP + seeker.lane] = bitcast<vec4<u32>>(vec4f(push.normal, push.tension));
}

// `start` and the first `count` that were kept, for crew 0.
fn pushes_add(start: vec3f, seeker: Seeker, count: u32) -> vec3f {
    var sum = start;
    if seeker.crew == 0u {
        for (var at = 0u; at < count; at += 1u) {
            let push = bitcast<vec4f>(stage[(1u + at) * GROUP + seeker.lane]);
            sum = penalty_add(sum, Push(push.xyz, push.w));
        }
    }
    return sum;
}

// The sum over the `count` partners of the particle that are kept, for crew 0; no particle has more than `most`. What
// is in the stage behind the particles of the group is lost.
fn pushes_sum(seeker: Seeker, count: u32, most: u32) -> vec3f {
    var sum = vec3f(0.0);
    if most <= CREWS {
        // Mostly there are so few: a thread need not know the rank of a partner before it asks for it.
        if seeker.crew < count {
            let partner = partners[seeker.crew * GROUP + seeker.lane];
            push_keep(seeker, partner, partner_rank(seeker.lane, count, partner));
        }
        workgroupBarrier();
        return pushes_add(sum, seeker, count);
    }
    for (var first = 0u; first < most; first += CREWS) {
        let rank = first + seeker.crew;
        if rank < count {
            push_keep(seeker, partner_ranked(seeker.lane, count, rank), seeker.crew);
        }
        workgroupBarrier();
        sum = pushes_add(sum, seeker, clamp(count, first, first + CREWS) - first);
        workgroupBarrier();
    }
    return sum;
}

// The sum over a row in memory, in any order before.
fn row_sum(place: u32, count: u32, position: vec3f, velocity: vec3f) -> vec3f {
    sort_entries(place, count);
    var sum = vec3f(0.0);
    for (var at = place; at < place + count; at += 1u) {
        sum = penalty_add(sum, push_of(position, velocity, contact_entries[at]));
    }
    return sum;
}

// The force, for crew 0, once partners were searched for, `found` of a particle at most; if `is_short` not all were found. All
// threads of the workgroup take part. Those of other crews have to meet crew 0 before they use the stage behind the particles of
// the group again.
fn contact_force(seeker: Seeker, listed: u32, is_short: bool, velocity: vec3f, found: u32) -> vec3f {
    var again = seeker;
    var most = found;
    // First, if need be, how many there are, then those of the particles that have more than are kept.
    for (var round = select(1u, 0u, is_short); round < 2u && (round == 0u || most > KEPT); round += 1u) {
        let count = atomicLoad(&partner_counts[seeker.lane]);
        workgroupBarrier();
        if seeker.crew == 0u {
            var place = NOWHERE;
            if round == 1u && count > KEPT {
                place = spill_allocate(count);
            }
            places[seeker.lane] = place;
            if round == 0u || place != NOWHERE {
                atomicStore(&partner_counts[seeker.lane], 0u);
            }
        }
        workgroupBarrier();
        again.place = places[seeker.lane];
        again.particle = select(seeker.particle, NONE, round == 1u && again.place == NOWHERE);
        search_again(again, listed);
        storageBarrier();
        most = workgroupUniformLoad(&partners_most);
    }
    let count = atomicLoad(&partner_counts[seeker.lane]);
    let sum = pushes_sum(seeker, min(count, KEPT), min(most, KEPT));
    // Those that do not fit make the frame invalid.
    if seeker.crew == 0u && again.place != NOWHERE {
        return row_sum(again.place, count, seeker.position, velocity);
    }
    return sum;
}
