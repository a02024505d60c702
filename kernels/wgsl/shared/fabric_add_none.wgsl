// There is no fabric.

fn fabric_add(sum: vec3f, particle: u32) -> vec3f {
    return sum;
}
