// NUMERICS section 15, contact_geometry: the pairs of the list that may touch, by the distance of their features, a little farther than they touch.
// What touches and where, the host decides in the same arithmetic for all backends.
//!include model pair_task pair_ways pair_box pair_list pair_results pair_found pair_each

// What rounding may do to the distance.
const SLACK: f32 = 1.01;
// Edges that are closer to parallel than the host takes, and how far beyond their ends it cannot take them.
const PARALLEL: f32 = 0.5e-4;
const BEYOND: f32 = 0.01;

fn square_to_segment(p: vec3f, a: vec3f, b: vec3f) -> f32 {
    let edge = b - a;
    let share = clamp(dot(p - a, edge) / max(dot(edge, edge), 1e-30), 0.0, 1.0);
    let rest = p - a - share * edge;
    return dot(rest, rest);
}

// The square of the distance of a vertex from a triangle: that of its border, or that of its plane if the vertex is above its inside.
fn square_to_triangle(p: vec3f, a: vec3f, b: vec3f, c: vec3f) -> f32 {
    let border = min(min(square_to_segment(p, a, b), square_to_segment(p, b, c)), square_to_segment(p, c, a));
    let normal = cross(b - a, c - a);
    let square = dot(normal, normal);
    // A little of what is outside counts as inside, which makes no pair farther.
    let least = -BEYOND * square;
    let is_inside = dot(cross(b - p, c - p), normal) >= least
        && dot(cross(c - p, a - p), normal) >= least
        && dot(cross(a - p, b - p), normal) >= least;
    if is_inside && square > 0.0 {
        let height = dot(p - a, normal);
        return min(border, height * height / square);
    }
    return border;
}

// The square of the distance of the insides of two edges, or a large number where the closest points are not inside.
fn square_of_edges(a: vec3f, b: vec3f, c: vec3f, d: vec3f) -> f32 {
    let u = b - a;
    let v = d - c;
    let r = a - c;
    let uu = dot(u, u);
    let vv = dot(v, v);
    let uv = dot(u, v);
    let square = uu * vv - uv * uv;
    if square <= PARALLEL * (uu * vv) {
        return 3e38;
    }
    let s = (uv * dot(v, r) - vv * dot(u, r)) / square;
    let t = (uu * dot(v, r) - uv * dot(u, r)) / square;
    if min(s, t) < -BEYOND || max(s, t) > 1.0 + BEYOND {
        return 3e38;
    }
    let difference = r + s * u - t * v;
    return dot(difference, difference);
}

// Where a particle is, or a node of a body: at the start of its way, or at its end.
fn place(node: u32, nodes_at_end: bool) -> vec3f {
    if nodes_at_end && node >= model.particle_count {
        return way_end(node);
    }
    return way_start(node);
}

fn is_near(pair: Pair, nodes_at_end: bool) -> bool {
    let p = pair.particles;
    let a = place(p.x, nodes_at_end);
    let b = place(p.y, nodes_at_end);
    let c = place(p.z, nodes_at_end);
    let d = place(p.w, nodes_at_end);
    var first = box_with(box_none(), a);
    var second = box_with(box_with(box_none(), c), d);
    var square = 0.0;
    let reach = SLACK * pair_task.distance;
    if pair_is_edges(pair) {
        if box_is_apart(box_with(first, b), second, reach) {
            return false;
        }
        square = square_of_edges(a, b, c, d);
    } else {
        if box_is_apart(first, box_with(second, b), reach) {
            return false;
        }
        square = square_to_triangle(a, b, c, d);
    }
    return square < reach * reach;
}

// With particles at the starts of their ways, and nodes of bodies there or at the ends.
fn pair_is_wanted(pair: Pair) -> bool {
    return is_near(pair, false) || (any(pair.particles >= vec4<u32>(model.particle_count)) && is_near(pair, true));
}
