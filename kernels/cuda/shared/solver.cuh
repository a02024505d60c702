// All memory of a solver, as `layout.rs` of the backend lays it out.

// One substep, in the order of the queue.
struct SubstepData {
    ulong step;
    uint collider_first;
    // Number of this use of the candidate list.
    uint tick;
    real length;
    real wind[3];
    // Simulated time at its start [s].
    real time;
    real padding;
};

// A solid as signed distances, NUMERICS section 7.
struct DistanceGrid {
    const float* distances;
    uint size[3];
    // Sets of samples.
    uint sets;
    real origin[3];
    real spacing;
    real inverse_spacing;
    // Largest place along each axis, in units of the grid.
    real last[3];
    // Sets per second [1/s].
    real rate;
    real padding;
};

struct Collider {
    // One of the SHAPE_ constants.
    ulong shape;
    const DistanceGrid* grid;
    real translation[3];
    real linear_velocity[3];
    real angular_velocity[3];
    // Local to world, row by row.
    real rotation[9];
    // Radius; half length and radius of a capsule; half extents of a box [m]; number of the set of samples of a grid that
    // holds, and share of the one that follows.
    real size[3];
    real friction;
    real restitution;
    real padding;
};

// Springs that buckle, NUMERICS section 2.
struct Buckling {
    real force_scale;
    real inverse_rest_length;
    real energy_offset;
    real stiff_compression;
    real stiff_energy;
    real padding;
};

// What the host reads after a frame.
struct Status {
    // Of the frame kernel, the list kernel, the linear solver.
    ulong barrier[4];
    // First substep that ended with a number that is not finite; all ones if there is none.
    ulong non_finite_step;
    ulong contacts;
    ulong candidates;
    // Entries per particle that the candidate list would have needed, if it was too short.
    uint overflow;
    uint rebuilds;
    uint built_tick;
    uint built;
    // Entry t mod 4 is t if the list does not hold for use t.
    uint stale[4];
    // Drift of everything when the list was built [m per use].
    double drift[3];
    // Uses that it was built for.
    double horizon;
    double padding[2];
};

struct Solver {
    // Position [m] and inverse mass [1/kg], 0 while held; velocity [m/s] and mass [kg].
    real4* position[2];
    real4* velocity[2];
    real4* force;
    real4* kept_position;
    real4* kept_velocity;
    // For each particle the number of its row; for each row first entry, and count with log2 of the stride
    // above bit 24; entries as offset to the other particle and kind; kinds as rest length, stiffness,
    // damping.
    const uint* spring_row;
    const uint2* spring_headers;
    const uint2* spring_entries;
    const real4* spring_kinds;
    const Buckling* spring_buckling;
    // Half the thickness of the cloth at each particle [m].
    const real* offsets;
    const uint* triangle_rows;
    const uint* triangle_entries;
    // Corners and cloth.
    const uint4* triangles;
    const real* air;
    const Collider* colliders;
    const SubstepData* substeps;
    Status* status;
    // Blocks whose particles each block of the frame kernel reads.
    const uint* dependency_rows;
    const uint* dependencies;
    ulong* progress;
    // Candidate list: entry k of particle i at k n + i, ascending.
    uint* candidates;
    uint* candidate_counts;
    // Position when the list was built, and its motion per use as a number of 24 bits.
    real4* reference;
    const real4* rest;
    uint* cell_counts;
    uint* cell_starts;
    uint* cell_sums;
    uint* cell_of;
    uint* cell_rank;
    real4* sorted;
    uint* sorted_index;
    uint* crowd;
    const uint4* limited_springs;
    const real* longest;
    double* partials;
    // Number 6 c + q of component q of what collider c did to each particle, impulse and moment; null if nobody
    // asks.
    double* impulses;

    uint count;
    uint header_count;
    uint entry_count;
    uint kind_count;
    uint collider_count;
    // The motion that holds the present state.
    uint present;
    uint can_buckle;
    uint has_air;
    // Cells along each axis, powers of two.
    uint cells[3];
    uint candidate_capacity;
    // Bits: penalty, impulse.
    uint contact;
    // Particles of a block of the frame kernel, or tiles of a patch.
    uint chunk;
    // Particles along both sides if the model is one regular patch, 0 if not.
    uint columns;
    uint rows;
    ulong epoch;

    real acceleration[3];
    real drag_rate[3];
    real contact_distance;
    real contact_stiffness;
    real contact_damping;
    real contact_restitution;
    real contact_friction;
    // Allowance a, reach (c - d) / 2, cells per metre, horizon in uses, list distance, largest motion per use.
    real list_allowance;
    real list_reach;
    real cells_per_metre;
    real list_horizon;
    real list_distance;
    real list_motion_max;
    // Mean motion per use [m].
    real drift[3];
    // Length of a substep that motion per use is foreseen with [s].
    real time_step;
};

// Positions and velocities that a kernel reads.
struct Motion {
    const real4* x;
    const real4* v;
};

__device__ __forceinline__ Motion present_motion(const Solver& s) {
    return {s.position[s.present], s.velocity[s.present]};
}

#define CONTACT_PENALTY 1u
#define CONTACT_IMPULSE 2u
