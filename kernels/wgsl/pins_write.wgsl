// Holds, moves or releases particles, in place.
//!include motion_out

struct Pin {
    // New position [m] and inverse mass [1/kg].
    position: vec4f,
    // New velocity [m/s].
    velocity: vec3f,
    particle: u32,
    // Whether the new position counts, whether the new velocity counts.
    has_position: u32,
    has_velocity: u32,
    padding_0: u32,
    padding_1: u32,
}

// The number of pins, then the pins.
struct Pins {
    count: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
    list: array<Pin>,
}

@group(0) @binding(23) var<storage, read> pins: Pins;

const WORKGROUP: u32 = 64u;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let place = id.x + id.y * groups.x * WORKGROUP;
    if place >= pins.count {
        return;
    }
    let pin = pins.list[place];
    var position = position_out[pin.particle].xyz;
    if pin.has_position != 0u {
        position = pin.position.xyz;
    }
    position_out[pin.particle] = vec4f(position, pin.position.w);
    var velocity = velocity_out[pin.particle];
    if pin.has_velocity != 0u {
        velocity = vec4f(pin.velocity, velocity.w);
    }
    velocity_out[pin.particle] = velocity;
}
