// Lines between particles, and lines between places.

@group(1) @binding(0) var<storage, read> positions: array<vec4f>;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) colour: vec4f,
}

fn corner(world: vec3f, colour: vec4f) -> Corner {
    var clip = view.clip_from_world * vec4f(world, 1.0);
    // A little nearer than the surface that the line lies on: depth grows towards the eye.
    clip.z *= 1.002;
    return Corner(clip, colour);
}

@vertex
fn vertex_particle(@location(0) particle: u32, @location(1) colour: vec4f) -> Corner {
    return corner(positions[particle].xyz, colour);
}

const NO_PARTICLE = 0xffffffffu;

@vertex
fn vertex_place(
    @location(0) place: vec3f,
    @location(1) particle: u32,
    @location(2) colour: vec4f,
) -> Corner {
    if particle != NO_PARTICLE {
        return corner(positions[particle].xyz, colour);
    }
    return corner(place, colour);
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    return corner.colour;
}
