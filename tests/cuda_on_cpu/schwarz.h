// Applies the preconditioner `schwarz` to a vector, with the kernels that come before this text: `program INPUT OUTPUT BLOCKS SEED`. The
// input is what `schwarz.rs` writes; the output has the vector.

static std::vector<uint> input_words;
static size_t input_next = 0;

static uint input_integer() { return input_words.at(input_next++); }

// A list of words, as entries of any type.
template <typename T> static T* input_list() {
    uint length = input_integer();
    // The factor of a whole block is read from where one starts.
    T* entries = (T*)calloc(length + FACTOR, sizeof(uint));
    memcpy(entries, input_words.data() + input_next, length * sizeof(uint));
    input_next += length;
    return entries;
}

static Solver s = {};
static Linear l = {};

int main(int, char** arguments) {
    FILE* file = fopen(arguments[1], "rb");
    uint word;
    while (file && fread(&word, sizeof word, 1, file) == 1) input_words.push_back(word);
    if (file) fclose(file);
    Schwarz schwarz = {};
    s.count = input_integer();
    schwarz.order = input_list<uint>();
    schwarz.group_starts = input_list<uint>();
    schwarz.places = input_list<uint>();
    schwarz.group_of = input_list<uint>();
    schwarz.prolongation = input_list<float>();
    schwarz.group_count = input_integer();
    schwarz.level_count = input_integer();
    for (uint k = 0; k < schwarz.level_count; k++) {
        SchwarzLevel& level = schwarz.levels[k];
        level.rows = input_list<uint>();
        level.columns = input_list<uint>();
        level.blocks = input_list<double>();
        level.factors = input_list<float>();
        level.scale = input_list<double>();
        level.prolongation = input_list<double>();
        level.groups = input_list<uint>();
        level.group_of = input_list<uint>();
        level.inverse = input_list<double>();
        level.weight = *input_list<double>();
        level.count = input_integer();
        level.group_count = input_integer();
        level.right_side = (double*)calloc(6 * level.count, sizeof(double));
        for (double*& solution : level.solution) solution = (double*)calloc(6 * level.count, sizeof(double));
    }
    l.schwarz = &schwarz;
    s.position[0] = input_list<real4>();
    l.vectors[RESIDUAL] = input_list<real4>();
    l.inverse[0] = input_list<real4>();
    l.inverse[1] = input_list<real4>();
    l.has_blocks = 1;
    l.vectors[PRECONDITIONED] = (real4*)calloc(s.count, sizeof(real4));
    l.partials = (double*)calloc(s.count, sizeof(double));
    Status status = {};
    s.status = &status;
    launch([] { preconditioner_apply_schwarz(s, l, RESIDUAL, PRECONDITIONED); }, atoi(arguments[3]), SOLVER_THREADS, atoi(arguments[4]));
    file = fopen(arguments[2], "wb");
    if (!file) return 2;
    fwrite(l.vectors[PRECONDITIONED], sizeof(real4), s.count, file);
    return fclose(file) == 0 ? 0 : 2;
}
