// Instructions of the device that CUDA C++ has no words for. Nothing else is written in them, so that kernels can run where there
// is no device, with other functions of these names.

// The shared memory of a block whose size the launch says.
extern __shared__ __align__(16) unsigned char frame_memory[];

// One divided by the square root, and one divided by the number, roughly.
__device__ __forceinline__ float root_inverse_rough(float a) {
    float r;
    asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(a));
    return r;
}

__device__ __forceinline__ float inverse_rough(float a) {
    float r;
    asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(a));
    return r;
}

__device__ __forceinline__ unsigned long long load_acquire(const unsigned long long* address) {
    unsigned long long value;
    asm volatile("ld.acquire.gpu.global.u64 %0, [%1];" : "=l"(value) : "l"(address) : "memory");
    return value;
}

__device__ __forceinline__ void store_release(unsigned long long* address, unsigned long long value) {
    asm volatile("st.release.gpu.global.u64 [%0], %1;" : : "l"(address), "l"(value) : "memory");
}

// Adds; gives what was there.
__device__ __forceinline__ unsigned long long add_release(unsigned long long* address, unsigned long long value) {
    unsigned long long before;
    asm volatile("atom.add.release.gpu.global.u64 %0, [%1], %2;" : "=l"(before) : "l"(address), "l"(value) : "memory");
    return before;
}

// Both halves of 16 bytes at once.
__device__ __forceinline__ void pair_store(void* address, unsigned long long low, unsigned long long high) {
    asm volatile("{ .reg .b128 pair; mov.b128 pair, {%1, %2}; st.relaxed.gpu.global.b128 [%0], pair; }" : : "l"(address), "l"(low), "l"(high) : "memory");
}

__device__ __forceinline__ void pair_load(const void* address, unsigned long long& low, unsigned long long& high) {
    asm volatile("{ .reg .b128 pair; ld.relaxed.gpu.global.b128 pair, [%2]; mov.b128 {%0, %1}, pair; }" : "=l"(low), "=l"(high) : "l"(address) : "memory");
}

// Waits for so many threads of the block, whole warps that all name the same barrier, 1 to 15.
__device__ __forceinline__ void team_wait(unsigned barrier, unsigned threads) { asm volatile("bar.sync %0, %1;" : : "r"(barrier), "r"(threads) : "memory"); }

// A gate in shared memory, which opens for the next time when so many threads have arrived. Who has waited sees all that each of these has written
// or waited for itself: a warp arrives with all its lanes, so that a tool that follows this can tell what is not in order.
__device__ __forceinline__ void gate_make(unsigned long long* gate, unsigned threads) {
    asm volatile("mbarrier.init.shared.b64 [%0], %1;" : : "r"((unsigned)__cvta_generic_to_shared(gate)), "r"(threads) : "memory");
}

__device__ __forceinline__ void gate_arrive(unsigned long long* gate) {
    asm volatile("mbarrier.arrive.shared.b64 _, [%0];" : : "r"((unsigned)__cvta_generic_to_shared(gate)) : "memory");
}

// Waits until it has opened for time number `time`, from 0 on, of which only the last bit is looked at: it must not open once more before
// all who wait have seen it.
__device__ __forceinline__ void gate_wait(const unsigned long long* gate, unsigned time) {
    unsigned address = (unsigned)__cvta_generic_to_shared(gate), open;
    do {
#if __CUDA_ARCH__ >= 900
        // Lets others go on for a while.
        asm volatile("{ .reg .pred is_open; mbarrier.try_wait.parity.shared.b64 is_open, [%1], %2; selp.u32 %0, 1, 0, is_open; }"
                     : "=r"(open) : "r"(address), "r"(time & 1) : "memory");
#else
        asm volatile("{ .reg .pred is_open; mbarrier.test_wait.parity.shared.b64 is_open, [%1], %2; selp.u32 %0, 1, 0, is_open; }"
                     : "=r"(open) : "r"(address), "r"(time & 1) : "memory");
#endif
    } while (open == 0);
}

// Start to copy 16 or 8 bytes to shared memory; `copies_wait` waits for all that the thread has started.
__device__ __forceinline__ void copy_start_16(void* to, const void* from) {
    unsigned address = (unsigned)__cvta_generic_to_shared(to);
    asm volatile("cp.async.cg.shared.global [%0], [%1], 16;" : : "r"(address), "l"(from) : "memory");
}

__device__ __forceinline__ void copy_start_8(void* to, const void* from) {
    unsigned address = (unsigned)__cvta_generic_to_shared(to);
    asm volatile("cp.async.ca.shared.global [%0], [%1], 8;" : : "r"(address), "l"(from) : "memory");
}

__device__ __forceinline__ void copies_wait() { asm volatile("cp.async.wait_all;" : : : "memory"); }
