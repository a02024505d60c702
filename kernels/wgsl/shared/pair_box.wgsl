// Boxes with sides along the axes.

struct Box {
    low: vec3f,
    high: vec3f,
}

fn box_none() -> Box {
    return Box(vec3f(3e38), vec3f(-3e38));
}

fn box_with(bounds: Box, point: vec3f) -> Box {
    return Box(min(bounds.low, point), max(bounds.high, point));
}

fn box_union(a: Box, b: Box) -> Box {
    return Box(min(a.low, b.low), max(a.high, b.high));
}

// Whether along some axis they are `reach` or more apart.
fn box_is_apart(a: Box, b: Box, reach: f32) -> bool {
    return any(a.low - b.high >= vec3f(reach)) || any(b.low - a.high >= vec3f(reach));
}
