// Groups near by whose particles are compared at a time. `contact_turn_crews.wgsl` is the other half of this choice.

const TURN: u32 = 2u;
