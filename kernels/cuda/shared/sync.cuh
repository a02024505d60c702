// Waiting for other blocks of a kernel whose blocks are all resident (a cooperative launch). A release by one
// thread after `__syncthreads` covers what all threads of its block wrote, an acquire before it what they read.

// All blocks of the grid. The counter only grows, so that it never has to be set back; each kernel has its
// own, as their numbers of blocks differ, and the host sets that of the linear solvers back where their form changes.
__device__ __forceinline__ void grid_barrier(ulong* counter) {
    __syncthreads();
    if (threadIdx.x == 0) {
        ulong blocks = gridDim.x;
        ulong target = (add_release(counter, 1) / blocks + 1) * blocks;
        while (load_acquire(counter) < target) {
        }
    }
    __syncthreads();
}

// The blocks whose particles this one reads have finished that many substeps.
__device__ __forceinline__ void wait_for_dependencies(const Solver& s, ulong done) {
    uint end = s.dependency_rows[blockIdx.x + 1];
    for (uint at = s.dependency_rows[blockIdx.x] + threadIdx.x; at < end; at += blockDim.x) {
        while (load_acquire(&s.progress[s.dependencies[at]]) < done) {
        }
    }
    __syncthreads();
}

__device__ __forceinline__ void publish(const Solver& s, ulong done) {
    __syncthreads();
    if (threadIdx.x == 0) {
        store_release(&s.progress[blockIdx.x], done);
    }
}
