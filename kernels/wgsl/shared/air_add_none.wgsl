// There is no air.

fn air_add(sum: vec3f, particle: u32) -> vec3f {
    return sum;
}
