// What changes from one substep to the next: one entry of an array, chosen by a dynamic offset.

struct Substep {
    // Wind velocity [m/s].
    wind: vec3f,
    // Length h [s].
    length: f32,
    // Number of the substep since the state was written, from 1.
    serial: u32,
    // The colliders at its end, in `colliders`.
    collider_first: u32,
    collider_count: u32,
    // Share of an overlap that contact takes back.
    contact_recovery: f32,
    // Time at its start since the state was written [s].
    time: f32,
    // Sum of the FLAG_ constants.
    flags: u32,
    // Number of the call of `contact_candidates`, from 1.
    contact_tick: u32,
    // Simulated time at its start [s].
    clock: f32,
    // Offset of the anchors of forces at its end [m].
    anchor_offset: vec3f,
    padding: f32,
}

@group(0) @binding(1) var<uniform> substep: Substep;

// Contacts of every particle are to be counted.
const FLAG_COUNT_CONTACTS: u32 = 1u;
