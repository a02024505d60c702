// NUMERICS section 9: vertex normals.
//!include model motion triangles

// Unit normal of each particle; the fourth number is zero.
@group(0) @binding(22) var<storage, read_write> normals: array<vec4f>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count {
        return;
    }
    var sum = vec3f(0.0);
    let end = triangle_rows[particle + 1u];
    for (var at = triangle_rows[particle]; at < end; at += 1u) {
        let corners = triangles[triangle_rows[model.particle_count + 1u + at]];
        let origin = position_in[corners.x].xyz;
        sum += cross_product(
            position_in[corners.y].xyz - origin,
            position_in[corners.z].xyz - origin,
        );
    }
    let length = sqrt(dot_product(sum, sum));
    var inverse = 0.0;
    if length > 0.0 {
        inverse = 1.0 / length;
    }
    normals[particle] = vec4f(sum * inverse, 0.0);
}
