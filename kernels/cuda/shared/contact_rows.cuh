// NUMERICS section 15: what contacts of triangles do, for forces and for the matrix.

// A contact: its particles and their weights, where nodes of bodies are another particle with weight 0; S (xx, yy, zz, xy, xz, yz); the force on
// its first point; and S sum w_b v_b of the nodes of bodies.
struct TriangleContact {
    uint particles[4];
    real weights[4];
    real rows[6];
    real force[3];
    real carried[3];
};

static_assert(sizeof(TriangleContact) == 16 + 16 * sizeof(real), "`triangle_contact.rs` of the backend has another layout");

// For each particle where its places begin, and the end; the places, 4 c + a for particle a of contact c; the contacts. For each particle of each contact where
// its place is; and a vector for each place, which a solve works out for all rows before it adds them up, or null where rows are short.
struct ContactTable {
    const uint* offsets;
    const uint* places;
    const TriangleContact* contacts;
    uint* ranks;
    real4* terms;
    uint count;
    uint place_count;
};

// S sum w_b v_b, of the vectors of the particles.
__device__ __forceinline__ vec3 contact_times(const TriangleContact& contact, const real4* vectors) {
    vec3 a = xyz(vectors[contact.particles[0]]), b = xyz(vectors[contact.particles[1]]);
    vec3 c = xyz(vectors[contact.particles[2]]), d = xyz(vectors[contact.particles[3]]);
    const real* w = contact.weights;
    vec3 v = ((w[0] * a + w[1] * b) + w[2] * c) + w[3] * d;
    const real* m = contact.rows;
    return {
        m[0] * v.x + m[3] * v.y + m[4] * v.z,
        m[3] * v.x + m[1] * v.y + m[5] * v.z,
        m[4] * v.x + m[5] * v.y + m[2] * v.z,
    };
}

// Whether a particle is in contact.
__device__ __forceinline__ bool contacts_any(const ContactTable& table, uint i) { return table.offsets[i] != table.offsets[i + 1]; }

// The row of a particle times a vector.
template <uint MEMBERS = 1> __device__ __forceinline__ vec3 contacts_row(const ContactTable& table, const real4* vectors, uint i) {
    vec3 sum = {0, 0, 0};
    terms_add<MEMBERS>(sum, table.offsets[i], table.offsets[i + 1], [&](uint k, vec3& term) {
        uint place = table.places[k];
        const TriangleContact& contact = table.contacts[place / 4];
        term = contact.weights[place % 4] * contact_times(contact, vectors);
        return true;
    });
    return sum;
}

// The terms of all rows times a vector, by all threads of the grid. A contact is in up to four rows, and some particles are in dozens of contacts: this way each
// contact is worked out once, and a long row waits for nothing but numbers that lie side by side. Warps are spread over the blocks.
__device__ __forceinline__ void contact_terms(const ContactTable& table, const real4* vectors) {
    uint warps = blockDim.x / WARP, first = (threadIdx.x / WARP * gridDim.x + blockIdx.x) * WARP + threadIdx.x % WARP;
    for (uint c = first; c < table.count; c += gridDim.x * warps * WARP) {
        const TriangleContact& contact = table.contacts[c];
        vec3 times = contact_times(contact, vectors);
#pragma unroll
        for (uint a = 0; a < 4; a++) {
            real weight = contact.weights[a];
            if (weight != 0) table.terms[table.ranks[4 * c + a]] = with_w(weight * times, 0);
        }
    }
}

// The row of a particle from the terms that all blocks have written.
template <uint MEMBERS> __device__ __forceinline__ vec3 contacts_row_of_terms(const ContactTable& table, uint i) {
    vec3 sum = {0, 0, 0};
    terms_add<MEMBERS>(sum, table.offsets[i], table.offsets[i + 1], [&](uint k, vec3& term) {
        term = xyz(table.terms[k]);
        return true;
    });
    return sum;
}
