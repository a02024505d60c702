// Discs that face the eye, at particles or places.

@group(1) @binding(0) var<storage, read> positions: array<vec4f>;

const NO_PARTICLE = 0xffffffffu;

struct Disc {
    @location(0) place: vec3f,
    @location(1) particle: u32,
    @location(2) colour: vec4f,
    // Radius [pixel].
    @location(3) radius: f32,
}

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) colour: vec4f,
    @location(1) place: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, disc: Disc) -> Corner {
    var world = disc.place;
    if disc.particle != NO_PARTICLE {
        world = positions[disc.particle].xyz;
    }
    var corners = array(vec2f(-1.0, -1.0), vec2f(1.0, -1.0), vec2f(-1.0, 1.0), vec2f(1.0, 1.0));
    let place = corners[index];
    var clip = view.clip_from_world * vec4f(world, 1.0);
    clip.z *= 1.01;
    clip = vec4f(clip.xy + place * disc.radius * 2.0 / view.options.zw * clip.w, clip.zw);
    return Corner(clip, disc.colour, place);
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    let distance = length(corner.place);
    let edge = fwidth(distance);
    if distance > 1.0 {
        discard;
    }
    let rim = smoothstep(0.72, 0.72 + edge, distance);
    return vec4f(mix(corner.colour.rgb, corner.colour.rgb * 0.25, rim), corner.colour.a);
}
