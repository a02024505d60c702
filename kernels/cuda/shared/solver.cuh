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
    // Share of an overlap that impulses take back.
    real recovery;
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
    // Of the sweeps of strain limits, the linear solver.
    ulong barrier[2];
    // Of the frame kernel with contact, used in turn.
    ulong meetings[2];
    // First substep that ended with a number that is not finite; all ones if there is none.
    ulong non_finite_step;
    ulong contacts;
    ulong candidates;
    // Entries per particle that the rows of contacts would have needed, and per group that the list would have, if
    // they were too short.
    uint overflow;
    uint group_overflow;
    uint rebuilds;
    // One of LIST_BUILT; 0 if there is no list.
    uint built;
    // Entry t mod 4 is t if the list does not hold for use t.
    uint stale[4];
    // The last use that some region was too large for the grid at.
    uint large;
    // Tiles that are searched for contact, and groups of these that warps have taken beside their first, for three substeps in
    // turn.
    uint searched[3];
    uint taken[3];
    // The last use that some of these are to be done again at whatever they touch.
    uint again;
};

struct FabricLaw;
struct MembraneTriangle;

// A part of the particles whose springs are shortened together: where its particles begin in the list, how many of them are its
// own, which come first, and how many there are with those that these depend on.
struct LimitRegion {
    uint first_particle;
    uint owned;
    uint particles;
    uint padding;
};

struct Solver {
    // Position [m] and inverse mass [1/kg], 0 while held; velocity [m/s] and mass [kg]: two that take turns, and one that stands in for
    // the first state of a frame where that is to stay as it is, or null.
    real4* position[3];
    real4* velocity[3];
    real4* force;
    real4* kept_position;
    real4* kept_velocity;
    // Positions at the start of the substep that is under way, or null.
    const real4* start_position;
    // For each particle the number of its row; for each row first entry, and count with log2 of the stride
    // above bit 24; entries as offset to the other particle and kind; kinds as rest length, stiffness,
    // damping.
    const uint* spring_row;
    const uint2* spring_headers;
    const uint2* spring_entries;
    // The entries in one word each, kind above bit 16, if they fit.
    const uint* spring_packed;
    const real4* spring_kinds;
    const Buckling* spring_buckling;
    // Half the thickness of the cloth at each particle [m].
    const real* offsets;
    // For each particle its triangles in ascending order, with corners and cloth.
    const uint* triangle_rows;
    const uint4* triangles;
    const real* air;
    // For each cloth a sixth of the pressure of the gas within [Pa], when it begins to rise and when it is there [s]; null without gas.
    const real* gas;
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
    const real4* rest;
    // Groups of 32 particles, NONE where one has fewer: the particles; position and number of each, and the boxes
    // around them, both twice as others read what is there while it is written anew; the regions that the list was
    // made for; the groups that may come near each, and how many.
    const uint* group_members;
    real4* group_positions[2];
    real4* group_boxes[2];
    real4* group_regions;
    uint* group_rows;
    uint* group_counts;
    // Chains of regions by cell: use that a chain is of, and first node; next node and cell.
    ulong* cell_heads;
    uint2* cell_nodes;
    uint* crowd;
    // Of a large patch: regions of tiles and, behind them, of the runs of blocks; what is asked of their edges; the last use that each was searched for contact at, and
    // those that are; and the last use that groups of each were not flat at, a bit each.
    real4* tile_boxes;
    real4* tile_flat;
    uint* tile_marks;
    uint* tile_list;
    uint2* tile_rough;
    // Springs that are limited, colour by colour, with the largest length of each kind. Regions in each of which a block shortens all
    // springs that its own particles depend on: their particles, where the springs of each colour begin, two places of 16
    // bits among the particles and the kind for each spring.
    const uint4* limited_springs;
    const uint* limited_rows;
    const real* longest;
    // Triangles of fabric that are limited, colour by colour, and where each colour begins.
    const uint* stretch_triangles;
    const uint* stretch_rows;
    const LimitRegion* limit_regions;
    const uint* limit_particles;
    const uint* limit_rows;
    const uint2* limit_springs;
    double* partials;
    // Number 6 c + q of component q of what collider c did to each particle, impulse and moment; null if nobody
    // asks.
    double* collider_impulses;
    // Triangles of fabric; what was last computed of each at its corners, and of each fold at its vertices: forces, or impulses of
    // an implicit step; and for each particle, ascending, the places among these that are its own.
    const FabricLaw* fabric_laws;
    const MembraneTriangle* membranes;
    const real* plates;
    real4* membrane_forces;
    real4* bending_forces;
    const uint* membrane_rows;
    const uint* membrane_entries;
    // Folds, each once: vertices, angle at rest; those of the patches; how far they are from rest and how fast they fold, and of what their derivatives
    // consist, with a last one that never does; what patches ask of theirs, with a last number that is zero, and for each fold up to six places of that; for each particle the places among
    // forces on the vertices of folds, which are in `bending_forces` too.
    const uint4* fold_particles;
    const real* fold_angles;
    const uint* patch_folds;
    real2* fold_states;
    real4* fold_apexes;
    real* fold_moments;
    const uint* moment_places;
    const uint* fold_rows;
    const uint* fold_entries;

    uint count;
    uint header_count;
    uint entry_count;
    uint kind_count;
    uint collider_count;
    // The motion that holds the present state.
    uint present;
    uint can_buckle;
    uint has_air;
    uint group_count;
    uint group_capacity;
    uint cell_mask;
    uint candidate_capacity;
    // Bits: penalty, impulse.
    uint contact;
    // Particles of a block of the frame kernel, or tiles of a patch.
    uint chunk;
    // Particles along both sides if the model is one regular patch, 0 if not.
    uint columns;
    uint rows;
    uint limit_region_count;
    uint limit_colours;
    uint limit_sweeps;
    uint stretch_colours;
    // Particles of a region at most, and its own; springs of a region at most, if each block has one region and keeps them, or 0.
    uint limit_particles_max;
    uint limit_owned_max;
    uint limit_springs_near;
    // Triangles of fabric.
    uint element_count;
    uint fold_count;
    ulong epoch;

    real acceleration[3];
    real drag_rate[3];
    real contact_distance;
    real contact_stiffness;
    real contact_damping;
    real contact_restitution;
    real contact_friction;
    // Of the list of groups: what is added to regions [m], time that they are made for [s].
    real list_margin;
    real list_horizon;
    real cells_per_metre;
    // Rest length, stiffness and damping of the springs to the later of 12 neighbours in a patch, if all are alike.
    real stencil[6][3];
    // Largest stretch of triangles.
    real stretch_ratio;
};

static_assert(sizeof(Solver) == (696 + 33 * sizeof(real) + 7) / 8 * 8, "`layout.rs` of the backend has another layout");

// Positions and velocities that a kernel reads.
struct Motion {
    const real4* x;
    const real4* v;
};

__device__ __forceinline__ Motion present_motion(const Solver& s) {
    return {s.position[s.present], s.velocity[s.present]};
}

// Where the state is after so many substeps of a frame.
__device__ __forceinline__ uint state_after(const Solver& s, uint substeps) {
    return substeps & 1 ? 1 - s.present : substeps > 0 && s.position[2] ? 2 : s.present;
}

#define CONTACT_PENALTY 1u
#define CONTACT_IMPULSE 2u
