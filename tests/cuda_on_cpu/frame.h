// Runs frames of a patch with the kernel that comes before this text: `program INPUT OUTPUT BLOCKS THREADS SEED`. The input is
// what `scene.rs` writes; the output has position and inverse mass, then velocity and mass, of every particle.

struct Input {
    std::vector<uint> words;
    size_t next = 0;

    explicit Input(const char* path) {
        FILE* file = fopen(path, "rb");
        uint word;
        while (file && fread(&word, sizeof word, 1, file) == 1) words.push_back(word);
        if (file) fclose(file);
    }
    uint integer() { return words.at(next++); }
    float number() { return bits_as<float>(integer()); }
    void numbers(float* to, uint count) {
        for (uint k = 0; k < count; k++) to[k] = number();
    }
};

// Memory of the device, which stays until the program ends.
template <typename T> static T* device(size_t count) { return (T*)calloc(count + 1, sizeof(T)); }

// The springs of particle i to its neighbours, in ascending order; none in fabric.
static void springs_describe(Solver& s, const real4* kinds, bool is_fabric) {
    uint* rows = device<uint>(s.count);
    uint2* headers = device<uint2>(s.count);
    uint2* entries = device<uint2>(2 * STENCIL_KINDS * (size_t)s.count);
    uint* packed = device<uint>(2 * STENCIL_KINDS * (size_t)s.count);
    uint end = 0;
    for (uint i = 0; i < s.count; i++) {
        rows[i] = i;
        headers[i] = {end, 0};
        uint mask = is_fabric ? 0 : stencil_mask(s, i / s.columns, i % s.columns);
        for (uint k = 0; k < 2 * STENCIL_KINDS; k++) {
            if (!(mask >> k & 1)) continue;
            uint kind = k < STENCIL_KINDS ? STENCIL_KINDS - 1 - k : k - STENCIL_KINDS;
            int offset = stencil_rows(kind) * (int)s.columns + stencil_columns(kind);
            if (k < STENCIL_KINDS) offset = -offset;
            entries[end] = {(uint)offset, kind};
            packed[end] = ((uint)offset & 0xffffu) | kind << 16;
            end++;
            headers[i].y++;
        }
    }
    s.spring_row = rows;
    s.spring_headers = headers;
    s.spring_entries = entries;
    s.spring_packed = packed;
    s.spring_kinds = kinds;
    s.header_count = s.count;
    s.entry_count = end;
    s.kind_count = STENCIL_KINDS;
}

// The groups of self-contact: those of the tiles.
static void groups_describe(Solver& s, uint tiles) {
    uint groups = tiles * (TILE_COLUMNS * TILE_ROWS / GROUP), across = (s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS;
    uint* members = device<uint>(groups * GROUP);
    for (uint at = 0; at < groups * GROUP; at++) {
        uint tile = at / (TILE_COLUMNS * TILE_ROWS), warp = at / GROUP % 8, lane = at % GROUP;
        uint column = tile % across * TILE_COLUMNS + warp % 4 * 8 + lane % 8, row = tile / across * TILE_ROWS + warp / 4 * 4 + lane / 8;
        members[at] = column < s.columns && row < s.rows ? row * s.columns + column : NONE;
    }
    s.group_members = members;
    s.group_count = groups;
    for (uint side = 0; side < 2; side++) {
        s.group_positions[side] = device<real4>(groups * GROUP);
        s.group_boxes[side] = device<real4>(2 * groups);
    }
    s.group_regions = device<real4>(2 * groups);
    s.group_capacity = groups;
    s.group_rows = device<uint>((size_t)groups * groups);
    s.group_counts = device<uint>(groups);
    s.cell_mask = 4095;
    s.cell_heads = device<ulong>(4096);
    s.cell_nodes = device<uint2>(groups * COVER_MAX);
    s.candidate_capacity = 64;
    s.candidates = device<uint>((size_t)s.count * s.candidate_capacity);
    s.candidate_counts = device<uint>(s.count);
}

// Every block waits for every other.
static void dependencies_describe(Solver& s, uint blocks) {
    uint* rows = device<uint>(blocks + 1);
    uint* others = device<uint>(blocks * blocks);
    for (uint block = 0; block < blocks; block++) {
        rows[block + 1] = rows[block];
        for (uint other = 0; other < blocks; other++) {
            if (other != block) others[rows[block + 1]++] = other;
        }
    }
    s.dependency_rows = rows;
    s.dependencies = others;
    s.progress = device<ulong>(blocks);
}

// The tiles of a patch in which something may touch.
static void tiles_describe(Solver& s, uint tiles) {
    s.tile_boxes = device<real4>(4 * tiles);
    s.tile_flat = device<real4>(3 * tiles);
    s.tile_marks = device<uint>(tiles);
    s.tile_list = device<uint>(tiles);
    s.tile_rough = device<uint2>(tiles);
}

// What `scene.rs` writes of triangles of fabric.
static void fabric_describe(Solver& s, Input& input) {
    uint length = 0;
    auto list = [&] {
        length = input.integer();
        uint* words = device<uint>(length);
        for (uint k = 0; k < length; k++) words[k] = input.integer();
        return words;
    };
    s.fabric_laws = (const FabricLaw*)list();
    s.membranes = (const MembraneTriangle*)list();
    s.element_count = length * sizeof(uint) / sizeof(MembraneTriangle);
    s.plates = (const real*)list();
    s.membrane_rows = list();
    s.membrane_entries = list();
    s.fold_particles = (const uint4*)list();
    s.fold_angles = (const real*)list();
    s.fold_count = length;
    s.patch_folds = list();
    s.moment_places = list();
    s.fold_rows = list();
    s.fold_entries = list();
    s.membrane_forces = device<real4>(3 * (size_t)s.element_count);
    s.bending_forces = device<real4>(4 * (size_t)s.fold_count);
    s.fold_states = device<real2>(s.fold_count + 1);
    s.fold_apexes = device<real4>(2 * ((size_t)s.fold_count + 1));
    s.fold_moments = device<real>(PATCH_FOLDS * (size_t)s.element_count + 1);
}

// What `scene.rs` writes of the strain limit.
static void limits_describe(Solver& s, Input& input, uint blocks) {
    s.limit_sweeps = input.integer();
    if (s.limit_sweeps == 0) return;
    s.limit_colours = input.integer();
    uint length = 0;
    auto list = [&] {
        length = input.integer();
        uint* words = device<uint>(length);
        for (uint k = 0; k < length; k++) words[k] = input.integer();
        return words;
    };
    s.longest = (const real*)list();
    s.limit_regions = (const LimitRegion*)list();
    s.limit_region_count = length / 4;
    for (uint k = 0; k < s.limit_region_count; k++) s.limit_particles_max = max(s.limit_particles_max, s.limit_regions[k].particles);
    for (uint k = 0; k < s.limit_region_count; k++) s.limit_owned_max = max(s.limit_owned_max, s.limit_regions[k].owned);
    s.limit_particles = list();
    s.limit_rows = list();
    // Blocks keep the springs of their regions, as the backend lets them, if each has one at most.
    for (uint k = 0; k < s.limit_region_count && s.limit_region_count <= blocks; k++) {
        const uint* rows = s.limit_rows + k * (s.limit_colours + 1);
        s.limit_springs_near = max(s.limit_springs_near, rows[s.limit_colours] - rows[0]);
    }
    s.limit_springs = (const uint2*)list();
    s.limited_springs = (const uint4*)list();
    s.limited_rows = list();
    s.stretch_triangles = list();
    s.stretch_rows = list();
    s.stretch_colours = length - 1;
    s.stretch_ratio = input.number();
}

static Solver solver;
static uint substep_count;

int main(int, char** arguments) {
    Input input(arguments[1]);
    uint blocks = (uint)atoi(arguments[3]), threads = (uint)atoi(arguments[4]), seed = (uint)atoi(arguments[5]);
    Solver& s = solver;
    s.columns = input.integer();
    s.rows = input.integer();
    s.count = s.columns * s.rows;
    bool is_fabric = input.integer() != 0;
    std::vector<uint> frames(input.integer());
    for (uint& frame : frames) frame = input.integer();
    float time_step = input.number();
    input.numbers(s.acceleration, 3);
    input.numbers(s.drag_rate, 3);
    float offset = input.number();
    real* offsets = device<real>(s.count);
    std::fill(offsets, offsets + s.count, offset);
    s.offsets = offsets;
    real4* kinds = device<real4>(STENCIL_KINDS);
    for (uint kind = 0; kind < STENCIL_KINDS; kind++) {
        input.numbers(s.stencil[kind], 3);
        kinds[kind] = {s.stencil[kind][0], s.stencil[kind][1], s.stencil[kind][2], 0};
    }
    springs_describe(s, kinds, is_fabric);
    Collider* ball = device<Collider>(1);
    ball->shape = SHAPE_SPHERE;
    ball->rotation[0] = ball->rotation[4] = ball->rotation[8] = 1;
    input.numbers(ball->translation, 3);
    ball->size[0] = input.number();
    ball->friction = input.number();
    s.colliders = ball;
    s.collider_count = 1;
    uint tiles = (s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS * ((s.rows + TILE_ROWS - 1) / TILE_ROWS);
    groups_describe(s, tiles);
    tiles_describe(s, tiles);
    s.contact_distance = input.number();
    s.contact_stiffness = input.number();
    s.contact_damping = input.number();
    float recovery = input.number();
    bool impulses = input.integer() != 0;
    if (impulses) {
        s.contact_restitution = s.contact_stiffness;
        s.contact_friction = s.contact_damping;
    }
    s.contact = s.contact_distance > 0 ? impulses ? CONTACT_IMPULSE : CONTACT_PENALTY : 0;
    limits_describe(s, input, blocks);
    if (is_fabric) fabric_describe(s, input);
    s.list_margin = 2 * s.contact_distance;
    s.list_horizon = 12 * time_step;
    s.cells_per_metre = 2;
#ifdef FRAME_KEEPS_FIRST
    const uint sides = 3;
#else
    const uint sides = 2;
#endif
    for (uint side = 0; side < sides; side++) {
        s.position[side] = device<real4>(s.count);
        s.velocity[side] = device<real4>(s.count);
    }
    input.numbers((float*)s.position[0], 4 * s.count);
    input.numbers((float*)s.velocity[0], 4 * s.count);
#ifdef FRAME_OF_STAGES
    s.start_position = device<real4>(s.count);
    real4* rest = device<real4>(s.count);
    input.numbers((float*)rest, 4 * s.count);
    s.rest = rest;
    uint motions = 1 + (impulses ? 1 : 0) + (s.limit_sweeps == 0 ? 0 : s.limit_region_count > 0 ? s.limit_sweeps : 1);
#else
    uint motions = 1;
#endif
    dependencies_describe(s, blocks);
    s.status = device<Status>(1);
    s.status->non_finite_step = ~0ull;
#if defined(FRAME_OF_MESH) || defined(FRAME_OF_STAGES)
    s.chunk = ((s.count + blocks - 1) / blocks + 31) / 32 * 32;
#else
    s.chunk = (tiles + blocks - 1) / blocks;
#endif
    uint tick = 0;
    ulong contacts = 0;
    for (uint frame : frames) {
        SubstepData* substeps = device<SubstepData>(frame);
        for (uint number = 0; number < frame; number++) {
            substeps[number].step = tick;
            substeps[number].tick = ++tick;
            substeps[number].length = time_step;
            substeps[number].recovery = recovery;
        }
        s.substeps = substeps;
        s.status->contacts = s.status->meetings[0] = s.status->meetings[1] = 0;
        substep_count = frame;
        for (uint k = 0; k < 3; k++) s.status->searched[k] = s.status->taken[k] = 0;
        uint first = s.present;
        std::vector<real4> before(s.position[first], s.position[first] + s.count);
        launch([] { explicit_frame(solver, substep_count); }, blocks, threads, seed);
        s.epoch += frame;
        s.present ^= frame * motions & 1;
        if (sides == 3) {
            if (memcmp(before.data(), s.position[first], s.count * sizeof(real4)) != 0) return 4;
            std::swap(s.position[first], s.position[2]);
            std::swap(s.velocity[first], s.velocity[2]);
        }
        contacts += s.status->contacts;
    }
    if (s.status->overflow > 0 || s.status->group_overflow > 0) return 3;
    printf("%llu\n", contacts / 2);
    FILE* file = fopen(arguments[2], "wb");
    if (!file) return 2;
    fwrite(s.position[s.present], sizeof(real4), s.count, file);
    fwrite(s.velocity[s.present], sizeof(real4), s.count, file);
    return fclose(file) == 0 ? 0 : 2;
}
