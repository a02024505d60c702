// NUMERICS section 7: signed distances, push-out, friction.

struct Collider {
    translation: vec3f,
    // One of the SHAPE_ constants.
    shape: u32,
    linear_velocity: vec3f,
    friction: f32,
    angular_velocity: vec3f,
    restitution: f32,
    // Rotation local to world, row by row.
    row_x: vec3f,
    // Radius, half length of a capsule, or first half extent of a box [m]; number of a grid.
    size_x: f32,
    row_y: vec3f,
    // Radius of a capsule, or second half extent; number of the set of samples of a grid that holds.
    size_y: f32,
    row_z: vec3f,
    // Third half extent; share of the set of samples that follows.
    size_z: f32,
}

const SHAPE_PLANE: u32 = 0u;
const SHAPE_SPHERE: u32 = 1u;
const SHAPE_CAPSULE: u32 = 2u;
const SHAPE_BOX: u32 = 3u;
const SHAPE_GRID: u32 = 4u;

// All colliders of all substeps of a frame.
@group(0) @binding(13) var<storage, read> colliders: array<Collider>;
// Half the thickness of the cloth at each particle [m], if it differs.
@group(0) @binding(14) var<storage, read> offsets: array<f32>;

fn cloth_offset(particle: u32) -> f32 {
    if model.offset >= 0.0 {
        return model.offset;
    }
    return offsets[particle];
}

struct Surface {
    distance: f32,
    normal: vec3f,
    // Velocity along the normal, beside that of the collider as a whole [m/s].
    speed: f32,
}

// Distance and direction from a core (a point, a segment, a box), less a radius.
fn surface_around(difference: vec3f, radius: f32, fallback: vec3f) -> Surface {
    let length = sqrt(dot_product(difference, difference));
    let direction = difference * (1.0 / max(length, LENGTH_MIN));
    return Surface(length - radius, select(fallback, direction, length > LENGTH_MIN), 0.0);
}

// Components in the local frame.
fn collider_local(collider: Collider, point: vec3f) -> vec3f {
    return vec3f(
        fma(collider.row_z.x, point.z, fma(collider.row_y.x, point.y, collider.row_x.x * point.x)),
        fma(collider.row_z.y, point.z, fma(collider.row_y.y, point.y, collider.row_x.y * point.x)),
        fma(collider.row_z.z, point.z, fma(collider.row_y.z, point.y, collider.row_x.z * point.x)),
    );
}

// And back.
fn collider_world(collider: Collider, vector: vec3f) -> vec3f {
    return vec3f(
        dot_product(collider.row_x, vector),
        dot_product(collider.row_y, vector),
        dot_product(collider.row_z, vector),
    );
}

// Outside, the distance to the nearest point of the box; inside, minus the distance to the nearest
// face. At equal distances the earlier axis wins.
fn surface_of_box(collider: Collider, point: vec3f) -> Surface {
    let local = collider_local(collider, point);
    let sign = select(vec3f(1.0), vec3f(-1.0), local < vec3f(0.0));
    let beyond = abs(local) - vec3f(collider.size_x, collider.size_y, collider.size_z);
    let outside = surface_around(max(beyond, vec3f(0.0)), 0.0, vec3f(0.0));
    let nearest = max(max(beyond.x, beyond.y), beyond.z);
    let first = beyond.x == nearest;
    let second = !first && beyond.y == nearest;
    let face = select(vec3f(0.0), vec3f(1.0), vec3<bool>(first, second, !first && !second));
    let is_outside = outside.distance > 0.0;
    let normal = sign * select(face, outside.normal, is_outside);
    return Surface(select(nearest, outside.distance, is_outside), collider_world(collider, normal), 0.0);
}

// The surface as seen from a point relative to the origin of the collider.
fn surface_of(collider: Collider, point: vec3f) -> Surface {
    let z_axis = vec3f(collider.row_x.z, collider.row_y.z, collider.row_z.z);
    switch collider.shape {
        case SHAPE_PLANE: {
            return Surface(dot_product(point, z_axis), z_axis, 0.0);
        }
        case SHAPE_SPHERE: {
            return surface_around(point, collider.size_x, z_axis);
        }
        case SHAPE_CAPSULE: {
            let x_axis = vec3f(collider.row_x.x, collider.row_y.x, collider.row_z.x);
            let along = min(max(dot_product(point, z_axis), -collider.size_x), collider.size_x);
            return surface_around(fma(vec3f(-along), z_axis, point), collider.size_y, x_axis);
        }
        case SHAPE_GRID: {
            return surface_of_grid(collider, point);
        }
        default: {
            return surface_of_box(collider, point);
        }
    }
}

// Velocity of the surface at a place relative to the origin of the collider [m/s].
fn surface_velocity(collider: Collider, surface: Surface, arm: vec3f) -> vec3f {
    let carried = collider.linear_velocity + cross_product(collider.angular_velocity, arm);
    return add_scaled(carried, surface.speed, surface.normal);
}

struct Moved {
    position: vec3f,
    velocity: vec3f,
}

// Looks at a path at most.
const LOOKS_MAX: u32 = 1024u;

// The way of a particle as a collider sees it, relative to its origin at the end of the substep.
struct Path {
    start: vec3f,
    way: vec3f,
    length_squared: f32,
}

fn path_of(collider: Collider, start: vec3f, end: vec3f) -> Path {
    let arm = add_scaled(start - collider.translation, substep.length, collider.linear_velocity);
    let turning = cross_product(collider.angular_velocity, arm);
    let again = cross_product(collider.angular_velocity, turning);
    let first = add_scaled(arm, substep.length, add_scaled(turning, 0.5 * substep.length, again));
    let way = (end - collider.translation) - first;
    return Path(first, way, dot_product(way, way));
}

struct Hit {
    is_hit: bool,
    // Relative to the origin of the collider.
    point: vec3f,
    surface: Surface,
}

// Where a path comes to a surface from outside, if it goes on through. `end` is the normal at its end if the particle
// touches there.
fn path_hit(collider: Collider, path: Path, touches: bool, end: vec3f) -> Hit {
    // Never on the surface itself, where there may be no normal. Beyond a grid the distance can be three times too large.
    let share = select(0.875, 0.25, collider.shape == SHAPE_GRID);
    let length = sqrt(path.length_squared);
    let direction = path.way * (1.0 / length);
    let near = length * 0.0009765625;
    var hit = Hit(false, path.start, Surface(0.0, vec3f(0.0), 0.0));
    var gone = 0.0;
    for (var look = 0u; look < LOOKS_MAX; look += 1u) {
        hit.point = add_scaled(path.start, gone, direction);
        hit.surface = surface_of(collider, hit.point);
        if look == 0u && !(hit.surface.distance >= 0.0) {
            break;
        }
        if hit.surface.distance <= near {
            let passes = !touches || dot_product(end, hit.surface.normal) < 0.0;
            hit.is_hit = passes && dot_product(direction, hit.surface.normal) < 0.0;
            break;
        }
        gone = fma(share, hit.surface.distance, gone);
        if !(gone < length) {
            break;
        }
    }
    return hit;
}

// Contact of a particle that was at `start` at the start of the substep.
fn collide(collider: Collider, offset: f32, start: vec3f, before: Moved) -> Moved {
    var surface = surface_of(collider, before.position - collider.translation);
    var depth = offset - surface.distance;
    var touches = depth > 0.0;
    var after = before;
    if collider.shape != SHAPE_PLANE {
        let path = path_of(collider, start, before.position);
        // Long enough to lead through the surface and on to where it ends.
        if path.length_squared > surface.distance * surface.distance {
            let hit = path_hit(collider, path, touches, surface.normal);
            if hit.is_hit {
                surface = hit.surface;
                depth = offset - surface.distance;
                touches = true;
                after.position = hit.point + collider.translation;
            }
        }
    }
    if !touches {
        return before;
    }
    after.position = add_scaled(after.position, depth, surface.normal);
    let arm = after.position - collider.translation;
    let carried = surface_velocity(collider, surface, arm);
    let relative = before.velocity - carried;
    let approach = dot_product(relative, surface.normal);
    if approach < 0.0 {
        let tangential = fma(vec3f(-approach), surface.normal, relative);
        let speed = sqrt(dot_product(tangential, tangential));
        let lost = collider.friction * ((1.0 + collider.restitution) * abs(approach))
            / max(speed, LENGTH_MIN);
        let kept = max(1.0 - lost, 0.0);
        let bounce = -(collider.restitution * approach);
        after.velocity = carried
            + fma(vec3f(kept), tangential, bounce * surface.normal);
    }
    return after;
}

// Contact of a free particle of some mass with all colliders, one after the other. It was at `start` at the start of the substep.
fn collide_all(particle: u32, mass: f32, start: vec3f, before: Moved) -> Moved {
    let offset = cloth_offset(particle);
    var moved = before;
    for (var number = 0u; number < substep.collider_count; number += 1u) {
        let velocity = moved.velocity;
        moved = collide(colliders[substep.collider_first + number], offset, start, moved);
        impulse_add(particle, number, mass, moved.velocity - velocity, moved.position);
    }
    return moved;
}

// Deepest intrusion of a particle into the thickness around any collider [m].
fn penetration(offset: f32, position: vec3f) -> f32 {
    var deepest = 0.0;
    let end = substep.collider_first + substep.collider_count;
    for (var at = substep.collider_first; at < end; at += 1u) {
        let surface = surface_of(colliders[at], position - colliders[at].translation);
        deepest = max(deepest, offset - surface.distance);
    }
    return deepest;
}
