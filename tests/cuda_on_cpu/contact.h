// Finds pairs of triangles that may touch or meet, with the kernels that come before this text: `program INPUT OUTPUT`. The input is what
// `contact.rs` writes; the output has the list, the pairs that may touch, those that are unproven, the list of marked pairs, those of them that are unproven, a count
// before each, and how far particles have moved.

// A kernel over so many items. Nobody waits for anybody.
template <typename Kernel> static void launch_over(uint items, Kernel kernel) {
    blockDim.x = 64;
    gridDim.x = (items + 63) / 64;
    for (blockIdx.x = 0; blockIdx.x < gridDim.x; blockIdx.x++) {
        for (threadIdx.x = 0; threadIdx.x < 64; threadIdx.x++) kernel();
    }
}

static std::vector<uint> input_words;
static size_t input_next = 0;

static uint input_integer() { return input_words.at(input_next++); }

static real input_number() {
    if (sizeof(real) == 4) return bits_as<float>(input_integer());
    uint64_t low = input_integer(), high = input_integer();
    return (real)bits_as<double>(low | high << 32);
}

template <typename T> static T* zeros(size_t count) { return (T*)calloc(count + 1, sizeof(T)); }

static uint* input_list() {
    uint length = input_integer();
    uint* words = zeros<uint>(length);
    for (uint k = 0; k < length; k++) words[k] = input_integer();
    return words;
}

static real4* input_vectors(uint count) {
    real4* vectors = zeros<real4>(count);
    for (uint k = 0; k < count; k++) vectors[k] = {input_number(), input_number(), input_number(), input_number()};
    return vectors;
}

static Solver s = {};
static TrianglePairs t = {};

static void moved_thread() { contact_pairs_moved(s, t); }
static void tree_thread() { contact_pairs_tree(s, t); }
static void list_thread() { contact_pairs_list(s, t); }
static void tree_top_thread() { contact_pairs_tree_top(s, t); }

// Boxes and the list, of all pairs or of marked ones.
static void list_fill(uint seed) {
    launch_over(t.task.group_count, [] { contact_pairs_boxes(s, t); });
    uint blocks = min(TREE_BLOCKS, t.task.group_count / 2);
    launch(tree_thread, blocks, 64, seed);
    launch(tree_top_thread, 1, 64, seed);
    t.counts[1] = 0;
    launch(list_thread, (SLOTS * SLOTS * t.task.group_count + LIST_THREADS - 1) / LIST_THREADS, LIST_THREADS, seed);
    t.task.pair_count = min(t.counts[1], t.task.pair_capacity - t.task.pair_first);
}

static void pairs_write(FILE* file, const FeaturePair* pairs, uint count) {
    fwrite(&count, sizeof(uint), 1, file);
    fwrite(pairs, sizeof(FeaturePair), count, file);
}

static void unproven_write(FILE* file) {
    t.counts[0] = 0;
    launch_over(t.task.pair_count, [] { contact_certify(s, t); });
    pairs_write(file, t.found, t.counts[0]);
}

int main(int, char** arguments) {
    FILE* file = fopen(arguments[1], "rb");
    uint word;
    while (file && fread(&word, sizeof word, 1, file) == 1) input_words.push_back(word);
    if (file) fclose(file);
    uint seed = input_integer();
    s.count = input_integer();
    t.task.node_count = s.count;
    t.task.group_count = t.task.own_group_count = input_integer();
    t.task.edge_count = input_integer();
    t.task.moved_blocks = input_integer();
    t.task.flags = input_integer();
    t.task.pair_capacity = t.task.found_capacity = input_integer();
    t.task.reach = input_number();
    t.task.length = input_number();
    t.task.delta = input_number();
    t.task.distance = input_number();
    t.surface = input_list();
    s.position[0] = input_vectors(s.count);
    s.velocity[0] = input_vectors(s.count);
    real4* start = input_vectors(s.count);
    s.start_position = start;
    t.ways = zeros<real4>(2 * (size_t)s.count);
    t.references = zeros<real4>(2 * (size_t)s.count);
    t.boxes = zeros<WayBounds>((SLOTS + 2) * (size_t)t.task.group_count);
    t.list = zeros<FeaturePair>(t.task.pair_capacity);
    t.found = zeros<FeaturePair>(t.task.found_capacity);
    t.counts = zeros<uint>(2);
    uint moved = 2 * MOVED_NUMBERS * t.task.moved_blocks;
    t.moved = zeros<real>(moved);

    launch_over(s.count, [] { contact_pairs_ahead(s, t); });
    memcpy(t.references, t.ways, 2 * s.count * sizeof(real4));
    uint flags = t.task.flags;
    t.task.flags &= ~TASK_MARKED;
    list_fill(seed);
    t.task.flags = flags;
    file = fopen(arguments[2], "wb");
    if (!file) return 2;
    pairs_write(file, t.list, t.task.pair_count);
    launch_over(t.task.pair_count, [] { contact_geometry(s, t); });
    pairs_write(file, t.found, t.counts[0]);
    // The way back, whose ends differ from both sets.
    launch_over(s.count, [] { contact_pairs_substep(s, t); });
    for (uint k = 0; k < s.count; k++) t.ways[(size_t)s.count + k].w = k % 3 == 0;
    launch(moved_thread, 2 * t.task.moved_blocks, MOVED_THREADS, seed);
    unproven_write(file);
    // Marked pairs of these ways alone, behind the list.
    t.task.flags |= TASK_MARKED;
    t.task.pair_first = t.task.pair_count;
    t.task.reach = 2 * t.task.delta;
    list_fill(seed);
    pairs_write(file, t.list + t.task.pair_first, t.task.pair_count);
    unproven_write(file);
    for (uint k = 0; k < moved; k++) {
        double number = t.moved[k];
        fwrite(&number, sizeof number, 1, file);
    }
    return fclose(file) == 0 ? 0 : 2;
}
