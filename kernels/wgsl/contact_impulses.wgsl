// NUMERICS section 8, impulses: momentum exchange and separation of all pairs in contact.
//!include model substep status motion motion_out contact_pair contact_partners contact_counts

struct Change {
    position: vec3f,
    velocity: vec3f,
}

// What a partner in contact does to a particle.
fn contact_change(particle: u32, partner: u32, position: vec4f, velocity: vec3f) -> Change {
    let other = position_in[partner];
    let pair = pair_of(position.xyz, other.xyz);
    let total = position.w + other.w;
    if !(is_in_contact(pair) && pair.length_squared > LENGTH_SQUARED_MIN && total > 0.0) {
        return Change(vec3f(0.0), vec3f(0.0));
    }
    let length = sqrt(pair.length_squared);
    let normal = pair.difference * (1.0 / length);
    let crowd = max(contact_counts[particle], contact_counts[partner]);
    let share = position.w / total / f32(crowd);
    let relative = velocity - velocity_in[partner].xyz;
    let approach = dot_product(relative, normal);
    let overlap = substep.contact_recovery * (model.contact_distance - length);
    var impulse = vec3f(0.0);
    if approach < 0.0 {
        let tangential = fma(vec3f(-approach), normal, relative);
        let speed = sqrt(dot_product(tangential, tangential));
        let rebound = 1.0 + model.contact_restitution;
        let grip = model.contact_friction * (rebound * abs(approach)) / max(speed, LENGTH_MIN);
        impulse = fma(vec3f(min(grip, 1.0)), tangential, rebound * approach * normal);
    }
    return Change((share * overlap) * normal, -share * impulse);
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count {
        return;
    }
    let position = position_in[particle];
    let velocity = velocity_in[particle];
    var change = Change(vec3f(0.0), vec3f(0.0));
    if contact_counts[particle] != 0u && !is_stopped() {
        let row = contact_rows[particle];
        for (var at = row.x; at < row.x + row.y; at += 1u) {
            let more = contact_change(particle, contact_entries[at], position, velocity.xyz);
            change = Change(change.position + more.position, change.velocity + more.velocity);
        }
    }
    position_out[particle] = vec4f(position.xyz + change.position, position.w);
    velocity_out[particle] = vec4f(velocity.xyz + change.velocity, velocity.w);
}
