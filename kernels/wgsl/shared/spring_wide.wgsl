// NUMERICS section 2: the forces of springs where a particle has several threads. One of them computes those of the first springs, another
// those of all further ones, each six at a time as in `spring_force`; they are added up in their order.

// Springs at a time.
const BATCH: u32 = 6u;

// The sum over the first ones.
var<workgroup> spring_sums: array<vec3f, GROUP>;

// What is known of springs.
struct Entries {
    a: vec4<u32>,
    b: vec4<u32>,
    c: vec4<u32>,
    d: vec4<u32>,
    e: vec4<u32>,
    f: vec4<u32>,
}

// Direction and tension of each.
struct Pulls {
    a: vec4f,
    b: vec4f,
    c: vec4f,
    d: vec4f,
    e: vec4f,
    f: vec4f,
}

// Where a spring is, by its number in the row. What lies beyond the row is the last one once more.
fn spring_place(row: SpringRow, number: u32) -> u32 {
    return min(row.first + number * row.stride, row.end - row.stride);
}

fn entries_of(row: SpringRow, first: u32) -> Entries {
    return Entries(
        spring_entries[spring_place(row, first)],
        spring_entries[spring_place(row, first + 1u)],
        spring_entries[spring_place(row, first + 2u)],
        spring_entries[spring_place(row, first + 3u)],
        spring_entries[spring_place(row, first + 4u)],
        spring_entries[spring_place(row, first + 5u)],
    );
}

fn pull_of(at: u32, entry: vec4<u32>, difference: vec3f, relative: vec3f) -> vec4f {
    let spring = spring_of(at, entry, difference, relative);
    return vec4f(spring.difference, spring.tension * spring.inverse_length);
}

fn pulls_of(row: SpringRow, first: u32, entries: Entries, particle: u32, position: vec3f, velocity: vec3f) -> Pulls {
    let position_a = position_in[particle + entries.a.x].xyz;
    let position_b = position_in[particle + entries.b.x].xyz;
    let position_c = position_in[particle + entries.c.x].xyz;
    let position_d = position_in[particle + entries.d.x].xyz;
    let position_e = position_in[particle + entries.e.x].xyz;
    let position_f = position_in[particle + entries.f.x].xyz;
    let velocity_a = velocity_in[particle + entries.a.x].xyz;
    let velocity_b = velocity_in[particle + entries.b.x].xyz;
    let velocity_c = velocity_in[particle + entries.c.x].xyz;
    let velocity_d = velocity_in[particle + entries.d.x].xyz;
    let velocity_e = velocity_in[particle + entries.e.x].xyz;
    let velocity_f = velocity_in[particle + entries.f.x].xyz;
    return Pulls(
        pull_of(spring_place(row, first), entries.a, position_a - position, velocity_a - velocity),
        pull_of(spring_place(row, first + 1u), entries.b, position_b - position, velocity_b - velocity),
        pull_of(spring_place(row, first + 2u), entries.c, position_c - position, velocity_c - velocity),
        pull_of(spring_place(row, first + 3u), entries.d, position_d - position, velocity_d - velocity),
        pull_of(spring_place(row, first + 4u), entries.e, position_e - position, velocity_e - velocity),
        pull_of(spring_place(row, first + 5u), entries.f, position_f - position, velocity_f - velocity),
    );
}

fn pull_add(sum: vec3f, pull: vec4f, row: SpringRow, number: u32) -> vec3f {
    return select(sum, add_scaled(sum, pull.w, pull.xyz), row.first + number * row.stride < row.end);
}

// `start` and the pulls of the springs from number `first` on.
fn pulls_add(start: vec3f, pulls: Pulls, row: SpringRow, first: u32) -> vec3f {
    var sum = pull_add(start, pulls.a, row, first);
    sum = pull_add(sum, pulls.b, row, first + 1u);
    sum = pull_add(sum, pulls.c, row, first + 2u);
    sum = pull_add(sum, pulls.d, row, first + 3u);
    sum = pull_add(sum, pulls.e, row, first + 4u);
    return pull_add(sum, pulls.f, row, first + 5u);
}

// `start` and the forces of all springs from number `first` on.
fn springs_add(start: vec3f, row: SpringRow, first: u32, particle: u32, position: vec3f, velocity: vec3f) -> vec3f {
    var sum = start;
    for (var number = first; row.first + number * row.stride < row.end; number += BATCH) {
        let pulls = pulls_of(row, number, entries_of(row, number), particle, position, velocity);
        sum = pulls_add(sum, pulls, row, number);
    }
    return sum;
}
