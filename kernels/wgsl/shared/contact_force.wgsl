// NUMERICS section 8: the penalty force on the particles of a group, partners in ascending order.

// All threads of the workgroup take part; threads without a particle note nothing.
fn contact_force(group: u32, lane: u32, exists: bool, particle: u32, position: vec3f, velocity: vec3f) -> vec3f {
    var partners = partners_of(group, lane, particle, position);
    var sum = vec3f(0.0);
    for (var k = 0u; k < partners.count; k += 1u) {
        sum = penalty_add(sum, push_of(position, velocity, partner_next(&partners)));
    }
    if exists && (substep.flags & FLAG_COUNT_CONTACTS) != 0u {
        contact_counts[particle] = partners.count;
    }
    return sum;
}
