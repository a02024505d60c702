// What holds for a whole picture.

struct View {
    clip_from_world: mat4x4f,
    world_from_clip: mat4x4f,
    light_from_world: mat4x4f,
    // Eye [m]; w: 1 if strain is to be shown.
    eye: vec4f,
    // Unit vector to the light; w: side of a texel of the shadow map [m].
    light: vec4f,
    // Middle of the scene [m]; w: its radius [m].
    focus: vec4f,
    // Side of the tiles of the floor [m]; strain shown as hottest; width and height [pixel].
    options: vec4f,
}

@group(0) @binding(0) var<uniform> view: View;
