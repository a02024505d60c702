// Boxes around what features or triangles are at both sets of positions.

struct WayBox {
    first: Box,
    second: Box,
}

fn ways_none() -> WayBox {
    return WayBox(box_none(), box_none());
}

fn ways_are_empty(bounds: WayBox) -> bool {
    return bounds.first.low.x > bounds.first.high.x;
}

fn ways_with(bounds: WayBox, node: u32) -> WayBox {
    if task_has(TASK_MARKED) {
        return WayBox(box_with(bounds.first, way_start(node)), box_with(bounds.second, way_end(node)));
    }
    return WayBox(box_with(bounds.first, reference_first(node)), box_with(bounds.second, reference_second(node)));
}

fn ways_union(a: WayBox, b: WayBox) -> WayBox {
    return WayBox(box_union(a.first, b.first), box_union(a.second, b.second));
}

// Whether along some axis, on the same side of it at both sets, they are `reach` or more apart: then they are so all the way from one to the other,
// however far both go together.
fn ways_are_apart(a: WayBox, b: WayBox, reach: f32) -> bool {
    let far = vec3f(reach);
    let above = (a.first.low - b.first.high >= far) & (a.second.low - b.second.high >= far);
    let below = (b.first.low - a.first.high >= far) & (b.second.low - a.second.high >= far);
    return any(above | below);
}
