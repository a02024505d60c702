// NUMERICS section 8: the penalty force on the particles of a group in a model of few groups.
//
// The threads of a particle compute what its partners do to it, one each, in ascending order; one of them adds it up.

// Where the partners of a particle with more than KEPT are.
var<workgroup> places: array<u32, GROUP>;

// The partner before which `rank` of `count` come.
fn partner_ranked(lane: u32, count: u32, rank: u32) -> u32 {
    for (var k = 0u; k < count; k += 1u) {
        let partner = partners[k * GROUP + lane];
        var before = 0u;
        for (var other = 0u; other < count; other += 1u) {
            before += select(0u, 1u, partners[other * GROUP + lane] < partner);
        }
        if before == rank {
            return partner;
        }
    }
    return NONE;
}

// The sum over the `count` partners of the particle that are kept, for crew 0; no particle has more than `most`. What
// is in the stage behind the particles of the group is lost.
fn pushes_sum(seeker: Seeker, count: u32, most: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var first = 0u; first < most; first += CREWS) {
        let rank = first + seeker.crew;
        if rank < count {
            let partner = partner_ranked(seeker.lane, count, rank);
            let push = push_of(seeker.position, velocity_in[seeker.particle].xyz, partner);
            stage[(1u + seeker.crew) * GROUP + seeker.lane] = bitcast<vec4<u32>>(vec4f(push.normal, push.tension));
        }
        workgroupBarrier();
        if seeker.crew == 0u {
            for (var k = 0u; k < CREWS && first + k < count; k += 1u) {
                let push = bitcast<vec4f>(stage[(1u + k) * GROUP + seeker.lane]);
                sum = penalty_add(sum, Push(push.xyz, push.w));
            }
        }
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

// The force, for crew 0, once partners were searched for; if `is_short` not all were found. All threads of the workgroup take
// part.
fn contact_force(seeker: Seeker, listed: u32, is_short: bool, velocity: vec3f) -> vec3f {
    var again = seeker;
    var most = workgroupUniformLoad(&partners_most);
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
