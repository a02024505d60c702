// No collider is a distance grid.

fn surface_of_grid(collider: Collider, point: vec3f) -> Surface {
    return Surface(0.0, vec3f(0.0), 0.0);
}
