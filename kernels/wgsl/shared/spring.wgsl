// NUMERICS section 2: springs with dampers, gathered for each particle in ascending order of its
// neighbours.
//
// `spring_rows` holds for each particle the first entry of its row and, packed, entries (24 bits) and log2 of
// the distance between entries (8 bits). Particles with the same springs, as inside a patch, share a row
// whose entries lie side by side; rows of their own lie side by side with those of their neighbours. An entry is the
// offset from the particle to the one at the other end, then rest length, stiffness and damping; where springs
// may buckle more follows (`spring_buckling.wgsl`).

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
    let damping = bitcast<f32>(entry.w);
    let length = sqrt(dot_product(difference, difference));
    let inverse_length = 1.0 / max(length, LENGTH_MIN);
    let rate = dot_product(relative, difference) * inverse_length;
    let stretch = length - rest_length;
    let tension = fma(damping, rate, elastic_tension(at, stiffness, stretch));
    return Spring(difference, rest_length, stiffness, stretch, tension, inverse_length);
}

fn spring_at(at: u32, particle: u32, position: vec3f, velocity: vec3f) -> Spring {
    let entry = spring_entries[at];
    let other = particle + entry.x;
    let difference = position_in[other].xyz - position;
    return spring_of(at, entry, difference, velocity_in[other].xyz - velocity);
}

fn spring_pull(sum: vec3f, spring: Spring) -> vec3f {
    return add_scaled(sum, spring.tension * spring.inverse_length, spring.difference);
}

// `start` and the forces of all springs of a particle. Six at a time, so that the device waits once for what
// they read; what lies beyond the row is read again and left out.
fn spring_force(start: vec3f, particle: u32, position: vec3f, velocity: vec3f) -> vec3f {
    let row = spring_row(particle);
    let last = row.end - row.stride;
    var sum = start;
    for (var at_a = row.first; at_a < row.end; at_a += 6u * row.stride) {
        let at_b = at_a + row.stride;
        let at_c = at_b + row.stride;
        let at_d = at_c + row.stride;
        let at_e = at_d + row.stride;
        let at_f = at_e + row.stride;
        let a = spring_entries[at_a];
        let b = spring_entries[min(at_b, last)];
        let c = spring_entries[min(at_c, last)];
        let d = spring_entries[min(at_d, last)];
        let e = spring_entries[min(at_e, last)];
        let f = spring_entries[min(at_f, last)];
        let position_a = position_in[particle + a.x].xyz;
        let position_b = position_in[particle + b.x].xyz;
        let position_c = position_in[particle + c.x].xyz;
        let position_d = position_in[particle + d.x].xyz;
        let position_e = position_in[particle + e.x].xyz;
        let position_f = position_in[particle + f.x].xyz;
        let velocity_a = velocity_in[particle + a.x].xyz;
        let velocity_b = velocity_in[particle + b.x].xyz;
        let velocity_c = velocity_in[particle + c.x].xyz;
        let velocity_d = velocity_in[particle + d.x].xyz;
        let velocity_e = velocity_in[particle + e.x].xyz;
        let velocity_f = velocity_in[particle + f.x].xyz;
        sum = spring_pull(sum, spring_of(at_a, a, position_a - position, velocity_a - velocity));
        let with_b = spring_pull(sum, spring_of(min(at_b, last), b, position_b - position, velocity_b - velocity));
        sum = select(sum, with_b, at_b < row.end);
        let with_c = spring_pull(sum, spring_of(min(at_c, last), c, position_c - position, velocity_c - velocity));
        sum = select(sum, with_c, at_c < row.end);
        let with_d = spring_pull(sum, spring_of(min(at_d, last), d, position_d - position, velocity_d - velocity));
        sum = select(sum, with_d, at_d < row.end);
        let with_e = spring_pull(sum, spring_of(min(at_e, last), e, position_e - position, velocity_e - velocity));
        sum = select(sum, with_e, at_e < row.end);
        let with_f = spring_pull(sum, spring_of(min(at_f, last), f, position_f - position, velocity_f - velocity));
        sum = select(sum, with_f, at_f < row.end);
    }
    return sum;
}
