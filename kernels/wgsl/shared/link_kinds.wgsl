// The kind of the spring behind each entry of `link_entries`, and all kinds in the form of
// `spring_entries`.

@group(0) @binding(36) var<storage, read> link_kinds: array<u32>;
@group(0) @binding(37) var<storage, read> spring_kinds: array<vec4<u32>>;

fn spring_word(at: u32) -> vec4<u32> {
    return spring_kinds[at];
}

fn link_kind(at: u32) -> u32 {
    return link_kinds[at] * SPRING_WORDS;
}
