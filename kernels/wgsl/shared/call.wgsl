// What a single kernel is told: one entry of an array, chosen by a dynamic offset.

struct Call {
    // Vectors that a kernel reads and writes, VECTOR_ constants.
    vector_from: u32,
    vector_to: u32,
    // Factors of these in a linear combination.
    from_scale: f32,
    to_scale: f32,
    // Time for which positions move [s], or factor of a solution.
    amount: f32,
    // Relative residual at which a linear solver stops.
    tolerance: f32,
    // Cap on its iterations.
    iterations_max: u32,
    // Sum of the CALL_ constants.
    flags: u32,
    // Number of the solve within its substep, from 0.
    pass_number: u32,
    // Solves within a substep at most.
    pass_count: u32,
    // Largest distance of the numbers of two particles that a spring joins.
    reach: u32,
    // Level of the preconditioner `schwarz`.
    level: u32,
    // What a vector is filled with.
    value_x: f32,
    value_y: f32,
    value_z: f32,
}

@group(0) @binding(33) var<uniform> call: Call;

// The system is that of an iterate of Newton's method.
const CALL_ITERATE: u32 = 1u;
// The preconditioner inverts 3 x 3 blocks.
const CALL_BLOCKS: u32 = 2u;
// A solver starts from the present solution.
const CALL_FROM_SOLUTION: u32 = 4u;
// The host does not wait for the solve: the device acts on what comes of it.
const CALL_DEFERRED: u32 = 8u;
// The vector is the start at z, of which only colliders make more than zero.
const CALL_REFERENCE: u32 = 16u;

// A solve that goes on from the one before, with the residual computed anew.
const CALL_REFINE: u32 = 32u;
// An odd number of iterations of one kernel each lies behind: their scalars are in `solve.current`.
const CALL_ODD: u32 = 64u;
// The preconditioner is `schwarz`: kernels of its own come after those that find a residual.
const CALL_SCHWARZ: u32 = 128u;
// These kernels are part of a solve, and do nothing once it has ended.
const CALL_SOLVE: u32 = 256u;
// A level is smoothed the second time.
const CALL_SECOND: u32 = 512u;
// A solve ends by the error in the norm of the energy.
const CALL_ENERGY: u32 = 1024u;
// The host is told of a direction without positive curvature, and may go on with another preconditioner.
const CALL_RESTARTS: u32 = 2048u;

fn call_has(flag: u32) -> bool {
    return (call.flags & flag) != 0u;
}
