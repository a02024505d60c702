// NUMERICS section 14: a proof that two features in linear motion do not meet. Any axis will do, and no order of operations and no contraction takes the
// margin of the comparison.

// MARGIN units of roundoff, and twice as many of the smallest normal number.
const CERTIFICATE_RELATIVE: f32 = 4.7683716e-7;
const CERTIFICATE_SMALLEST: f32 = 1.8807910e-37;
const NORMAL_MIN: f32 = 1.17549435e-38;

struct Points {
    x: array<vec3f, 4>,
}

// Whether the axis keeps both features more than `delta` apart.
fn is_apart(p: Points, axis: vec3f, edges: bool, delta: f32) -> bool {
    var apart = exceeds(p.x[0] - p.x[2], axis, delta) && exceeds(p.x[0] - p.x[3], axis, delta);
    if edges {
        apart = apart && exceeds(p.x[1] - p.x[2], axis, delta) && exceeds(p.x[1] - p.x[3], axis, delta);
    } else {
        apart = apart && exceeds(p.x[0] - p.x[1], axis, delta);
    }
    return apart;
}

fn exceeds(d: vec3f, axis: vec3f, delta: f32) -> bool {
    let term = axis * d;
    let size = abs(term.x) + abs(term.y) + abs(term.z);
    return term.x + term.y + term.z > CERTIFICATE_RELATIVE * size + (delta + CERTIFICATE_SMALLEST);
}

// The closest vector between the features, and the other of both candidates for it.
struct Directions {
    first: vec3f,
    second: vec3f,
}

fn directions(p: Points, edges: bool) -> Directions {
    let r1 = p.x[1] - p.x[0];
    let r2 = p.x[2] - p.x[0];
    let r3 = p.x[3] - p.x[0];
    var normal = vec3f(0.0);
    var across = r1;
    var border = vec3f(0.0);
    var is_inside = false;
    if edges {
        let v = p.x[3] - p.x[2];
        normal = cross(r1, v);
        across = r2;
        let square = dot(normal, normal);
        let s = dot(cross(r2, v), normal);
        let t = dot(cross(r2, r1), normal);
        is_inside = s > 0.0 && s < square && t > 0.0 && t < square;
        let bc = p.x[1] - p.x[2];
        let bd = p.x[1] - p.x[3];
        let of_first = shortest(segment(-r2, -r3), segment(bc, bd));
        let of_second = shortest(segment(-r2, bc), segment(-r3, bd));
        border = shortest(of_first, of_second);
    } else {
        normal = cross(r2 - r1, r3 - r1);
        is_inside = dot(cross(r2, r3), normal) > 0.0 && dot(cross(r3, r1), normal) > 0.0 && dot(cross(r1, r2), normal) > 0.0;
        border = shortest(shortest(segment(-r1, -r2), segment(-r2, -r3)), segment(-r3, -r1));
    }
    if dot(normal, across) > 0.0 {
        normal = -normal;
    }
    if is_inside {
        return Directions(normal, border);
    }
    return Directions(border, normal);
}

// The vector from the origin to the closest point of the segment p q.
fn segment(p: vec3f, q: vec3f) -> vec3f {
    let edge = q - p;
    let share = -dot(p, edge) / max(dot(edge, edge), NORMAL_MIN);
    return p + clamp(share, 0.0, 1.0) * edge;
}

fn shortest(a: vec3f, b: vec3f) -> vec3f {
    return select(b, a, dot(a, a) <= dot(b, b));
}

fn unit(v: vec3f) -> vec3f {
    let largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
    let scaled = v * (1.0 / max(largest, NORMAL_MIN));
    return scaled * (1.0 / max(sqrt(dot(scaled, scaled)), NORMAL_MIN));
}

fn proves(start: Points, end: Points, axis: vec3f, edges: bool, delta: f32) -> bool {
    return is_apart(start, axis, edges, 0.0) && is_apart(end, axis, edges, delta);
}

// An axis of space along which they are apart, which takes only comparisons.
fn along_axes(start: Points, end: Points, edges: bool, delta: f32) -> bool {
    let of_start = features(start, edges);
    let of_end = features(end, edges);
    let above = (of_start.low_first > of_start.high_second) & (of_end.low_first - of_end.high_second > vec3f(delta));
    let below = (of_start.low_second > of_start.high_first) & (of_end.low_second - of_end.high_first > vec3f(delta));
    return any(above) || any(below);
}

struct Features {
    low_first: vec3f,
    high_first: vec3f,
    low_second: vec3f,
    high_second: vec3f,
}

fn features(p: Points, edges: bool) -> Features {
    let low = min(p.x[2], p.x[3]);
    let high = max(p.x[2], p.x[3]);
    if edges {
        return Features(min(p.x[0], p.x[1]), max(p.x[0], p.x[1]), low, high);
    }
    return Features(p.x[0], p.x[0], min(low, p.x[1]), max(high, p.x[1]));
}

fn is_proven(start: Points, end: Points, edges: bool, delta: f32) -> bool {
    if along_axes(start, end, edges, delta) {
        return true;
    }
    let at_start = directions(start, edges);
    if proves(start, end, unit(at_start.first), edges, delta) {
        return true;
    }
    let at_end = directions(end, edges);
    return proves(start, end, unit(at_end.first), edges, delta)
        || proves(start, end, unit(at_start.second), edges, delta)
        || proves(start, end, unit(at_end.second), edges, delta);
}
