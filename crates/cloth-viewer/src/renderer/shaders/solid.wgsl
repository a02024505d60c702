// Colliders, and planes as floors with a grid.

struct Vertex {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    // Coordinates in the plane [m]; kind: 0 a solid, 1 a floor, 2 a grid without a floor.
    @location(2) plane: vec3f,
    // Of a solid, in linear light.
    @location(3) colour: vec4f,
}

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) plane: vec3f,
    @location(3) colour: vec3f,
}

@vertex
fn vertex(vertex: Vertex) -> Corner {
    var corner: Corner;
    corner.clip = view.clip_from_world * vec4f(vertex.position, 1.0);
    corner.world = vertex.position;
    corner.normal = vertex.normal;
    corner.plane = vertex.plane;
    corner.colour = vertex.colour.rgb;
    return corner;
}

// How much of a pixel of the size `width` lies on a line of the grid.
fn grid_line(place: vec2f, width: vec2f, tile: f32) -> f32 {
    let share = width / tile;
    let distance = abs(fract(place / tile + 0.5) - 0.5);
    let lines = 1.0 - smoothstep(vec2f(0.0), max(share, vec2f(1e-6)) * 1.2, distance);
    // Lines closer than pixels are left out.
    return max(lines.x, lines.y) * (1.0 - smoothstep(0.15, 0.5, max(share.x, share.y)));
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    let width = fwidth(corner.plane.xy);
    let toward = view.eye.xyz - corner.world;
    var normal = normalize(corner.normal);
    if corner.plane.z < 0.5 {
        return encode(shade(corner.colour, corner.world, normal, 0.12));
    }
    // Through the back of a floor one sees the cloth.
    if dot(toward, normal) < 0.0 {
        discard;
    }
    let tile = view.options.x;
    let line = max(
        0.55 * grid_line(corner.plane.xy, width, tile),
        grid_line(corner.plane.xy, width, 5.0 * tile),
    );
    let far = distance(corner.world, view.focus.xyz) / view.focus.w;
    let fade = 1.0 - smoothstep(3.0, 9.0, far);
    if corner.plane.z > 1.5 {
        return vec4f(encode(vec3f(0.25)).rgb, 0.5 * line * fade);
    }
    let colour = shade(mix(vec3f(0.62), vec3f(0.36), line), corner.world, normal, 0.0);
    return vec4f(encode(colour).rgb, fade);
}
