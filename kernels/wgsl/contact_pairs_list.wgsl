// NUMERICS section 15, contact_pairs: all pairs of features whose boxes at both sets of positions are not the reach apart, one thread for
// each triangle of cloths and place in the groups that it meets: threads side by side go the same way through the tree. Their order has no meaning.
//!include model pair_task pair_references pair_box pair_way_box surface pair_boxes pair_list pair_results

// Pairs of a list at most.
const PAIRS_MAX: u32 = 0x10000000u;

fn pair_note(pair: Pair) {
    let p = pair.particles;
    var first = ways_with(ways_none(), p.x);
    var second = ways_with(ways_with(ways_none(), p.z), p.w);
    if pair_is_edges(pair) {
        first = ways_with(first, p.y);
    } else {
        second = ways_with(second, p.y);
    }
    if ways_are_apart(first, second, pair_task.reach) || atomicLoad(&pair_results.listed) > PAIRS_MAX {
        return;
    }
    let number = atomicAdd(&pair_results.listed, 1u);
    if number < pair_task.pair_capacity {
        pair_set(number, pair);
    }
}

// Whether one of these corners is a particle, or one that a seam makes one with it.
fn has_particle(corners: vec3<u32>, particle: u32) -> bool {
    let own = seam_class(particle);
    return seam_class(corners.x) == own || seam_class(corners.y) == own || seam_class(corners.z) == own;
}

// The pairs of what belongs to two triangles, less those that share a particle.
fn triangles_compare(a: u32, b: u32) {
    let corners_a = triangle_corners(a);
    let corners_b = triangle_corners(b);
    let owned_a = triangle_word(a, 4u);
    let owned_b = triangle_word(b, 4u);
    for (var k = 0u; k < 3u; k += 1u) {
        let of_a = corners_a[k];
        if (owned_a >> k & 1u) == 1u && !has_particle(corners_b, of_a) {
            pair_note(Pair(vec4<u32>(of_a, corners_b), of_a, triangle_word(b, 0u)));
        }
        let of_b = corners_b[k];
        if (owned_b >> k & 1u) == 1u && !has_particle(corners_a, of_b) {
            pair_note(Pair(vec4<u32>(of_b, corners_a), of_b, triangle_word(a, 0u)));
        }
    }
    if owned_a >> 3u == 0u || owned_b >> 3u == 0u {
        return;
    }
    for (var k = 0u; k < 3u; k += 1u) {
        if (owned_a >> (3u + k) & 1u) == 0u {
            continue;
        }
        let edge_a = triangle_word(a, 5u + k);
        for (var l = 0u; l < 3u; l += 1u) {
            if (owned_b >> (3u + l) & 1u) == 0u {
                continue;
            }
            let edge_b = triangle_word(b, 5u + l);
            let first = min(edge_a, edge_b);
            let second = max(edge_a, edge_b);
            let p = edge_ends(first);
            let q = edge_ends(second);
            if !has_particle(p.xyy, q.x) && !has_particle(p.xyy, q.y) {
                pair_note(Pair(vec4<u32>(p, q), first | EDGES, second));
            }
        }
    }
}


@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let thread = particle_index(id, groups);
    let slot = thread / SLOTS;
    let group = slot / SLOTS;
    let count = pair_task.group_count;
    if group >= pair_task.own_group_count || triangle_word(slot, 0u) == NO_TRIANGLE {
        return;
    }
    let own = stored_box(slot);
    // One node of each level waits at most, and the root.
    var waiting: array<u32, 34>;
    waiting[0] = 1u;
    var depth = 1u;
    while depth > 0u {
        depth -= 1u;
        let node = waiting[depth];
        let bounds = stored_box(node_place(node));
        if ways_are_empty(bounds) || ways_are_apart(own, bounds, pair_task.reach) {
            continue;
        }
        if node >= count {
            // Each two triangles once.
            let other = SLOTS * (node - count) + thread % SLOTS;
            if other > slot && triangle_word(other, 0u) != NO_TRIANGLE
                && !ways_are_apart(own, stored_box(other), pair_task.reach) {
                triangles_compare(slot, other);
            }
            continue;
        }
        let level = firstLeadingBit(count) - firstLeadingBit(2u * node + 1u);
        if ((2u * node + 2u) << level) - 1u - count >= group {
            waiting[depth] = 2u * node + 1u;
            depth += 1u;
        }
        if ((2u * node + 1u) << level) - 1u - count >= group {
            waiting[depth] = 2u * node;
            depth += 1u;
        }
    }
}
