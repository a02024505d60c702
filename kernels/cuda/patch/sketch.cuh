// Where particles are, roughly, so that a few operations on whole numbers tell those that are too far from each other to be in contact.
// Nobody needs the bits of this: what it leaves is looked at as the results need it.

// Whole steps from a middle along each axis, a byte for each, and half the square of that distance, times -1.
struct alignas(8) Sketch {
    int steps;
    int minus_half;
};

struct alignas(16) SketchPair {
    Sketch first;
    Sketch second;
};

// What is nowhere near.
#define SKETCH_NOWHERE Sketch{0, -0x3fffffff}
// Steps from the middle to where particles may be, along one axis, at most.
#define SKETCH_STEPS 126

// How a lane compares others with its particle, q steps from the middle. As whole numbers, |p - q|² <= d² is p·q - |p|²/2 >= (|q|² - d²)/2,
// of which only p·q is of the pair.
struct SketchView {
    // Steps per metre.
    float scale;
    int steps;
    int least;

    // Particles are within so many metres from the middle along each axis.
    __device__ __forceinline__ void scale_to(float half) { scale = SKETCH_STEPS * inverse_rough(half); }

    // A particle as seen from the middle.
    __device__ __forceinline__ Sketch of(const vec3& seen) const {
        // Added, it leaves whole numbers in the low bytes.
        const float whole = 12582912;
        uint x = __float_as_uint(fma((float)seen.x, scale, whole)), y = __float_as_uint(fma((float)seen.y, scale, whole)), z = __float_as_uint(fma((float)seen.z, scale, whole));
        int steps = (int)(__byte_perm(__byte_perm(x, y, 0x0040), z, 0x0410) & 0xffffffu);
        return {steps, -(__dp4a(steps, steps, 0) >> 1)};
    }

    // The particle of the lane, if there is one, which is compared with others at such a distance from now on.
    __device__ __forceinline__ Sketch see(bool exists, const vec3& seen, float distance) {
        Sketch own = of(seen);
        steps = own.steps;
        // Each of two may be half a step off along each axis: the root of three steps together.
        float far = 1.001f * distance * scale + 1.75f;
        least = exists ? -2 - (int)(0.5f * far * far) - own.minus_half : 0x20000000;
        return exists ? own : SKETCH_NOWHERE;
    }

    // More than `least` if they may be in contact.
    __device__ __forceinline__ int closeness(const Sketch& other) const { return __dp4a(steps, other.steps, other.minus_half); }

    // Bits of those of so many that may be in contact with it, the first one's lowest. The sign of a difference is what they are made of.
    template <uint COUNT> __device__ __forceinline__ uint near(const Sketch* others) const {
        SketchPair pairs[COUNT / 2];
        uint bits = 0;
#pragma unroll
        for (uint k = 0; k < COUNT / 2; k++) pairs[k] = ((const SketchPair*)others)[k];
#pragma unroll
        for (int k = COUNT / 2 - 1; k >= 0; k--) {
            bits = __funnelshift_l((uint)(least - closeness(pairs[k].second)), bits, 1);
            bits = __funnelshift_l((uint)(least - closeness(pairs[k].first)), bits, 1);
        }
        return bits;
    }
};
