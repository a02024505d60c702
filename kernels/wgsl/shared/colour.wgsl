// A colour of what is strain limited: none of it shares a particle with another.

struct Colour {
    // Where it begins in the list of its springs or triangles.
    first: u32,
    count: u32,
    // Largest stretch of triangles.
    ratio: f32,
    padding_0: u32,
}

@group(0) @binding(20) var<uniform> colour: Colour;
