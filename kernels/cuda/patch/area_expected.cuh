// Where the particles of a small patch are expected to be after a substep: where their velocities take them, and a margin on all sides. Groups
// send the boxes that they will be in a substep ahead, so that nobody waits for them. A block with a particle that is somewhere else, as what
// it hits may turn it around, says so as it does where particles leave their regions; then all search once more with boxes as they are.

// The margin, in contact distances. In the common workload a particle is farther off in one of 1,020 substeps; what is less than that makes
// fewer groups look near, but has all search again more often.
#define EXPECTED_MARGIN (real)0.3

__device__ __forceinline__ vec3 expected_place(const SubstepData& substep, const vec3& x, const vec3& v) { return x + substep.length * v; }

// The box of the particles of a warp that are expected at these places.
__device__ __forceinline__ Box expected_box(const Solver& s, bool exists, const vec3& place) {
    return box_grown(warp_box_finite(exists, place), EXPECTED_MARGIN * s.contact_distance);
}

// Whether a particle is where it was expected. It is within that box then, as the bounds of both are rounded alike; what is not a number is
// not.
__device__ __forceinline__ bool expected_holds(const Solver& s, const vec3& place, const vec3& position) {
    return box_holds(box_grown({place, place}, EXPECTED_MARGIN * s.contact_distance), position);
}
