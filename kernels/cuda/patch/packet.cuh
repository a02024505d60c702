// What blocks of a small patch send each other: words of 16 bytes that are stored and loaded whole, and that carry the number of the
// substep. Who waits for one has it as soon as it sees the number, and nothing else has to be waited for.

__device__ __forceinline__ void packet_send(uint4* to, const vec3& a, uint number) {
    ulong low = (ulong)__float_as_uint(a.y) << 32 | __float_as_uint(a.x);
    ulong high = (ulong)number << 32 | __float_as_uint(a.z);
    pair_store(to, low, high);
}

// Two packets on their way to a thread.
struct Coming {
    ulong words[4];

    __device__ __forceinline__ void ask(const uint4* first, const uint4* second) {
        pair_load(first, words[0], words[1]);
        pair_load(second, words[2], words[3]);
    }
    // Waits until they are those of a substep, by the bits of a mask of its number; gives what they carry.
    __device__ __forceinline__ void wait(const uint4* first, const uint4* second, uint number, vec3& a, vec3& b, uint mask = 0xffffffffu) {
        while ((((uint)(words[1] >> 32) ^ number) | ((uint)(words[3] >> 32) ^ number)) & mask) ask(first, second);
        a = {__uint_as_float((uint)words[0]), __uint_as_float((uint)(words[0] >> 32)), __uint_as_float((uint)words[1])};
        b = {__uint_as_float((uint)words[2]), __uint_as_float((uint)(words[2] >> 32)), __uint_as_float((uint)words[3])};
    }
};

__device__ __forceinline__ void packets_wait(const uint4* first, const uint4* second, uint number, vec3& a, vec3& b) {
    Coming coming;
    coming.ask(first, second);
    coming.wait(first, second, number, a, b);
}

// Entry `number` of those around the tile: rows before it, after it, and what is beside it.
__device__ __forceinline__ void surrounding_entry(uint number, uint& row, uint& column) {
    const uint before = HALO * TILE_WIDTH;
    if (number < 2 * before) {
        row = number / TILE_WIDTH + (number < before ? 0 : TILE_ROWS);
        column = number % TILE_WIDTH;
    } else {
        uint beside = number - 2 * before;
        row = HALO + beside / (2 * HALO);
        column = beside % (2 * HALO);
        if (column >= HALO) column += TILE_COLUMNS;
    }
}

#define SURROUNDING (TILE_WIDTH * TILE_HEIGHT - TILE_COLUMNS * TILE_ROWS)
