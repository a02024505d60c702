// A short ascending row of partners that a thread keeps to itself.

// The smallest partners, NONE behind the last one. Not an array, so that it stays in registers: workgroup memory
// for all threads would leave room for fewer workgroups at a time.
struct Kept {
    a: vec4<u32>,
    b: vec4<u32>,
    c: vec4<u32>,
    d: vec4<u32>,
}

fn kept_none() -> Kept {
    let none = vec4<u32>(NONE);
    return Kept(none, none, none, none);
}

// Four places of an ascending row with one more number, which pushes the largest one out.
fn kept_insert(row: vec4<u32>, number: u32) -> vec4<u32> {
    return min(max(vec4<u32>(0u, row.xyz), vec4<u32>(number)), row);
}

fn kept_add(kept: Kept, partner: u32) -> Kept {
    let after_a = max(kept.a.w, partner);
    let after_b = max(kept.b.w, after_a);
    let after_c = max(kept.c.w, after_b);
    return Kept(
        kept_insert(kept.a, partner),
        kept_insert(kept.b, after_a),
        kept_insert(kept.c, after_b),
        kept_insert(kept.d, after_c),
    );
}

// Without the first one.
fn kept_rest(kept: Kept) -> Kept {
    return Kept(
        vec4<u32>(kept.a.yzw, kept.b.x),
        vec4<u32>(kept.b.yzw, kept.c.x),
        vec4<u32>(kept.c.yzw, kept.d.x),
        vec4<u32>(kept.d.yzw, NONE),
    );
}
