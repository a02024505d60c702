// NUMERICS section 7, `collider_response`.

extern "C" __global__ void collider_response(const __grid_constant__ Solver s, uint number) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    real4 x = s.position[s.present][i];
    if (!(x.w > 0)) return;
    const SubstepData& substep = s.substeps[number];
    if (s.status->non_finite_step <= substep.step) return;
    real4 v = s.velocity[s.present][i];
    Moved moved = {xyz(x), xyz(v)};
    // Without a start a particle has stayed where it is.
    vec3 start = s.start_position != nullptr ? xyz(s.start_position[i]) : moved.position;
    collide_all<true>(s, s.colliders + substep.collider_first, i, s.offsets[i], x.w, start, substep.length, moved);
    s.position[s.present][i] = with_w(moved.position, x.w);
    s.velocity[s.present][i] = with_w(moved.velocity, v.w);
}
