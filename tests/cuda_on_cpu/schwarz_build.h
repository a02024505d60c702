// Builds what groups of particles have in the preconditioner `schwarz`, with the kernels that come before this text: `program INPUT OUTPUT
// BLOCKS SEED`. The input is what `schwarz.rs` writes.

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
static uint list_length = 0;

static uint input_integer() { return input_words.at(input_next++); }

// A list of words, as entries of any type.
template <typename T> static T* input_list() {
    list_length = input_integer();
    T* entries = (T*)calloc(list_length + 4, sizeof(uint));
    memcpy(entries, input_words.data() + input_next, list_length * sizeof(uint));
    input_next += list_length;
    return entries;
}

template <typename T> static T* zeros(size_t count) { return (T*)calloc(count + 1, sizeof(T)); }

static Solver s = {};
static Linear l = {};
static SchwarzBuild b = {};

int main(int, char** arguments) {
    FILE* file = fopen(arguments[1], "rb");
    uint word;
    while (file && fread(&word, sizeof word, 1, file) == 1) input_words.push_back(word);
    if (file) fclose(file);
    uint seed = atoi(arguments[4]);
    Schwarz p = {};
    s.count = input_integer();
    input_integer();
    p.order = input_list<uint>();
    p.group_starts = input_list<uint>();
    p.group_count = list_length - 1;
    p.places = input_list<uint>();
    p.group_of = input_list<uint>();
    b.rows = input_list<uint>();
    b.columns = input_list<uint>();
    uint blocks = list_length;
    l.pair_partners = input_list<uint>();
    l.pair_factors = input_list<real4>();
    l.pair_counts = input_list<uint>();
    l.base[0] = input_list<real4>();
    s.position[0] = input_list<real4>();
    l.touch_counts = input_list<uint>();
    l.filter[0] = input_list<real4>();
    l.filter[1] = input_list<real4>();
    l.has_pairs = l.has_constraints = 1;
    // No springs.
    s.spring_row = zeros<uint>(s.count);
    s.spring_headers = zeros<uint2>(1);
    p.prolongation = zeros<float>(18 * s.count);
    l.schwarz = &p;
    b.diagonals = zeros<double>(9 * s.count);
    b.centres = zeros<double>(3 * p.group_count);
    b.unknowns = zeros<double>(36 * p.group_count);
    b.blocks = zeros<double>(36 * blocks);
    b.turned = zeros<double>(36 * blocks);
    b.group_count = p.group_count;
    launch_over(s.count, [] { schwarz_diagonals(s, l, b); });
    launch_over(p.group_count, [] { schwarz_modes(s, l, b); });
    launch([] { schwarz_coarse(s, l, b); }, (p.group_count + 1) / 2, 64, seed);
    file = fopen(arguments[2], "wb");
    if (!file) return 2;
    fwrite(p.prolongation, sizeof(float), 18 * s.count, file);
    fwrite(b.blocks, sizeof(double), 36 * (size_t)blocks, file);
    fwrite(b.turned, sizeof(double), 36 * (size_t)blocks, file);
    return fclose(file) == 0 ? 0 : 2;
}
