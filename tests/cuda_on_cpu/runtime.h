// CUDA on the processor, as far as the kernels of a frame need it: each block is a thread of the system, each of its threads a
// fiber. Fibers take turns where CUDA threads wait for each other; an order drawn by lot, and copies to shared memory that come as
// late as they may, show what is right by chance alone.

#include <sched.h>
#include <setjmp.h>
#include <ucontext.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

// The system has one of its own, of another type.
#define ulong cuda_ulong

#define __device__
#define __global__
#define __forceinline__ inline
#define __noinline__ __attribute__((noinline))
#define __grid_constant__
#define __launch_bounds__(...)
#define __align__(bytes) alignas(bytes)
#define __shared__ static thread_local

struct uint2 {
    unsigned x, y;
};

struct alignas(16) uint4 {
    unsigned x, y, z, w;
};

struct float2 {
    float x, y;
};

struct alignas(16) double2 {
    double x, y;
};

struct Index {
    unsigned x;
};

static thread_local Index threadIdx, blockIdx, blockDim, gridDim;

// As much as a block may have.
alignas(16) static thread_local unsigned char frame_memory[232448];

struct Copy {
    void* to;
    const void* from;
    size_t bytes;
};

struct Fiber {
    static constexpr size_t STACK = 256 << 10;
    // Where it begins, and where it goes on once it has: the way back to a context asks the system each time, a jump does not.
    ucontext_t beginning;
    jmp_buf place;
    std::unique_ptr<char[]> stack;
    bool has_begun = false, is_done = false;
    // Operations of its warp so far.
    unsigned operations = 0;
    std::vector<Copy> copies;
};

// What the lanes of a warp show each other, for two operations in turn: nobody is two ahead.
struct Warp {
    uint64_t shown[2][32] = {};
    unsigned operations[32] = {};
};

struct Block {
    std::vector<Fiber> fibers;
    std::vector<Warp> warps;
    jmp_buf outside;
    // At each barrier.
    unsigned arrived[16] = {}, generation[16] = {};
    // Whether fibers take turns in an order drawn by lot, and copies come late.
    bool is_shuffled = false;
    std::mt19937 lot;

    Fiber& present() { return fibers[threadIdx.x]; }

    // Goes on with a fiber and does not come back.
    [[noreturn]] void enter(unsigned number) {
        Fiber& fiber = fibers[number];
        threadIdx.x = number;
        if (fiber.has_begun) _longjmp(fiber.place, 1);
        fiber.has_begun = true;
        setcontext(&fiber.beginning);
        abort();
    }

    // Another fiber that is not done; this one if there is none.
    unsigned other() {
        unsigned count = (unsigned)fibers.size(), next = threadIdx.x;
        if (is_shuffled && lot() % 4 == 0) next = lot() % count;
        for (unsigned tried = 0; tried < count; tried++) {
            next = (next + 1) % count;
            if (!fibers[next].is_done) return next;
        }
        return threadIdx.x;
    }
};

static thread_local Block* block;

// Lets another thread of the block go on.
static void yield_to_other() {
    unsigned self = threadIdx.x, next = block->other();
    if (next == self) return;
    if (_setjmp(block->fibers[self].place) == 0) block->enter(next);
}

// The same, and another block as well: in loops that wait for one.
static void yield_to_block() {
    sched_yield();
    yield_to_other();
}

// Waits for so many threads of the block.
static void team_wait(unsigned barrier, unsigned threads) {
    unsigned generation = block->generation[barrier];
    if (++block->arrived[barrier] == threads) {
        block->arrived[barrier] = 0;
        block->generation[barrier]++;
    }
    while (block->generation[barrier] == generation) yield_to_other();
}

struct Gate {
    uint16_t threads, missing;
    uint32_t times;
};

static void gate_make(unsigned long long* gate, unsigned threads) { *(Gate*)gate = {(uint16_t)threads, (uint16_t)threads, 0}; }

static void gate_arrive(unsigned long long* address) {
    Gate& gate = *(Gate*)address;
    if (--gate.missing > 0) return;
    gate.missing = gate.threads;
    gate.times++;
}

static void gate_wait(const unsigned long long* address, unsigned time) {
    const volatile Gate& gate = *(const volatile Gate*)address;
    while (((gate.times ^ time) & 1) == 0) yield_to_other();
}

static void __syncthreads() { team_wait(0, (unsigned)block->fibers.size()); }

// Shows a value to the warp; gives what all lanes show.
static const uint64_t* warp_show(uint64_t value) {
    Warp& warp = block->warps[threadIdx.x / 32];
    unsigned operation = block->present().operations++;
    warp.shown[operation & 1][threadIdx.x % 32] = value;
    warp.operations[threadIdx.x % 32] = operation + 1;
    for (unsigned lane = 0; lane < 32; lane++) {
        while ((int)(warp.operations[lane] - operation - 1) < 0) yield_to_other();
    }
    return warp.shown[operation & 1];
}

template <typename To, typename From> static To bits_as(From from) {
    static_assert(sizeof(To) == sizeof(From));
    To to;
    memcpy(&to, &from, sizeof to);
    return to;
}

template <typename T> static uint64_t to_word(T value) {
    uint64_t word = 0;
    memcpy(&word, &value, sizeof value);
    return word;
}

template <typename T> static T of_word(uint64_t word) {
    T value;
    memcpy(&value, &word, sizeof value);
    return value;
}

static void __syncwarp() { warp_show(0); }

template <typename T> static T __shfl_sync(unsigned, T value, unsigned lane) { return of_word<T>(warp_show(to_word(value))[lane % 32]); }

template <typename T> static T __shfl_xor_sync(unsigned, T value, unsigned mask) {
    unsigned lane = (threadIdx.x ^ mask) % 32;
    return of_word<T>(warp_show(to_word(value))[lane]);
}

static unsigned __ballot_sync(unsigned, bool value) {
    const uint64_t* shown = warp_show(value);
    unsigned bits = 0;
    for (unsigned lane = 0; lane < 32; lane++) bits |= (unsigned)shown[lane] << lane;
    return bits;
}

static bool __any_sync(unsigned lanes, bool value) { return __ballot_sync(lanes, value) != 0; }

static bool __all_sync(unsigned lanes, bool value) { return !__any_sync(lanes, !value); }

static int __reduce_min_sync(unsigned, int value) {
    const uint64_t* shown = warp_show(to_word(value));
    int least = value;
    for (unsigned lane = 0; lane < 32; lane++) least = std::min(least, of_word<int>(shown[lane]));
    return least;
}

static int __reduce_add_sync(unsigned, int value) {
    const uint64_t* shown = warp_show(to_word(value));
    int sum = 0;
    for (unsigned lane = 0; lane < 32; lane++) sum += of_word<int>(shown[lane]);
    return sum;
}

static int __reduce_max_sync(unsigned lanes, int value) { return ~__reduce_min_sync(lanes, ~value); }

static unsigned __byte_perm(unsigned a, unsigned b, unsigned places) {
    uint64_t bytes = (uint64_t)b << 32 | a;
    unsigned chosen = 0;
    for (int k = 0; k < 4; k++) chosen |= (unsigned)(bytes >> 8 * (places >> 4 * k & 7) & 255) << 8 * k;
    return chosen;
}

static int __dp4a(int a, int b, int sum) {
    for (int k = 0; k < 4; k++) sum += (int8_t)(a >> 8 * k) * (int8_t)(b >> 8 * k);
    return sum;
}

static unsigned __funnelshift_l(unsigned low, unsigned high, unsigned bits) {
    return (unsigned)(((uint64_t)high << 32 | low) << bits >> 32);
}

static int __popc(unsigned bits) { return __builtin_popcount(bits); }
static int __ffs(unsigned bits) { return __builtin_ffs((int)bits); }
static int __clz(unsigned bits) { return bits ? __builtin_clz(bits) : 32; }
template <typename T> static T __ldg(const T* address) { return *address; }
static unsigned __float_as_uint(float a) { return bits_as<unsigned>(a); }
static double __longlong_as_double(long long a) { return bits_as<double>(a); }
static long long __double_as_longlong(double a) { return bits_as<long long>(a); }
static int __float_as_int(float a) { return bits_as<int>(a); }
static float __uint_as_float(unsigned a) { return bits_as<float>(a); }
static float __int_as_float(int a) { return bits_as<float>(a); }
static float __fmul_rn(float a, float b) { return a * b; }
static float __fmaf_rn(float a, float b, float c) { return std::fma(a, b, c); }

using std::fma;
using std::fmin;
static unsigned min(unsigned a, unsigned b) { return a < b ? a : b; }
static unsigned max(unsigned a, unsigned b) { return a > b ? a : b; }
static int min(int a, int b) { return a < b ? a : b; }
static int max(int a, int b) { return a > b ? a : b; }
static unsigned min(unsigned a, int b) { return min(a, (unsigned)b); }
static unsigned max(unsigned a, int b) { return max(a, (unsigned)b); }

static void __threadfence() { __atomic_thread_fence(__ATOMIC_SEQ_CST); }

template <typename T> static T atomicAdd(T* address, T value) { return __atomic_fetch_add(address, value, __ATOMIC_RELAXED); }
template <typename T> static T atomicOr(T* address, T value) { return __atomic_fetch_or(address, value, __ATOMIC_RELAXED); }
template <typename T> static T atomicExch(T* address, T value) { return __atomic_exchange_n(address, value, __ATOMIC_RELAXED); }

template <typename T, typename Better> static T atomic_replace(T* address, T value, Better better) {
    T before = __atomic_load_n(address, __ATOMIC_RELAXED);
    while (better(value, before) && !__atomic_compare_exchange_n(address, &before, value, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
    return before;
}

template <typename T> static T atomicMin(T* address, T value) {
    return atomic_replace(address, value, [](T a, T b) { return a < b; });
}

template <typename T> static T atomicMax(T* address, T value) {
    return atomic_replace(address, value, [](T a, T b) { return a > b; });
}

// In place of `shared/ptx.cuh`.

static float root_inverse_rough(float a) { return (float)(1.0 / std::sqrt((double)a)); }
static float inverse_rough(float a) { return (float)(1.0 / (double)a); }

static unsigned long long load_acquire(const unsigned long long* address) {
    unsigned long long value = __atomic_load_n(address, __ATOMIC_ACQUIRE);
    yield_to_block();
    return value;
}

static void store_release(unsigned long long* address, unsigned long long value) { __atomic_store_n(address, value, __ATOMIC_RELEASE); }

static unsigned long long add_release(unsigned long long* address, unsigned long long value) {
    return __atomic_fetch_add(address, value, __ATOMIC_ACQ_REL);
}

static std::mutex pair_mutex;

static void pair_store(void* address, unsigned long long low, unsigned long long high) {
    std::lock_guard<std::mutex> guard(pair_mutex);
    unsigned long long* words = (unsigned long long*)address;
    words[0] = low;
    words[1] = high;
}

static void pair_load(const void* address, unsigned long long& low, unsigned long long& high) {
    {
        std::lock_guard<std::mutex> guard(pair_mutex);
        const unsigned long long* words = (const unsigned long long*)address;
        low = words[0];
        high = words[1];
    }
    yield_to_block();
}

static void copy_start(const Copy& copy) {
    if (block->is_shuffled) {
        block->present().copies.push_back(copy);
    } else {
        memcpy(copy.to, copy.from, copy.bytes);
    }
}

static void copy_start_16(void* to, const void* from) { copy_start({to, from, 16}); }
static void copy_start_8(void* to, const void* from) { copy_start({to, from, 8}); }

static void copies_wait() {
    for (const Copy& copy : block->present().copies) memcpy(copy.to, copy.from, copy.bytes);
    block->present().copies.clear();
}

// What a thread of the kernel that is being run does.
static void (*kernel)();

static void fiber_run() {
    kernel();
    block->present().is_done = true;
    unsigned next = block->other();
    if (block->fibers[next].is_done) _longjmp(block->outside, 1);
    block->enter(next);
}

static void block_run(unsigned number, unsigned blocks, unsigned threads, unsigned seed) {
    Block own;
    block = &own;
    own.fibers = std::vector<Fiber>(threads);
    own.warps = std::vector<Warp>(threads / 32);
    own.is_shuffled = seed > 0;
    own.lot.seed(seed + number);
    // Nothing may be read from there that was not written before.
    memset(frame_memory, 0xff, sizeof frame_memory);
    blockIdx.x = number;
    blockDim.x = threads;
    gridDim.x = blocks;
    for (Fiber& fiber : own.fibers) {
        // Without touching it: most of it stays unused.
        fiber.stack.reset(new char[Fiber::STACK]);
        getcontext(&fiber.beginning);
        fiber.beginning.uc_stack.ss_sp = fiber.stack.get();
        fiber.beginning.uc_stack.ss_size = Fiber::STACK;
        makecontext(&fiber.beginning, fiber_run, 0);
    }
    if (_setjmp(own.outside) == 0) own.enter(0);
}

// A cooperative launch. With a seed of 0 threads run one after the other as far as they can.
static void launch(void (*of_thread)(), unsigned blocks, unsigned threads, unsigned seed) {
    kernel = of_thread;
    std::vector<std::thread> running;
    for (unsigned number = 0; number < blocks; number++) running.emplace_back(block_run, number, blocks, threads, seed);
    for (std::thread& thread : running) thread.join();
}
