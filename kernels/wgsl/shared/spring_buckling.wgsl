// NUMERICS section 2, immediate buckling: tension and energy of springs that may buckle. After the four
// numbers of a spring follow force scale, inverse rest length, energy offset and stiff compression, then
// stiff energy and three unused ones.

const SPRING_WORDS: u32 = 3u;

// g(u), its derivative, and its mean over [0, u].
fn buckling_force(u: f32) -> f32 {
    return fma(u, fma(u, fma(u, fma(u, fma(u, -90.9709399871, 161.887831573), -113.252152232),
        24.969918105), -10.0183502273), -11.9586330606);
}

fn buckling_slope(u: f32) -> f32 {
    return fma(u, fma(u, fma(u, fma(u, -454.8546999355, 647.551326292), -339.756456696),
        49.93983621), -10.0183502273);
}

fn buckling_mean(u: f32) -> f32 {
    return fma(u, fma(u, fma(u, fma(u, fma(u, -15.16182333118, 32.3775663146), -28.313038058),
        8.323306035), -5.00917511365), -11.9586330606);
}

struct Buckling {
    force_scale: f32,
    inverse_rest_length: f32,
    energy_offset: f32,
    stiff_compression: f32,
}

fn buckling_at(at: u32) -> Buckling {
    let numbers = bitcast<vec4f>(spring_word(at + 1u));
    return Buckling(numbers.x, numbers.y, numbers.z, numbers.w);
}

fn buckling_compression(buckling: Buckling, stretch: f32) -> f32 {
    return max(-(stretch * buckling.inverse_rest_length), 0.0);
}

fn elastic_tension(at: u32, stiffness: f32, stretch: f32) -> f32 {
    let buckling = buckling_at(at);
    let buckled = buckling.force_scale * buckling_force(buckling_compression(buckling, stretch));
    let stiff = stiffness * stretch;
    // A stretch that is not a number stays visible.
    if buckled > stiff {
        return buckled;
    }
    return stiff;
}

fn elastic_slope(at: u32, stiffness: f32, stretch: f32) -> f32 {
    let buckling = buckling_at(at);
    let compression = buckling_compression(buckling, stretch);
    if buckling.force_scale * buckling_force(compression) > stiffness * stretch {
        return buckling.force_scale * buckling.inverse_rest_length * -buckling_slope(compression);
    }
    return stiffness;
}

fn elastic_energy_doubled(at: u32, stiffness: f32, stretch: f32) -> f32 {
    let buckling = buckling_at(at);
    let compression = buckling_compression(buckling, stretch);
    if buckling.force_scale * buckling_force(compression) > stiffness * stretch {
        let scaled = buckling.force_scale * stretch;
        return 2.0 * fma(scaled, buckling_mean(compression), buckling.energy_offset);
    }
    var offset = 0.0;
    if compression > buckling.stiff_compression {
        offset = bitcast<f32>(spring_word(at + 2u).x);
    }
    return fma(stiffness * stretch, stretch, 2.0 * offset);
}
