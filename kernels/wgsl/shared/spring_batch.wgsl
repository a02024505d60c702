// Springs of a particle four at a time, so that the device waits once for what they read. What lies beyond the row is the last one
// once more, and left out of sums. More of them save no time, and take registers that more threads could have.

const SPRING_BATCH: u32 = 4u;

// The entries of four springs.
struct SpringEntries {
    a: vec4<u32>,
    b: vec4<u32>,
    c: vec4<u32>,
    d: vec4<u32>,
}

// For each, from the particle to its neighbour [m], and tension / length [N/m].
struct SpringPulls {
    a: vec4f,
    b: vec4f,
    c: vec4f,
    d: vec4f,
}

// Where the spring of a row is that lies `number` behind the one at `at`.
fn spring_place(row: SpringRow, at: u32, number: u32) -> u32 {
    return min(at + number * row.stride, row.end - row.stride);
}

// The springs from the one at `at` on.
fn spring_entries_of(row: SpringRow, at: u32) -> SpringEntries {
    return SpringEntries(
        spring_entries[spring_place(row, at, 0u)],
        spring_entries[spring_place(row, at, 1u)],
        spring_entries[spring_place(row, at, 2u)],
        spring_entries[spring_place(row, at, 3u)],
    );
}

fn spring_pull(at: u32, entry: vec4<u32>, difference: vec3f, relative: vec3f) -> vec4f {
    let spring = spring_of(at, entry, difference, relative);
    return vec4f(spring.difference, spring.tension * spring.inverse_length);
}

fn spring_pulls(row: SpringRow, at: u32, entries: SpringEntries, particle: u32, position: vec3f, velocity: vec3f) -> SpringPulls {
    let position_a = position_in[particle + entries.a.x].xyz;
    let position_b = position_in[particle + entries.b.x].xyz;
    let position_c = position_in[particle + entries.c.x].xyz;
    let position_d = position_in[particle + entries.d.x].xyz;
    let velocity_a = velocity_in[particle + entries.a.x].xyz;
    let velocity_b = velocity_in[particle + entries.b.x].xyz;
    let velocity_c = velocity_in[particle + entries.c.x].xyz;
    let velocity_d = velocity_in[particle + entries.d.x].xyz;
    return SpringPulls(
        spring_pull(spring_place(row, at, 0u), entries.a, position_a - position, velocity_a - velocity),
        spring_pull(spring_place(row, at, 1u), entries.b, position_b - position, velocity_b - velocity),
        spring_pull(spring_place(row, at, 2u), entries.c, position_c - position, velocity_c - velocity),
        spring_pull(spring_place(row, at, 3u), entries.d, position_d - position, velocity_d - velocity),
    );
}

fn spring_pull_add(sum: vec3f, pull: vec4f, row: SpringRow, at: u32) -> vec3f {
    return select(sum, add_scaled(sum, pull.w, pull.xyz), at < row.end);
}

// `start` and the forces of the springs from the one at `at` on, in their order.
fn spring_pulls_add(start: vec3f, pulls: SpringPulls, row: SpringRow, at: u32) -> vec3f {
    var sum = start;
    sum = spring_pull_add(sum, pulls.a, row, at);
    sum = spring_pull_add(sum, pulls.b, row, at + 1u * row.stride);
    sum = spring_pull_add(sum, pulls.c, row, at + 2u * row.stride);
    sum = spring_pull_add(sum, pulls.d, row, at + 3u * row.stride);
    return sum;
}

// `start` and the forces of all springs of a row from the one at `first` on.
fn springs_add(start: vec3f, row: SpringRow, first: u32, particle: u32, position: vec3f, velocity: vec3f) -> vec3f {
    var sum = start;
    for (var at = first; at < row.end; at += SPRING_BATCH * row.stride) {
        sum = spring_pulls_add(sum, spring_pulls(row, at, spring_entries_of(row, at), particle, position, velocity), row, at);
    }
    return sum;
}

// `start` and the forces of all springs of a particle.
fn spring_force(start: vec3f, particle: u32, position: vec3f, velocity: vec3f) -> vec3f {
    let row = spring_row(particle);
    return springs_add(start, row, row.first, particle, position, velocity);
}
