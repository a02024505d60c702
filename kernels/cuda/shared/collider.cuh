// NUMERICS section 7: signed distances, push-out, friction.

#define SHAPE_PLANE 0
#define SHAPE_SPHERE 1
#define SHAPE_CAPSULE 2
#define SHAPE_BOX 3

struct Surface {
    real distance;
    vec3 normal;
    // Velocity along the normal, beside that of the collider as a whole [m/s].
    real speed;
};

struct Moved {
    vec3 position;
    vec3 velocity;
};

// Length and direction of a vector, `fallback` if it has none.
__device__ __forceinline__ real normalise(const vec3& vector, const vec3& fallback, vec3& direction) {
    real length, inverse;
    length_of(dot(vector, vector), length, inverse);
    direction = length > LENGTH_MIN ? vector * inverse : fallback;
    return length;
}

__device__ __forceinline__ vec3 collider_axis(const Collider& c, uint axis) {
    return {c.rotation[axis], c.rotation[3 + axis], c.rotation[6 + axis]};
}

// Outside, the distance to the nearest point of the box; inside, minus the distance to the nearest
// face. At equal distances the earlier axis wins.
__device__ __noinline__ Surface surface_of_box(const Collider& c, vec3 point) {
    const real* r = c.rotation;
    real beyond[3], sign[3];
    for (uint k = 0; k < 3; k++) {
        real local = r[k] * point.x + r[3 + k] * point.y + r[6 + k] * point.z;
        sign[k] = local < 0 ? (real)-1 : (real)1;
        beyond[k] = absolute(local) - c.size[k];
    }
    vec3 outside = {maximum(beyond[0], (real)0), maximum(beyond[1], (real)0), maximum(beyond[2], (real)0)};
    vec3 direction;
    real length = normalise(outside, make_vec3(0, 0, 0), direction);
    bool is_outside = length > 0;
    real nearest = maximum(maximum(beyond[0], beyond[1]), beyond[2]);
    bool first = beyond[0] == nearest;
    bool second = !first && beyond[1] == nearest;
    vec3 face = {first ? (real)1 : (real)0, second ? (real)1 : (real)0, !first && !second ? (real)1 : (real)0};
    vec3 chosen = is_outside ? direction : face;
    vec3 normal = {sign[0] * chosen.x, sign[1] * chosen.y, sign[2] * chosen.z};
    vec3 world = {
        dot(make_vec3(r[0], r[1], r[2]), normal),
        dot(make_vec3(r[3], r[4], r[5]), normal),
        dot(make_vec3(r[6], r[7], r[8]), normal),
    };
    return {is_outside ? length : nearest, world, 0};
}

// A row of samples along x: the value between two of them; its slope.
__device__ __forceinline__ real grid_edge(const float* sample, real share, real& slope) {
    real low = (real)sample[0];
    slope = (real)sample[1] - low;
    return low + share * slope;
}

// The value between two rows; the slopes along x and y.
__device__ __forceinline__ real grid_face(const float* sample, uint width, const real* share, real* slopes) {
    real low_slope, high_slope;
    real low = grid_edge(sample, share[0], low_slope);
    real high = grid_edge(sample + width, share[0], high_slope);
    real across = high - low;
    slopes[0] = low_slope + share[1] * (high_slope - low_slope);
    slopes[1] = across;
    return low + share[1] * across;
}

// The value between two layers, and the slopes.
__device__ __forceinline__ real grid_cell(const float* sample, uint width, size_t layer, const real* share, vec3& gradient) {
    real low_slopes[2], high_slopes[2];
    real low = grid_face(sample, width, share, low_slopes);
    real high = grid_face(sample + layer, width, share, high_slopes);
    gradient = {
        low_slopes[0] + share[2] * (high_slopes[0] - low_slopes[0]),
        low_slopes[1] + share[2] * (high_slopes[1] - low_slopes[1]),
        high - low,
    };
    return low + share[2] * (high - low);
}

// Trilinear interpolation, with the distance to the grid for a point outside of it.
__device__ __noinline__ Surface surface_of_grid(const Collider& c, vec3 point) {
    const real* r = c.rotation;
    const DistanceGrid& grid = *c.grid;
    uint cell[3];
    real share[3], beyond[3];
    for (uint k = 0; k < 3; k++) {
        real local = r[k] * point.x + r[3 + k] * point.y + r[6 + k] * point.z;
        real place = (local - grid.origin[k]) * grid.inverse_spacing;
        // In this order, so that NaN becomes a place of the grid.
        real clamped = minimum(maximum(place, (real)0), grid.last[k]);
        beyond[k] = grid.spacing * (place - clamped);
        cell[k] = min((uint)clamped, grid.size[k] - 2);
        share[k] = clamped - (real)cell[k];
    }
    uint width = grid.size[0], height = grid.size[1];
    size_t layer = (size_t)width * height, samples = layer * grid.size[2];
    uint set = (uint)c.size[0];
    const float* first = grid.distances + set * samples + cell[2] * layer + (size_t)cell[1] * width + cell[0];
    vec3 gradient;
    real distance = grid_cell(first, width, layer, share, gradient), speed = 0;
    if (set + 1 < grid.sets) {
        vec3 next_gradient;
        real change = grid_cell(first + samples, width, layer, share, next_gradient) - distance;
        gradient = gradient + c.size[1] * (next_gradient - gradient);
        distance = distance + c.size[1] * change;
        speed = -(grid.rate * change);
    }
    vec3 outside = {beyond[0], beyond[1], beyond[2]};
    vec3 normal;
    normalise(gradient, make_vec3(0, 0, 1), normal);
    vec3 world = {
        dot(make_vec3(r[0], r[1], r[2]), normal),
        dot(make_vec3(r[3], r[4], r[5]), normal),
        dot(make_vec3(r[6], r[7], r[8]), normal),
    };
    return {distance + root(dot(outside, outside)), world, speed};
}

// The surface as seen from a point relative to the origin of the collider.
__device__ __forceinline__ Surface surface_of(const Collider& c, const vec3& point) {
    vec3 z_axis = collider_axis(c, 2);
    if (c.shape == SHAPE_PLANE) return {dot(point, z_axis), z_axis, 0};
    if (c.shape == SHAPE_SPHERE) {
        vec3 normal;
        real length = normalise(point, z_axis, normal);
        return {length - c.size[0], normal, 0};
    }
    if (c.shape == SHAPE_CAPSULE) {
        real along = minimum(maximum(dot(point, z_axis), -c.size[0]), c.size[0]);
        vec3 normal;
        real length = normalise(point - along * z_axis, collider_axis(c, 0), normal);
        return {length - c.size[1], normal, 0};
    }
    if (c.shape == SHAPE_BOX) return surface_of_box(c, point);
    return surface_of_grid(c, point);
}

__device__ __forceinline__ vec3 collider_translation(const Collider& c) {
    return {c.translation[0], c.translation[1], c.translation[2]};
}

// Velocity of a surface of the collider at a point [m/s].
__device__ __forceinline__ vec3 surface_velocity(const Collider& c, const Surface& surface, const vec3& point) {
    vec3 arm = point - collider_translation(c);
    real ax = c.angular_velocity[0], ay = c.angular_velocity[1], az = c.angular_velocity[2];
    vec3 turning = {ay * arm.z - az * arm.y, az * arm.x - ax * arm.z, ax * arm.y - ay * arm.x};
    vec3 carried = make_vec3(c.linear_velocity[0], c.linear_velocity[1], c.linear_velocity[2]) + turning;
    return carried + surface.speed * surface.normal;
}

// Looks at a path at most.
#define LOOKS_MAX 1024

// The way of a particle as a collider sees it, relative to its origin at the end of a substep.
struct Path {
    vec3 start;
    vec3 way;
    real length_squared;
};

__device__ __forceinline__ Path path_of(const Collider& c, const vec3& start, const vec3& end, real length) {
    vec3 at = collider_translation(c);
    vec3 linear = {c.linear_velocity[0], c.linear_velocity[1], c.linear_velocity[2]};
    vec3 angular = {c.angular_velocity[0], c.angular_velocity[1], c.angular_velocity[2]};
    vec3 arm = (start - at) + length * linear;
    vec3 turning = cross(angular, arm);
    vec3 again = cross(angular, turning);
    arm = arm + length * (turning + ((real)0.5 * length) * again);
    vec3 way = (end - at) - arm;
    return {arm, way, dot(way, way)};
}

// Whether a path comes to a surface from outside and goes on through; where that is, relative to the origin of the collider, and
// the surface there. `end` is the normal at its end if the particle touches there.
__device__ __noinline__ bool path_hits(const Collider& c, const Path& path, bool touches, vec3 end, vec3& point, Surface& surface) {
    // Never on the surface itself, where there may be no normal. Beyond a grid the distance can be three times too large.
    real share = c.shape > SHAPE_BOX ? (real)0.25 : (real)0.875;
    real length = root(path.length_squared);
    real inverse = (real)1 / length;
    vec3 direction = path.way * inverse;
    real near = length * (real)0.0009765625;
    real gone = 0;
    for (uint look = 0; look < LOOKS_MAX; look++) {
        point = path.start + gone * direction;
        surface = surface_of(c, point);
        if (look == 0 && !(surface.distance >= 0)) return false;
        if (surface.distance <= near) {
            bool passes = !touches || dot(end, surface.normal) < 0;
            return passes && dot(direction, surface.normal) < 0;
        }
        gone = gone + share * surface.distance;
        if (!(gone < length)) return false;
    }
    return false;
}

// Contact of a free particle with one collider, from where it was at the start of a substep of some length.
__device__ __forceinline__ void collide(const Collider& c, real offset, const vec3& start, real length, Moved& moved) {
    Surface surface = surface_of(c, moved.position - collider_translation(c));
    real depth = offset - surface.distance;
    bool touches = depth > 0;
    if (c.shape != SHAPE_PLANE) {
        Path path = path_of(c, start, moved.position, length);
        // Long enough to lead through the surface and on to where it ends.
        if (path.length_squared > surface.distance * surface.distance) {
            vec3 point;
            Surface met;
            if (path_hits(c, path, touches, surface.normal, point, met)) {
                surface = met;
                depth = offset - met.distance;
                touches = true;
                moved.position = point + collider_translation(c);
            }
        }
    }
    if (!touches) return;
    vec3 n = surface.normal;
    moved.position = moved.position + depth * n;
    vec3 carried = surface_velocity(c, surface, moved.position);
    vec3 relative = moved.velocity - carried;
    real approach = dot(relative, n);
    if (!(approach < 0)) return;
    vec3 tangential = relative - approach * n;
    real speed = root(dot(tangential, tangential));
    real rebound = (real)1 + c.restitution;
    real lost = c.friction * (rebound * absolute(approach)) / maximum(speed, LENGTH_MIN);
    real kept = maximum((real)1 - lost, (real)0);
    real bounce = -(c.restitution * approach);
    moved.velocity = carried + (bounce * n + kept * tangential);
}

// Adds an impulse of a collider on a particle at a place, and its moment.
__device__ __forceinline__ void impulse_sum(const Solver& s, uint collider, uint particle, double px, double py, double pz, const vec3& at) {
    double x = at.x, y = at.y, z = at.z;
    double added[6] = {px, py, pz, y * pz - z * py, z * px - x * pz, x * py - y * px};
    double* place = s.collider_impulses + (size_t)(6 * collider) * s.count + particle;
    for (uint q = 0; q < 6; q++) place[(size_t)q * s.count] += added[q];
}

// Adds what a collider did to a particle, which had the velocity `before`.
__device__ __noinline__ void impulse_add(const Solver& s, uint collider, uint particle, real inverse_mass, vec3 before, Moved moved) {
    double mass = 1.0 / (double)inverse_mass;
    double px = mass * ((double)moved.velocity.x - (double)before.x);
    double py = mass * ((double)moved.velocity.y - (double)before.y);
    double pz = mass * ((double)moved.velocity.z - (double)before.z);
    impulse_sum(s, collider, particle, px, py, pz, moved.position);
}

// Contact with all colliders, one after the other, of a particle that was at `start` at the start of a substep of so many
// seconds. `colliders` is best known to be in shared or in global memory: loads by an address that may
// be either take longer.
template <bool FEEDBACK>
__device__ __forceinline__ void collide_all(const Solver& s, const Collider* colliders, uint particle, real offset, real inverse_mass, const vec3& start, real length, Moved& moved) {
    for (uint k = 0; k < s.collider_count; k++) {
        vec3 before = moved.velocity;
        collide(colliders[k], offset, start, length, moved);
        if (FEEDBACK && s.collider_impulses != nullptr) {
            bool changed = before.x != moved.velocity.x || before.y != moved.velocity.y || before.z != moved.velocity.z;
            if (changed) impulse_add(s, k, particle, inverse_mass, before, moved);
        }
    }
}
