// NUMERICS section 5, linear solvers: the scalars of an iteration, and what became of all solves. An iteration
// has two kernels. The first reads `next` and makes `current` of it, the second reads `current` and
// writes `next`: so nobody reads what another workgroup writes. Where it has one kernel, `next` and `current` take turns.

struct SolveState {
    // One of the SOLVE_ constants.
    phase: u32,
    // Iterations done.
    iteration: u32,
    // r . P^-1 r and r . r of this iteration.
    gamma: f32,
    residual: f32,
    // r . r of the start at z; negative until it is known.
    reference: f32,
    // Step length of the iteration before, 0 at first; gamma then.
    alpha_before: f32,
    gamma_before: f32,
    // Damping of Jacobi, and how often it was halved.
    omega: f32,
    halvings: u32,
    // Estimate of the error in the norm of the energy, relative to that of the start; negative where there is none.
    energy: f32,
    padding_1: u32,
    padding_2: u32,
}

struct Solve {
    current: SolveState,
    next: SolveState,
    // Contacts that the last `constraint_release` changed.
    changed: atomic<u32>,
    // Particles that colliders constrain.
    constrained: atomic<u32>,
    // Contacts changed since the host looked.
    released: atomic<u32>,
    // Result of `vector_dot`.
    scalar: f32,
    // Of the last solve: iterations, phase, relative residual.
    outcome_iterations: u32,
    outcome_phase: u32,
    outcome_residual: f32,
    // Since the host looked: solves, those above their tolerance, iterations, largest residual.
    solves: u32,
    solves_unconverged: u32,
    iterations: u32,
    residual_max: f32,
    // How much closer the first solution is than z in the square of the norm of the energy.
    energy_before: f32,
    // Most iterations of the first, second ... solve of a substep; further ones count as the last.
    iterations_most: vec4<u32>,
    // What iterations took away of the square of the error, in sums of `energy_stride` terms: how many sums, terms of the last one.
    energy_stride: u32,
    energy_filled: u32,
    energy_last: u32,
    padding: u32,
    energy_sums: array<vec4f, 16>,
}

@group(0) @binding(44) var<storage, read_write> solve: Solve;
// Sums of blocks of particles.
@group(0) @binding(43) var<storage, read_write> partials: array<vec2f>;

// Nothing is to be done.
const SOLVE_SKIPPED: u32 = 0u;
const SOLVE_RUNNING: u32 = 1u;
const SOLVE_CONVERGED: u32 = 2u;
// It stands as it is, above the tolerance.
const SOLVE_ENDED: u32 = 3u;
const SOLVE_BROKEN: u32 = 4u;
// Rounding has made the preconditioner or the matrix indefinite.
const SOLVE_INDEFINITE: u32 = 5u;

// Threads of a workgroup of these kernels.
const SOLVE_THREADS: u32 = 256u;
// Most blocks of particles: partial sums of one kind.
const PARTIALS_MAX: u32 = 1024u;
// Where the sums are that an odd iteration of one kernel reads.
const PARTIALS_ODD: u32 = 2048u;

var<workgroup> sums: array<vec2f, SOLVE_THREADS>;
var<workgroup> shared_phase: u32;

// The sum over all threads of a workgroup, for all of them, in a fixed tree of four branches.
fn workgroup_sum(thread: u32, own: vec2f) -> vec2f {
    workgroupBarrier();
    sums[thread] = own;
    for (var quarter = SOLVE_THREADS / 4u; quarter > 0u; quarter /= 4u) {
        workgroupBarrier();
        if thread < quarter {
            let first = sums[thread] + sums[thread + quarter];
            sums[thread] = first + (sums[thread + 2u * quarter] + sums[thread + 3u * quarter]);
        }
    }
    return workgroupUniformLoad(&sums[0]);
}

// The sum of all partial sums from place `first` on, for all threads.
fn partials_total(thread: u32, first: u32) -> vec2f {
    var own = vec2f(0.0);
    for (var block = thread; block < model.solve_blocks; block += SOLVE_THREADS) {
        own += partials[first + block];
    }
    return workgroup_sum(thread, own);
}

// The phase of a state, for all threads of a workgroup.
fn phase_uniform(thread: u32, phase: u32) -> u32 {
    if thread == 0u {
        shared_phase = phase;
    }
    return workgroupUniformLoad(&shared_phase);
}

// Whether a number is finite, by its bits.
fn is_number(value: f32) -> bool {
    return (bitcast<u32>(value) & 0x7f800000u) != 0x7f800000u;
}
