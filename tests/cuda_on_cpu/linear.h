// Assembles the implicit system of a patch of fabric and multiplies its right-hand side by the matrix, with the kernels that come before this
// text: `program INPUT OUTPUT`. The input is what `linear.rs` writes; the output has the right-hand side and the product.

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
static float input_number() { return bits_as<float>(input_integer()); }

template <typename T> static T* zeros(size_t count) { return (T*)calloc(count + 1, sizeof(T)); }

static uint list_length = 0;

static uint* input_list() {
    list_length = input_integer();
    uint* words = zeros<uint>(list_length);
    for (uint k = 0; k < list_length; k++) words[k] = input_integer();
    return words;
}

static Solver s = {};
static Linear l = {};

int main(int, char** arguments) {
    FILE* file = fopen(arguments[1], "rb");
    uint word;
    while (file && fread(&word, sizeof word, 1, file) == 1) input_words.push_back(word);
    if (file) fclose(file);
    s.count = input_integer();
    uint from_start = input_integer();
    uint seed = input_integer();
    l.length = input_number();
    for (real& a : s.acceleration) a = input_number();
    s.fabric_laws = (const FabricLaw*)input_list();
    s.membranes = (const MembraneTriangle*)input_list();
    s.element_count = list_length * sizeof(uint) / sizeof(MembraneTriangle);
    s.plates = (const real*)input_list();
    s.membrane_rows = input_list();
    s.membrane_entries = input_list();
    s.fold_particles = (const uint4*)input_list();
    s.fold_angles = (const real*)input_list();
    s.fold_count = list_length;
    s.patch_folds = input_list();
    s.moment_places = input_list();
    s.fold_rows = input_list();
    s.fold_entries = input_list();
    s.membrane_forces = zeros<real4>(3 * (size_t)s.element_count);
    s.bending_forces = zeros<real4>(4 * (size_t)s.fold_count);
    s.fold_states = zeros<real2>(s.fold_count + 1);
    s.fold_apexes = zeros<real4>(2 * ((size_t)s.fold_count + 1));
    s.fold_moments = zeros<real>(PATCH_FOLDS * (size_t)s.element_count + 1);
    l.element_slices = input_list();
    l.element_columns = input_list();
    uint places = list_length;
    l.element_blocks = zeros<real>(9 * (size_t)places);
    l.fold_stiffness = (const real2*)input_list();
    l.term_offsets = input_list();
    l.terms = input_list();
    s.position[0] = (real4*)input_list();
    s.velocity[0] = (real4*)input_list();
    s.kept_velocity = (real4*)input_list();
    l.contacts.offsets = input_list();
    l.contacts.places = input_list();
    l.contacts.place_count = list_length;
    l.contacts.terms = zeros<real4>(list_length);
    l.contacts.contacts = (const TriangleContact*)input_list();
    l.has_contacts = list_length > 0;
    l.contacts.count = list_length * sizeof(uint) / sizeof(TriangleContact);
    l.contacts.ranks = zeros<uint>(4 * (size_t)l.contacts.count);
    s.force = zeros<real4>(s.count);
    // No springs.
    s.spring_row = zeros<uint>(s.count);
    s.spring_headers = zeros<uint2>(1);
    l.along = zeros<real>(1);
    l.roots = zeros<real>(1);
    l.has_elements = l.is_full = 1;
    l.origin = s.position[0];
    l.membrane_tangents = zeros<MembraneTangent>(s.element_count);
    l.fold_tangents = zeros<real4>(4 * (size_t)s.fold_count);
    for (uint k = 0; k < 2; k++) {
        l.base[k] = zeros<real4>(s.count);
        l.diagonal[k] = zeros<real4>(s.count);
    }
    for (real4*& vector : l.vectors) vector = zeros<real4>(s.count);
    for (uint i = 0; i < s.count; i++) s.force[i] = with_w(field_force(s, s.velocity[0][i].w, xyz(s.velocity[0][i])), 0);
    if (l.has_contacts) launch_over(s.count, [&] { contact_forces_triangles(s, l.contacts); });
    launch_over(s.element_count, [&] { membrane_linearise(s, l, from_start); });
    launch_over(s.fold_count, [&] { bending_forces_folds(s); });
    launch_over(s.element_count, [&] { bending_forces_moments(s, l.length, l.length, from_start ? l.length * l.length : 0); });
    launch_over(s.fold_count, [&] { bending_forces(s); });
    launch_over(s.fold_count, [&] { bending_linearise(s, l); });
    launch_over(places, [&] { implicit_assemble_fabric(s, l); });
    launch_over(s.count, [&] { implicit_assemble(s, l, !from_start); });
    launch_over(s.count, [&] { matrix_apply(s, l, RIGHT_SIDE, IMAGE); });
    // A solve has the same, or nothing is right.
    launch_over(l.contacts.place_count, [&] { contact_linearise_ranks(s, l.contacts); });
    launch_over(100, [&] { contact_terms(l.contacts, l.vectors[RIGHT_SIDE]); });
    for (uint i = 0; i < s.count; i++) {
        vec3 row = matrix_row<1, true>(s, l, l.vectors[RIGHT_SIDE], i, l.origin[i]), applied = xyz(l.vectors[IMAGE][i]);
        if (row.x != applied.x || row.y != applied.y || row.z != applied.z) l.vectors[IMAGE][i] = {};
    }
    file = fopen(arguments[2], "wb");
    if (!file) return 2;
    fwrite(l.vectors[RIGHT_SIDE], sizeof(real4), s.count, file);
    fwrite(l.vectors[IMAGE], sizeof(real4), s.count, file);
    return fclose(file) == 0 ? 0 : 2;
}
