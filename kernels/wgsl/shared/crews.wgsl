// A workgroup of several threads for each particle of a group, in a model of few groups.

// Threads of a particle. Those with the same number are a crew: what only one thread of a particle does, crew 0 does.
const CREWS: u32 = 4u;
const THREADS: u32 = CREWS * GROUP;
