// NUMERICS section 5, `preconditioner_build` of `schwarz`: diagonal blocks, rigid modes and coarse matrix of groups of particles, each
// sum in the order of `cloth_core::schwarz`. The levels above are those of a matrix that is smaller by a hundred, and the host's.

// What the kernels make.
struct SchwarzBuild {
    // For each particle D, nine numbers.
    double* diagonals;
    // For each group its centre, and the unknowns of rigid motions, R^-T G.
    double* centres;
    double* unknowns;
    // Rows of the coarse matrix, of both triangles: starts, columns and blocks, row by row and column by column.
    const uint* rows;
    const uint* columns;
    double* blocks;
    double* turned;
    ulong group_count;
};

static_assert(sizeof(SchwarzBuild) == 64, "`schwarz.rs` of the backend has another layout");

struct Block3 {
    double entries[3][3];
};

__device__ __forceinline__ Block3 block_symmetric(double xx, double yy, double zz, double xy, double xz, double yz) {
    return {{{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}}};
}

__device__ __forceinline__ Block3 block_symmetric(const real* m) { return block_symmetric(m[0], m[1], m[2], m[3], m[4], m[5]); }

// -(g I + u u^T).
__device__ __forceinline__ Block3 block_rank_one(const vec3& u, real g) {
    double v[3] = {u.x, u.y, u.z};
    Block3 block;
    for (uint r = 0; r < 3; r++)
        for (uint c = 0; c < 3; c++) block.entries[r][c] = -(v[r] * v[c] + (r == c ? (double)g : 0.0));
    return block;
}

// The blocks of springs in row i.
template <typename Visit> __device__ __forceinline__ void springs_visit(const Solver& s, const Linear& l, uint i, Visit visit) {
    SpringRow row = spring_row(s, i);
    vec3 origin = row.count > 0 ? xyz(l.origin[i]) : vec3{0, 0, 0};
    for (uint k = 0; k < row.count; k++) {
        uint at = row.first + (k << row.shift);
        uint2 link = l.links[at];
        uint j = i + link.x;
        SpringBlock spring = spring_block(l, at, factor_place(s, l, link.y, i, j), xyz(l.origin[j]) - origin);
        visit(j, block_rank_one(spring.u, spring.g));
    }
}

// The block of triangles at an entry of row i.
__device__ __forceinline__ Block3 element_block(const Linear& l, uint entry, uint i) {
    const real* numbers = l.element_blocks + element_place(entry, i);
    Block3 block;
    for (uint k = 0; k < 9; k++) block.entries[k / 3][k % 3] = numbers[k * SLICE];
    return block;
}

// The blocks of triangles in row i.
template <typename Visit> __device__ __forceinline__ void elements_visit(const Linear& l, uint i, Visit visit) {
    if (!l.has_elements) return;
    uint end = l.element_slices[i / SLICE + 1];
    for (uint entry = l.element_slices[i / SLICE]; entry < end; entry++) {
        uint j = l.element_columns[entry * SLICE + i % SLICE];
        if (j == NONE) break;
        visit(j, element_block(l, entry, i));
    }
}

// The blocks of contacts in row i: of points, of triangles.
template <typename Visit> __device__ __forceinline__ void contacts_visit(const Solver& s, const Linear& l, uint i, Visit visit) {
    if (l.has_pairs) {
        uint count = l.pair_counts[i];
        for (uint k = 0; k < count; k++) {
            vec3 u = xyz(l.pair_factors[(size_t)k * s.count + i]);
            visit(l.pair_partners[(size_t)k * s.count + i], block_rank_one(u, 0));
        }
    }
    if (l.has_contacts) {
        for (uint k = l.contacts.offsets[i], end = l.contacts.offsets[i + 1]; k < end; k++) {
            const TriangleContact& contact = l.contacts.contacts[l.contacts.places[k] / 4];
            real weight = contact.weights[l.contacts.places[k] % 4];
            for (uint other = 0; other < 4; other++) {
                if (contact.particles[other] == i || contact.weights[other] == 0) continue;
                real factor = weight * contact.weights[other], scaled[6];
                for (uint entry = 0; entry < 6; entry++) scaled[entry] = factor * contact.rows[entry];
                visit(contact.particles[other], block_symmetric(scaled));
            }
        }
    }
}

// The blocks off the diagonal of row i, in their order.
template <typename Visit> __device__ __forceinline__ void row_visit(const Solver& s, const Linear& l, uint i, Visit visit) {
    springs_visit(s, l, i, visit);
    elements_visit(l, i, visit);
    contacts_visit(s, l, i, visit);
}

// B of a particle: all that does not act between particles.
__device__ __forceinline__ Block3 base_block(const Solver& s, const Linear& l, uint i) {
    real4 on = l.base[0][i], off = {0, 0, 0, 0};
    if (l.is_full) off = l.base[1][i];
    Block3 base = block_symmetric(on.x, on.y, on.z, off.x, off.y, off.z);
    real sums[6] = {0, 0, 0, 0, 0, 0};
    if (l.has_contacts) {
        for (uint k = l.contacts.offsets[i], end = l.contacts.offsets[i + 1]; k < end; k++) {
            const TriangleContact& contact = l.contacts.contacts[l.contacts.places[k] / 4];
            const real* w = contact.weights;
            real factor = w[l.contacts.places[k] % 4] * (real)round((double)w[0] + (double)w[1] + (double)w[2] + (double)w[3]);
            for (uint entry = 0; entry < 6; entry++) sums[entry] += factor * contact.rows[entry];
        }
    }
    Block3 of_bodies = block_symmetric(sums);
    for (uint k = 0; k < 9; k++) base.entries[k / 3][k % 3] += of_bodies.entries[k / 3][k % 3];
    return base;
}

// Whether a particle has a filter that is not the identity, and which.
__device__ __forceinline__ bool filter_of(const Solver& s, const Linear& l, uint i, Block3& filter) {
    if (!(s.position[s.present][i].w > 0)) {
        filter = {};
        return true;
    }
    if (!(l.has_constraints && l.touch_counts[i] > 0)) return false;
    real4 on = l.filter[0][i], off = l.filter[1][i];
    filter = block_symmetric(on.x, on.y, on.z, off.x, off.y, off.z);
    return true;
}

// D of every particle: what the blocks of its row take, it has.
extern "C" __global__ void schwarz_diagonals(const __grid_constant__ Solver s, const __grid_constant__ Linear l, const __grid_constant__ SchwarzBuild b) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    Block3 diagonal = base_block(s, l, i);
    row_visit(s, l, i, [&](uint, const Block3& block) {
        for (uint r = 0; r < 3; r++)
            for (uint c = 0; c < 3; c++) diagonal.entries[r][c] -= 0.5 * (block.entries[r][c] + block.entries[c][r]);
    });
    for (uint k = 0; k < 9; k++) b.diagonals[9 * (size_t)i + k] = diagonal.entries[k / 3][k % 3];
}

// How rigid motions about a centre move a point at (x, y, z) from it, and the filter what is left of that.
__device__ __forceinline__ void motion_of(const Solver& s, const Linear& l, uint i, const double* centre, double (&motion)[3][6]) {
    real4 place = s.position[s.present][i];
    double x = (double)place.x - centre[0], y = (double)place.y - centre[1], z = (double)place.z - centre[2];
    double free[3][6] = {{1, 0, 0, 0, z, -y}, {0, 1, 0, -z, 0, x}, {0, 0, 1, y, -x, 0}};
    Block3 filter;
    bool is_filtered = filter_of(s, l, i, filter);
    for (uint r = 0; r < 3; r++) {
        for (uint k = 0; k < 6; k++) {
            double sum = free[r][k];
            if (is_filtered) {
                sum = 0;
                for (uint axis = 0; axis < 3; axis++) sum = sum + filter.entries[r][axis] * free[axis][k];
            }
            motion[r][k] = sum;
        }
    }
}

#define RANK_MIN 1e-6

// R^-1 and R^-T G of a Gram matrix G = R^T R, translations first; columns of modes that are left out are zero.
__device__ void modes_find(const double (&gram)[6][6], double (&motions)[6][6], double* unknowns) {
    double factor[6][6] = {}, largest[2] = {0, 0};
    for (uint k = 0; k < 6; k++) largest[k / 3] = fmax(largest[k / 3], gram[k][k]);
    for (uint k = 0; k < 6; k++) {
        double pivot = gram[k][k];
        for (uint j = 0; j < k; j++) {
            if (factor[j][j] == 0) continue;
            double entry = gram[j][k];
            for (uint row = 0; row < j; row++) entry -= factor[row][j] * factor[row][k];
            entry /= factor[j][j];
            factor[j][k] = entry;
            pivot -= entry * entry;
        }
        if (pivot > RANK_MIN * largest[k / 3]) {
            factor[k][k] = sqrt(pivot);
        } else {
            for (uint row = 0; row < 6; row++) factor[row][k] = 0;
        }
    }
    for (uint k = 0; k < 36; k++) motions[k / 6][k % 6] = 0;
    for (uint k = 0; k < 6; k++) {
        if (factor[k][k] == 0) continue;
        motions[k][k] = 1.0 / factor[k][k];
        for (uint j = k; j-- > 0;) {
            if (factor[j][j] == 0) continue;
            // As a sum of floating-point numbers begins.
            double sum = -0.0;
            for (uint i = j + 1; i <= k; i++) sum += factor[j][i] * motions[i][k];
            motions[j][k] = -sum / factor[j][j];
        }
    }
    for (uint r = 0; r < 6; r++) {
        for (uint c = 0; c < 6; c++) {
            double sum = 0;
            for (uint k = 0; k < 6; k++) sum += motions[k][r] * gram[k][c];
            unknowns[6 * r + c] = sum;
        }
    }
}

// The rigid modes of a group, by one thread.
extern "C" __global__ void schwarz_modes(const __grid_constant__ Solver s, const __grid_constant__ Linear l, const __grid_constant__ SchwarzBuild b) {
    uint group = blockIdx.x * blockDim.x + threadIdx.x;
    if (group >= b.group_count) return;
    const Schwarz& p = *l.schwarz;
    uint first = p.group_starts[group], end = p.group_starts[group + 1];
    double centre[3] = {0, 0, 0}, count = 0;
    for (uint place = first; place < end; place++) {
        real4 x = s.position[s.present][p.order[place]];
        centre[0] += (double)x.x;
        centre[1] += (double)x.y;
        centre[2] += (double)x.z;
        count += 1;
    }
    for (uint axis = 0; axis < 3; axis++) b.centres[3 * (size_t)group + axis] = centre[axis] = centre[axis] / count;
    double gram[6][6] = {}, motion[3][6], motions[6][6];
    for (uint place = first; place < end; place++) {
        motion_of(s, l, p.order[place], centre, motion);
        for (uint axis = 0; axis < 3; axis++)
            for (uint k = 0; k < 36; k++) gram[k / 6][k % 6] += motion[axis][k / 6] * motion[axis][k % 6];
    }
    modes_find(gram, motions, b.unknowns + 36 * (size_t)group);
    for (uint place = first; place < end; place++) {
        motion_of(s, l, p.order[place], centre, motion);
        float* out = (float*)p.prolongation + 18 * (size_t)place;
        for (uint axis = 0; axis < 3; axis++) {
            double row[6] = {};
            for (uint k = 0; k < 6; k++)
                for (uint c = 0; c < 6; c++) row[c] += motion[axis][k] * motions[k][c];
            for (uint c = 0; c < 6; c++) out[6 * axis + c] = (float)row[c];
        }
    }
}

// Where the block of a row and a column is.
__device__ __forceinline__ uint block_find(const SchwarzBuild& b, uint row, uint column) {
    uint first = b.rows[row], last = b.rows[row + 1];
    while (first < last) {
        uint middle = (first + last) / 2;
        if (b.columns[middle] < column) {
            first = middle + 1;
        } else {
            last = middle;
        }
    }
    return first;
}

#define COARSE_THREADS 128
// Blocks of a row that are summed up in shared memory; those beyond stand where they belong.
#define COARSE_NEAR 16

// A row of P^T A P, by one warp, two entries of each block for the first four lanes. What a particle is coupled with is looked up by all lanes at once, an entry of
// its row each.
extern "C" __global__ void __launch_bounds__(COARSE_THREADS) schwarz_coarse(const __grid_constant__ Solver s, const __grid_constant__ Linear l, const __grid_constant__ SchwarzBuild b) {
    __shared__ double shared[COARSE_THREADS / WARP][COARSE_NEAR][36];
    uint group = (blockIdx.x * blockDim.x + threadIdx.x) / WARP, lane = threadIdx.x % WARP;
    if (group >= b.group_count) return;
    const Schwarz& p = *l.schwarz;
    double(*near)[36] = shared[threadIdx.x / WARP];
    // Those left of the diagonal are written by the rows of their columns.
    uint first = block_find(b, group, group), blocks = b.rows[group + 1] - first;
    for (uint at = 0; at < blocks; at++) {
        double* to = at < COARSE_NEAR ? near[at] : b.blocks + 36 * (size_t)(first + at);
        for (uint entry = lane; entry < 36; entry += WARP) to[entry] = 0;
    }
    double own[3][6];
    // p^T block q, added to a block of the row.
    auto add = [&](uint place, const Block3& block, const float* q) {
        double* to = place - first < COARSE_NEAR ? near[place - first] : b.blocks + 36 * (size_t)place;
        for (uint entry = lane; entry < 36; entry += WARP) {
            uint r = entry / 6, c = entry % 6;
            double sum = 0;
            for (uint k = 0; k < 3; k++) {
                double image = 0;
                for (uint axis = 0; axis < 3; axis++) image += block.entries[k][axis] * (double)q[6 * axis + c];
                sum += own[k][r] * image;
            }
            to[entry] += sum;
        }
    };
    uint known = NONE, place = 0;
    auto visit = [&](uint j, const Block3& block) {
        uint column = p.group_of[j];
        if (column < group) return;
        if (column != known) {
            known = column;
            place = block_find(b, group, column);
        }
        add(place, block, p.prolongation + 18 * (size_t)p.places[j]);
    };
    for (uint number = p.group_starts[group], end = p.group_starts[group + 1]; number < end; number++) {
        uint i = p.order[number];
        const float* mine = p.prolongation + 18 * (size_t)number;
        for (uint k = 0; k < 18; k++) own[k / 6][k % 6] = (double)mine[k];
        springs_visit(s, l, i, visit);
        if (l.has_elements) {
            uint end = l.element_slices[i / SLICE + 1];
            for (uint start = l.element_slices[i / SLICE]; start < end; start += WARP) {
                uint j = start + lane < end ? l.element_columns[(start + lane) * SLICE + i % SLICE] : NONE, at = NONE, from = 0;
                if (j != NONE && p.group_of[j] >= group) {
                    at = block_find(b, group, p.group_of[j]);
                    from = p.places[j];
                }
                uint wanted = __ballot_sync(ALL_LANES, at != NONE);
                while (wanted != 0) {
                    uint turn = __ffs(wanted) - 1;
                    wanted &= wanted - 1;
                    add(__shfl_sync(ALL_LANES, at, turn), element_block(l, start + turn, i), p.prolongation + 18 * (size_t)__shfl_sync(ALL_LANES, from, turn));
                }
            }
        }
        contacts_visit(s, l, i, visit);
        Block3 diagonal;
        for (uint k = 0; k < 9; k++) diagonal.entries[k / 3][k % 3] = b.diagonals[9 * (size_t)i + k];
        add(first, diagonal, mine);
    }
    for (uint at = 0; at < min(blocks, (uint)COARSE_NEAR); at++)
        for (uint entry = lane; entry < 36; entry += WARP) b.blocks[36 * (size_t)(first + at) + entry] = near[at][entry];
    __syncwarp();
    // The block on the diagonal as symmetric as it is but for rounding; those left of it are the others turned.
    for (uint at = block_find(b, group, group), end = b.rows[group + 1]; at < end; at++) {
        double* block = b.blocks + 36 * (size_t)at;
        uint column = b.columns[at];
        size_t other = column == group ? 0 : block_find(b, column, group);
        double values[2];
        for (uint entry = lane, k = 0; entry < 36; entry += WARP, k++) {
            uint r = entry / 6, c = entry % 6, least = min(r, c), most = max(r, c);
            values[k] = column == group && r != c ? 0.5 * (block[6 * most + least] + block[6 * least + most]) : block[entry];
        }
        __syncwarp();
        for (uint entry = lane, k = 0; entry < 36; entry += WARP, k++) {
            uint turned = 6 * (entry % 6) + entry / 6;
            b.turned[36 * (size_t)at + turned] = values[k];
            if (column == group) {
                block[entry] = values[k];
            } else {
                b.blocks[36 * other + turned] = values[k];
                b.turned[36 * other + entry] = values[k];
            }
        }
        __syncwarp();
    }
}
