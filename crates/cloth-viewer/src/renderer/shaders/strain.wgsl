// Largest elongation l / L - 1 of the springs of each particle, not below zero.

@group(0) @binding(0) var<storage, read> positions: array<vec4f>;
@group(0) @binding(1) var<storage, read> offsets: array<u32>;
@group(0) @binding(2) var<storage, read> columns: array<u32>;
@group(0) @binding(3) var<storage, read> rest_lengths: array<f32>;
@group(0) @binding(4) var<storage, read_write> strains: array<f32>;

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
    strains[particle] = largest;
}
