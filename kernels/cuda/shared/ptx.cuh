// Instructions of the device that CUDA C++ has no words for. Nothing else is written in them, so that kernels can run where there
// is no device, with other functions of these names.

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

// The same without waiting: for who waits there, this one has come.
__device__ __forceinline__ void team_arrive(unsigned barrier, unsigned threads) { asm volatile("bar.arrive %0, %1;" : : "r"(barrier), "r"(threads) : "memory"); }

// Writes a number in shared memory for other threads of the block. Who has seen it sees all that this thread has written or waited for.
__device__ __forceinline__ void note_write(unsigned* note, unsigned number) {
    asm volatile("st.release.cta.shared.u32 [%0], %1;" : : "r"((unsigned)__cvta_generic_to_shared(note)), "r"(number) : "memory");
}

// Waits until that number is there.
__device__ __forceinline__ void note_wait(const unsigned* note, unsigned number) {
    unsigned address = (unsigned)__cvta_generic_to_shared(note), present;
    do {
        asm volatile("ld.acquire.cta.shared.u32 %0, [%1];" : "=r"(present) : "r"(address) : "memory");
    } while (present != number);
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
