// Threads of fabric: strips of a width in pixels, along lines across triangles.

@group(1) @binding(0) var<storage, read> positions: array<vec4f>;

struct Segment {
    // Corners of the triangle.
    @location(0) corners: vec3u,
    // Their weights at both ends.
    @location(1) from_weights: vec3f,
    @location(2) to_weights: vec3f,
    @location(3) colour: vec4f,
}

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) colour: vec4f,
}

fn end(corners: vec3u, weights: vec3f) -> vec4f {
    let world = weights.x * positions[corners.x].xyz
        + weights.y * positions[corners.y].xyz
        + weights.z * positions[corners.z].xyz;
    var clip = view.clip_from_world * vec4f(world, 1.0);
    // A little nearer than the surface that it lies on: depth grows towards the eye.
    clip.z *= 1.002;
    return clip;
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, segment: Segment) -> Corner {
    let from_clip = end(segment.corners, segment.from_weights);
    let to_clip = end(segment.corners, segment.to_weights);
    let size = view.options.zw;
    let along = (to_clip.xy / to_clip.w - from_clip.xy / from_clip.w) * size;
    let far = (index & 1u) == 1u;
    let clip = select(from_clip, to_clip, far);
    // What is behind the eye has no direction on the screen; the strip is cut off there anyway.
    var across = vec2f(0.0);
    if dot(along, along) > 1e-12 && min(from_clip.w, to_clip.w) > 0.0 {
        across = normalize(vec2f(-along.y, along.x));
    }
    let side = select(-1.0, 1.0, index >= 2u);
    // As wide in large pictures as in small ones, and never thinner than a pixel and a half.
    let width = max(1.5, size.y / 400.0);
    let offset = across * side * width / size * clip.w;
    return Corner(vec4f(clip.xy + offset, clip.zw), segment.colour);
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    return corner.colour;
}
