// Rows of the matrix of a patch in which every particle is joined to the 24 around it. A block works on a tile, whose origins and
// vectors, with those around it, lie in shared memory. Each thread has some particles below each other, which have most of their
// neighbours in common. What it needs of the springs it asks for all at once, while the tile is on its way.

// How far springs reach.
#define PATCH_REACH 2
#define PATCH_SIDE (2 * PATCH_REACH + 1)

template <uint THREADS, uint WIDTH, uint OWN> struct PatchTile {
    static constexpr uint HEIGHT = THREADS / WIDTH * OWN;
    static constexpr uint ACROSS = WIDTH + 2 * PATCH_REACH;
    static constexpr uint DOWN = HEIGHT + 2 * PATCH_REACH;
    static constexpr uint TURNS = (ACROSS * DOWN + THREADS - 1) / THREADS;

    // Row by row.
    real4* origin;
    real4* vector;
    // The first particle of this thread: place in the tile, row and column in the patch.
    uint place;
    uint row, column;
    // The first row and column of the tile, those around it included; may be before those of the patch.
    uint top, left;
    // Of the springs of each particle, to those around it.
    real roots[OWN][PATCH_SIDE][PATCH_SIDE];

    __device__ __forceinline__ PatchTile(real4* memory, const Solver& s, uint tile) {
        origin = memory;
        vector = origin + ACROSS * DOWN;
        uint tiles_across = (s.columns + WIDTH - 1) / WIDTH;
        uint x = threadIdx.x % WIDTH, y = threadIdx.x / WIDTH * OWN;
        place = (y + PATCH_REACH) * ACROSS + x + PATCH_REACH;
        row = tile / tiles_across * HEIGHT + y;
        column = tile % tiles_across * WIDTH + x;
        top = row - y - PATCH_REACH;
        left = column - x - PATCH_REACH;
    }

    static __device__ __forceinline__ uint count(const Solver& s) {
        return ((s.columns + WIDTH - 1) / WIDTH) * ((s.rows + HEIGHT - 1) / HEIGHT);
    }

    __device__ __forceinline__ bool exists(const Solver& s, uint k) const { return row + k < s.rows && column < s.columns; }
    __device__ __forceinline__ uint particle(const Solver& s, uint k) const { return (row + k) * s.columns + column; }

    // Whether the neighbours of all particles of a warp are within the patch.
    __device__ __forceinline__ bool is_inside(const Solver& s) const {
        uint first = column - threadIdx.x % WARP;
        return row >= PATCH_REACH && row + OWN - 1 + PATCH_REACH < s.rows && first >= PATCH_REACH && first + WARP - 1 + PATCH_REACH < s.columns;
    }

    // Calls `visit` with the particle of this thread and the rows and columns from it to a neighbour, for all of them: row by row,
    // as they lie in memory, so that those of each particle are in ascending order. `INSIDE` says that all are within the patch;
    // otherwise the last argument says whether this one is.
    template <bool INSIDE, typename Visit> __device__ __forceinline__ void for_neighbours(const Solver& s, Visit visit) const {
#pragma unroll
        for (int down = -PATCH_REACH; down < (int)OWN + PATCH_REACH; down++) {
#pragma unroll
            for (int across = -PATCH_REACH; across <= PATCH_REACH; across++) {
                bool is_there = INSIDE || (row + down < s.rows && column + across < s.columns);
#pragma unroll
                for (int k = 0; k < (int)OWN; k++) {
                    int rows = down - k;
                    if (rows < -PATCH_REACH || rows > PATCH_REACH || (rows == 0 && across == 0)) continue;
                    visit(k, rows, across, is_there);
                }
            }
        }
    }

    // Whether a neighbour comes after the particle. Springs are kept with the earlier of their ends.
    static __device__ __forceinline__ bool is_later(int rows, int across) { return rows > 0 || (rows == 0 && across > 0); }

    static __device__ __forceinline__ int slot_of(int rows, int across) {
        int down = is_later(rows, across) ? rows : -rows, side = is_later(rows, across) ? across : -across;
        return down == 0 ? side - 1 : PATCH_SIDE * down - 1 + side;
    }

    template <bool INSIDE> __device__ __forceinline__ void roots_load(const Solver& s, const Linear& l) {
        uint first = particle(s, 0);
        for_neighbours<INSIDE>(s, [&](int k, int rows, int across, bool is_there) {
            uint at = first + k * s.columns + (is_later(rows, across) ? 0 : rows * s.columns + across);
            if (!is_there) at = first;
            roots[k][rows + PATCH_REACH][across + PATCH_REACH] = __ldg(l.roots + (size_t)slot_of(rows, across) * s.count + at);
        });
    }

    // Brings origins, and vectors as `value` gives them, into shared memory, and the roots into registers.
    template <typename Value> __device__ __forceinline__ void fill(const Solver& s, const Linear& l, Value value) {
        real4 origins[TURNS], vectors[TURNS];
#pragma unroll
        for (uint turn = 0; turn < TURNS; turn++) {
            uint at = threadIdx.x + turn * THREADS;
            uint r = top + at / ACROSS, c = left + at % ACROSS;
            origins[turn] = vectors[turn] = {0, 0, 0, 0};
            if (at < ACROSS * DOWN && r < s.rows && c < s.columns) {
                uint j = r * s.columns + c;
                origins[turn] = l.origin[j];
                vectors[turn] = value(j);
            }
        }
        if (exists(s, 0)) {
            if (is_inside(s)) {
                roots_load<true>(s, l);
            } else {
                roots_load<false>(s, l);
            }
        }
#pragma unroll
        for (uint turn = 0; turn < TURNS; turn++) {
            uint at = threadIdx.x + turn * THREADS;
            if (at < ACROSS * DOWN) {
                origin[at] = origins[turn];
                vector[at] = vectors[turn];
            }
        }
    }

    // Adds the springs of the particles of this thread.
    template <bool INSIDE>
    __device__ __forceinline__ void springs_add(const Solver& s, const Linear& l, vec3 (&sums)[OWN]) const {
        for_neighbours<INSIDE>(s, [&](int k, int rows, int across, bool is_there) {
            int own = place + k * ACROSS, other = own + rows * (int)ACROSS + across;
            vec3 u = roots[k][rows + PATCH_REACH][across + PATCH_REACH] * (xyz(origin[other]) - xyz(origin[own]));
            vec3 sum = sums[k];
            spring_add(sum, {u, across_of(l.stencil[slot_of(rows, across)], u)}, xyz(vector[own]) - xyz(vector[other]));
            if (is_there) sums[k] = sum;
        });
    }

    // Calls `visit` for each particle of this thread with its vector and its row of the matrix times the vectors.
    template <typename Value, typename Visit>
    __device__ __forceinline__ void for_rows(const Solver& s, const Linear& l, Value value, Visit visit) const {
        if (!exists(s, 0)) return;
        vec3 sums[OWN];
#pragma unroll
        for (uint k = 0; k < OWN; k++) {
            vec3 off = {0, 0, 0};
            sums[k] = off;
            if (!exists(s, k)) continue;
            uint i = particle(s, k);
            if (l.is_full) off = xyz(l.base[1][i]);
            sums[k] = base_apply(xyz(l.base[0][i]), off, l.is_full, xyz(vector[place + k * ACROSS]));
        }
        if (is_inside(s)) {
            springs_add<true>(s, l, sums);
        } else {
            springs_add<false>(s, l, sums);
        }
#pragma unroll
        for (uint k = 0; k < OWN; k++) {
            if (!exists(s, k)) continue;
            uint i = particle(s, k);
            real4 own = vector[place + k * ACROSS];
            if (l.has_pairs) pairs_add<1>(s, l, i, xyz(own), value, sums[k]);
            visit(i, origin[place + k * ACROSS].w > 0, own, sums[k]);
        }
    }
};
