// Largest strain at each particle, not below zero: of its triangles of fabric, as `StrainMeasure` of the library, by the number of it there; of its
// springs l / L - 1, which is stretch.

const STRETCH: u32 = 0u;
const WARP: u32 = 1u;
const WEFT: u32 = 2u;
override MEASURE: u32 = STRETCH;

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

fn measured(triangle: FabricTriangle) -> f32 {
    let first = positions[triangle.corners.x].xyz;
    let a = positions[triangle.corners.y].xyz - first;
    let b = positions[triangle.corners.z].xyz - first;
    let warp = a * triangle.inverse.x + b * triangle.inverse.z;
    let weft = a * triangle.inverse.y + b * triangle.inverse.w;
    let cauchy = vec3f(dot(warp, warp), dot(weft, weft), dot(warp, weft));
    switch MEASURE {
        case STRETCH: {
            let mean = 0.5 * (cauchy.x + cauchy.y);
            let apart = 0.5 * (cauchy.x - cauchy.y);
            return sqrt(mean + length(vec2f(apart, cauchy.z))) - 1.0;
        }
        case WARP: {
            return 0.5 * abs(cauchy.x - 1.0);
        }
        case WEFT: {
            return 0.5 * abs(cauchy.y - 1.0);
        }
        default: {
            return 0.5 * abs(cauchy.z);
        }
    }
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
        largest = max(largest, select(0.0, length / rest_lengths[entry] - 1.0, MEASURE == STRETCH));
    }
    for (var entry = fabric_offsets[particle]; entry < fabric_offsets[particle + 1u]; entry++) {
        largest = max(largest, measured(fabric[entry]));
    }
    strains[particle] = largest;
}
