// NUMERICS section 2: springs with dampers, gathered for each particle in ascending order of its
// neighbours.
//
// `spring_rows` holds for each particle the first entry of its row and, packed, entries (24 bits) and log2 of
// the distance between entries (8 bits). Particles with the same springs, as inside a patch, share a row
// whose entries lie side by side; rows of their own lie side by side with those of their neighbours. An entry is the
// offset from the particle to the one at the other end, then rest length, stiffness and damping; where springs
// may buckle more follows (`spring_buckling.wgsl`). The sign of the damping is set if the strain of the spring is not
// measured.

@group(0) @binding(8) var<storage, read> spring_rows: array<vec2<u32>>;
@group(0) @binding(9) var<storage, read> spring_entries: array<vec4<u32>>;

fn spring_word(at: u32) -> vec4<u32> {
    return spring_entries[at];
}

struct SpringRow {
    first: u32,
    end: u32,
    stride: u32,
}

fn spring_row(particle: u32) -> SpringRow {
    let packed = spring_rows[particle];
    let first = packed.x;
    let shape = packed.y;
    let stride = SPRING_WORDS << (shape >> 24u);
    return SpringRow(first, first + (shape & 0xffffffu) * stride, stride);
}

struct Spring {
    // From the particle to its neighbour [m].
    difference: vec3f,
    rest_length: f32,
    stiffness: f32,
    // Length beyond the rest length [m].
    stretch: f32,
    // Force along the spring [N].
    tension: f32,
    // 1 / length [1/m], bounded for coinciding particles.
    inverse_length: f32,
}

// The spring at `at`, with the differences of position and velocity from this particle to the other one.
fn spring_of(at: u32, entry: vec4<u32>, difference: vec3f, relative: vec3f) -> Spring {
    let rest_length = bitcast<f32>(entry.y);
    let stiffness = bitcast<f32>(entry.z);
    let damping = abs(bitcast<f32>(entry.w));
    let length = sqrt(dot_product(difference, difference));
    let inverse_length = 1.0 / max(length, LENGTH_MIN);
    let rate = dot_product(relative, difference) * inverse_length;
    let stretch = length - rest_length;
    let tension = fma(damping, rate, elastic_tension(at, stiffness, stretch));
    return Spring(difference, rest_length, stiffness, stretch, tension, inverse_length);
}

// Whether the strain of the spring at `at` is measured (NUMERICS section 10).
fn spring_is_measured(at: u32) -> bool {
    return (spring_entries[at].w & 0x80000000u) == 0u;
}

fn spring_at(at: u32, particle: u32, position: vec3f, velocity: vec3f) -> Spring {
    let entry = spring_entries[at];
    let other = particle + entry.x;
    let difference = position_in[other].xyz - position;
    return spring_of(at, entry, difference, velocity_in[other].xyz - velocity);
}
