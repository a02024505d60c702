// Groups near by whose particles are compared at a time.

const TURN: u32 = 2u;
