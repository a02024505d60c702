// NUMERICS section 15, contact_pairs: all pairs of features whose boxes at both sets of positions are not the reach apart, one thread for
// each triangle and place in the groups that it meets: threads side by side go the same way through the tree. Their order has no meaning.
//!include model pair_task pair_ways pair_references pair_box pair_way_box surface pair_boxes pair_list pair_results

// Pairs of a list at most.
const PAIRS_MAX: u32 = 0x10000000u;

// Pairs of two triangles have numbers: the corners of the first, those of the second, three times three edges. A bit for each whose features belong to
// these triangles.
fn pairs_owned(a: u32, b: u32) -> u32 {
    let of_a = triangle_word(a, 4u);
    let of_b = triangle_word(b, 4u);
    var owned = (of_a & 7u) | ((of_b & 7u) << 3u);
    for (var k = 0u; k < 3u; k += 1u) {
        owned |= select(0u, of_b >> 3u & 7u, (of_a >> (3u + k) & 1u) == 1u) << (6u + 3u * k);
    }
    return owned;
}

fn pair_between(a: u32, b: u32, number: u32) -> Pair {
    if number < 6u {
        let of_pair = select(b, a, number < 3u);
        let other = select(a, b, number < 3u);
        let corner = triangle_word(of_pair, 1u + number % 3u);
        return Pair(vec4<u32>(corner, triangle_corners(other)), corner, triangle_word(other, 0u));
    }
    let edge_a = triangle_word(a, 5u + (number - 6u) / 3u);
    let edge_b = triangle_word(b, 5u + (number - 6u) % 3u);
    let first = min(edge_a, edge_b);
    let second = max(edge_a, edge_b);
    return Pair(vec4<u32>(edge_ends(first), edge_ends(second)), first | EDGES, second);
}

// Whether the features of a pair are not the reach apart, and share no particle nor what a seam makes one.
fn pair_is_near(pair: Pair) -> bool {
    let p = pair.particles;
    var first = ways_with(ways_none(), p.x);
    var second = ways_with(ways_with(ways_none(), p.z), p.w);
    let own = seam_class(p.x);
    let other = seam_class(p.y);
    let others = vec2<u32>(seam_class(p.z), seam_class(p.w));
    var is_shared = any(others == vec2<u32>(own));
    if pair_is_edges(pair) {
        first = ways_with(first, p.y);
        is_shared = is_shared || any(others == vec2<u32>(other));
    } else {
        second = ways_with(second, p.y);
        is_shared = is_shared || other == own;
    }
    return !is_shared && !ways_are_apart(first, second, pair_task.reach);
}

// Lists the pairs of two triangles, by one count for them all: every thread counts in the same place. Returns whether there may be more.
fn triangles_compare(a: u32, b: u32) -> bool {
    var near = 0u;
    for (var owned = pairs_owned(a, b); owned != 0u; owned &= owned - 1u) {
        let number = firstTrailingBit(owned);
        if pair_is_near(pair_between(a, b, number)) {
            near |= 1u << number;
        }
    }
    if near == 0u {
        return true;
    }
    var place = atomicAdd(&pair_results.listed, countOneBits(near));
    // Beyond what any list has, counting goes on no further: the number could wrap.
    if place > PAIRS_MAX {
        return false;
    }
    place += pair_task.pair_first;
    while near != 0u && place < pair_task.pair_capacity {
        pair_set(place, pair_between(a, b, firstTrailingBit(near)));
        near &= near - 1u;
        place += 1u;
    }
    return true;
}

fn triangle_is_marked(slot: u32) -> bool {
    let corners = triangle_corners(slot);
    return is_marked(corners.x) || is_marked(corners.y) || is_marked(corners.z);
}

// Each two triangles once, from the first of them; where only pairs with a mark are asked for, from the first that has one.
@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let thread = particle_index(id, groups);
    let slot = thread / SLOTS;
    let group = slot / SLOTS;
    let count = pair_task.group_count;
    let by_marks = task_has(TASK_MARKED);
    let is_of_body = group >= pair_task.own_group_count;
    if group >= count || (is_of_body && !by_marks) || triangle_word(slot, 0u) == NO_TRIANGLE {
        return;
    }
    if by_marks && !triangle_is_marked(slot) {
        return;
    }
    let own = stored_box(slot);
    // One node of each level waits at most, and the root.
    var waiting: array<u32, 34>;
    // Two triangles of bodies are no pair: cloths are below the first child of the root.
    waiting[0] = select(1u, 2u, is_of_body);
    var depth = 1u;
    while depth > 0u {
        depth -= 1u;
        let node = waiting[depth];
        let bounds = stored_box(node_place(node));
        if ways_are_empty(bounds) || ways_are_apart(own, bounds, pair_task.reach) {
            continue;
        }
        if node >= count {
            let other = SLOTS * (node - count) + thread % SLOTS;
            if triangle_word(other, 0u) == NO_TRIANGLE || ways_are_apart(own, stored_box(other), pair_task.reach) {
                continue;
            }
            let is_turn = other > slot || (by_marks && !triangle_is_marked(other));
            if is_turn && !triangles_compare(slot, other) {
                return;
            }
            continue;
        }
        let level = firstLeadingBit(count) - firstLeadingBit(2u * node + 1u);
        if by_marks || ((2u * node + 2u) << level) - 1u - count >= group {
            waiting[depth] = 2u * node + 1u;
            depth += 1u;
        }
        if by_marks || ((2u * node + 1u) << level) - 1u - count >= group {
            waiting[depth] = 2u * node;
            depth += 1u;
        }
    }
}
