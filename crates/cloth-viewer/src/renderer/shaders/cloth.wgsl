// The surface of all cloths, straight from the buffers of positions and normals.

@group(1) @binding(0) var<storage, read> positions: array<vec4f>;
@group(1) @binding(1) var<storage, read> normals: array<vec4f>;
// Colour of each particle, linear.
@group(1) @binding(2) var<storage, read> colours: array<u32>;
@group(1) @binding(3) var<storage, read> strains: array<f32>;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) colour: vec3f,
    @location(3) strain: f32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    let world = positions[index].xyz;
    var corner: Corner;
    corner.clip = view.clip_from_world * vec4f(world, 1.0);
    corner.world = world;
    corner.normal = normals[index].xyz;
    corner.colour = unpack4x8unorm(colours[index]).rgb;
    corner.strain = 0.0;
    if view.eye.w > 0.5 {
        corner.strain = strains[index];
    }
    return corner;
}

// From blue over green and yellow to red.
fn heat(share: f32) -> vec3f {
    let s = clamp(share, 0.0, 1.0) * 4.0;
    let cold = mix(vec3f(0.02, 0.06, 0.42), vec3f(0.02, 0.42, 0.52), clamp(s, 0.0, 1.0));
    let mild = mix(cold, vec3f(0.10, 0.60, 0.12), clamp(s - 1.0, 0.0, 1.0));
    let warm = mix(mild, vec3f(0.90, 0.68, 0.05), clamp(s - 2.0, 0.0, 1.0));
    return mix(warm, vec3f(0.80, 0.04, 0.03), clamp(s - 3.0, 0.0, 1.0));
}

@fragment
fn fragment(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let toward = view.eye.xyz - corner.world;
    // The side of the triangle that is seen says on which side the smooth normal belongs.
    var flat_normal = normalize(cross(dpdx(corner.world), dpdy(corner.world)));
    if dot(flat_normal, toward) < 0.0 {
        flat_normal = -flat_normal;
    }
    var normal = corner.normal;
    if dot(normal, normal) < 1e-8 {
        normal = flat_normal;
    }
    normal = normalize(normal);
    let along = dot(normal, flat_normal);
    if along < 0.0 {
        normal = -normal;
    }
    // At a sharp fold the mean of both sides is the normal of neither: there the triangle has its own.
    normal = normalize(mix(flat_normal, normal, smoothstep(0.35, 0.75, abs(along))));
    var albedo = corner.colour;
    if !front {
        albedo = mix(albedo, vec3f(dot(albedo, vec3f(0.21, 0.72, 0.07))), 0.35) * 0.8;
    }
    if view.eye.w > 0.5 {
        albedo = heat(corner.strain / view.options.y);
    }
    return encode(shade(albedo, corner.world, normal, 0.05));
}
