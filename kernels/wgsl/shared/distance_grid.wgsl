// NUMERICS section 7: solids as signed distances on a grid.

// GRID_WORDS words for each grid, then the samples of all of them, as bits. The words are origin and
// spacing [m], 1/spacing, samples along each axis, the number of the first sample, the number of sets of samples,
// and sets per second.
@group(0) @binding(54) var<storage, read> distance_grids: array<u32>;

const GRID_WORDS: u32 = 12u;

fn grid_number(at: u32) -> f32 {
    return bitcast<f32>(distance_grids[at]);
}

// A row of samples along x: the value between two of them, and the slope.
fn grid_edge(at: u32, share: f32) -> vec2f {
    let low = grid_number(at);
    let slope = grid_number(at + 1u) - low;
    return vec2f(fma(share, slope, low), slope);
}

// The value between two rows, the slopes along x and y.
fn grid_face(at: u32, width: u32, share: vec2f) -> vec3f {
    let low = grid_edge(at, share.x);
    let high = grid_edge(at + width, share.x);
    let across = high.x - low.x;
    return vec3f(
        fma(share.y, across, low.x),
        fma(share.y, high.y - low.y, low.y),
        across,
    );
}

// The value between two layers, and the slopes.
fn grid_cell(at: u32, width: u32, layer: u32, share: vec3f) -> vec4f {
    let low = grid_face(at, width, share.xy);
    let high = grid_face(at + layer, width, share.xy);
    let difference = high - low;
    return vec4f(fma(vec3f(share.z), difference, low), difference.x);
}

fn surface_of_grid(collider: Collider, point: vec3f) -> Surface {
    let local = collider_local(collider, point);
    let at = u32(collider.size_x) * GRID_WORDS;
    let origin = vec3f(grid_number(at), grid_number(at + 1u), grid_number(at + 2u));
    let spacing = grid_number(at + 3u);
    let size = vec3<i32>(vec3<u32>(distance_grids[at + 5u], distance_grids[at + 6u], distance_grids[at + 7u]));
    let last = vec3f(size - vec3<i32>(1));
    // How far outside of the grid.
    let end = fma(last, vec3f(spacing), origin);
    let beyond = max(max(origin - local, local - end), vec3f(0.0));
    let place = min(max((local - origin) * grid_number(at + 4u), vec3f(0.0)), last);
    // Bounded as integers too: what becomes of NaN is not defined.
    let cell = clamp(vec3<i32>(floor(place)), vec3<i32>(0), size - vec3<i32>(2));
    let share = place - vec3f(cell);
    let width = u32(size.x);
    let layer = width * u32(size.y);
    let samples = layer * u32(size.z);
    let inside = u32(cell.z) * layer + u32(cell.y) * width + u32(cell.x);
    let held = u32(collider.size_y);
    let first = distance_grids[at + 8u] + held * samples + inside;
    var value = grid_cell(first, width, layer, share);
    var speed = 0.0;
    if held + 1u < distance_grids[at + 9u] {
        let change = grid_cell(first + samples, width, layer, share) - value;
        value = fma(vec4f(collider.size_z), change, value);
        speed = -(grid_number(at + 10u) * change.x);
    }
    let distance = value.x + sqrt(dot_product(beyond, beyond));
    let gradient = value.yzw;
    let normal = surface_around(gradient, 0.0, vec3f(0.0, 0.0, 1.0)).normal;
    return Surface(distance, collider_world(collider, normal), speed);
}
