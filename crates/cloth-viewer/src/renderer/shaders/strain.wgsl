// Largest elongation at each particle, not below zero: l / L - 1 of its springs, the larger principal stretch less 1 of its triangles of
// fabric.

struct FabricTriangle {
    corners: vec3u,
    // D_m^-1: the gradients of the second and of the third corner along warp and weft.
    inverse: vec4f,
}

@group(0) @binding(0) var<storage, read> positions: array<vec4f>;
@group(0) @binding(1) var<storage, read> offsets: array<u32>;
@group(0) @binding(2) var<storage, read> columns: array<u32>;
@group(0) @binding(3) var<storage, read> rest_lengths: array<f32>;
@group(0) @binding(4) var<storage, read_write> strains: array<f32>;
@group(0) @binding(5) var<storage, read> fabric_offsets: array<u32>;
@group(0) @binding(6) var<storage, read> fabric: array<FabricTriangle>;

fn stretch(triangle: FabricTriangle) -> f32 {
    let first = positions[triangle.corners.x].xyz;
    let a = positions[triangle.corners.y].xyz - first;
    let b = positions[triangle.corners.z].xyz - first;
    let warp = a * triangle.inverse.x + b * triangle.inverse.z;
    let weft = a * triangle.inverse.y + b * triangle.inverse.w;
    let mean = 0.5 * (dot(warp, warp) + dot(weft, weft));
    let apart = 0.5 * (dot(warp, warp) - dot(weft, weft));
    return sqrt(mean + length(vec2f(apart, dot(warp, weft))));
}

@compute @workgroup_size(64)
fn strain(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let particle = (group.y * groups.x + group.x) * 64u + lane;
    if particle >= arrayLength(&strains) {
        return;
    }
    var largest = 0.0;
    for (var entry = offsets[particle]; entry < offsets[particle + 1u]; entry++) {
        let length = distance(positions[particle].xyz, positions[columns[entry]].xyz);
        largest = max(largest, length / rest_lengths[entry] - 1.0);
    }
    for (var entry = fabric_offsets[particle]; entry < fabric_offsets[particle + 1u]; entry++) {
        largest = max(largest, stretch(fabric[entry]) - 1.0);
    }
    strains[particle] = largest;
}
