// NUMERICS section 3: procedural fields. This part is for models that have none; for others the backend
// puts the functions of their programs in its place.

// The force with those of all procedural fields added [N].
__device__ __forceinline__ vec3 procedural_force(const SubstepData& substep, uint i, const vec3& x, const vec3& v, real mass, const vec3& force) {
    return force;
}
