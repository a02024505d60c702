// F of a triangle of fabric in the present motion, and its rate.

fn positions_deformation(triangle: Membrane) -> Gradient {
    let at = triangle.particles;
    return deformation(position_in[at.x].xyz, position_in[at.y].xyz, position_in[at.z].xyz, triangle.inverse);
}

fn velocities_deformation(triangle: Membrane) -> Gradient {
    let at = triangle.particles;
    return deformation(velocity_in[at.x].xyz, velocity_in[at.y].xyz, velocity_in[at.z].xyz, triangle.inverse);
}
