// NUMERICS section 6: what triangles of fabric add to the entry of a particle for itself [kg].
fn element_own(particle: u32) -> f32 {
    return element_sums[3u * particle].x;
}
