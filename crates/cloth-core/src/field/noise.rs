//! Gradient noise on the lattice of the integers (Perlin 2002, "Improving noise").

use crate::Real;

/// Hash of a lattice point: 32-bit integer arithmetic that wraps, the same on every machine. The last
/// five lines spread every bit over all others (constants of Wellons 2018, "lowbias32").
#[inline(always)]
pub(crate) fn hash([x, y, z]: [i32; 3]) -> u32 {
    let mut h = (x as u32).wrapping_mul(0x9e37_79b1)
        ^ (y as u32).wrapping_mul(0x85eb_ca77)
        ^ (z as u32).wrapping_mul(0xc2b2_ae3d);
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// Product of the offset from a lattice point with its gradient, one of the twelve directions to the
/// edges of a cube: sums of two offsets, so that nothing is rounded but the sum.
#[inline(always)]
fn corner<T: Real>(lattice: [i32; 3], [x, y, z]: [T; 3]) -> T {
    let h = hash(lattice) & 15;
    let first = if h < 8 { x } else { y };
    let second = if h < 4 {
        y
    } else if h == 12 || h == 14 {
        x
    } else {
        z
    };
    let first = if h & 1 == 0 { first } else { -first };
    let second = if h & 2 == 0 { second } else { -second };
    first + second
}

/// 6 t^5 - 15 t^4 + 10 t^3.
#[inline(always)]
fn fade<T: Real>(t: T) -> T {
    t * t * t * (t * (t * T::from_f64(6.0) - T::from_f64(15.0)) + T::from_f64(10.0))
}

#[inline(always)]
fn mix<T: Real>(a: T, b: T, share: T) -> T {
    a + share * (b - a)
}

/// Noise at a point, dimensionless: between about -1 and 1, zero on the lattice, smooth between.
#[inline(always)]
pub(super) fn noise<T: Real>(point: [T; 3]) -> T {
    let mut lattice = [0; 3];
    let mut low = [T::ZERO; 3];
    let mut high = [T::ZERO; 3];
    let mut share = [T::ZERO; 3];
    for axis in 0..3 {
        let floor = point[axis].floor();
        lattice[axis] = floor.floor_to_i32();
        low[axis] = point[axis] - floor;
        high[axis] = low[axis] - T::ONE;
        share[axis] = fade(low[axis]);
    }
    let [i, j, k] = lattice;
    let [right, back, up] = lattice.map(|index| index.wrapping_add(1));
    let edge = |j, k, y, z| {
        let left = corner([i, j, k], [low[0], y, z]);
        mix(left, corner([right, j, k], [high[0], y, z]), share[0])
    };
    let face = |k, z| mix(edge(j, k, low[1], z), edge(back, k, high[1], z), share[1]);
    mix(face(k, low[2]), face(up, high[2]), share[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_the_same_for_ever() {
        assert_eq!(hash([0, 0, 0]), 0);
        assert_eq!(
            [hash([1, 0, 0]), hash([0, -1, 0]), hash([7, 11, -13])],
            [HASHES[0], HASHES[1], HASHES[2]]
        );
    }

    /// Computed once, by a program in another language.
    const HASHES: [u32; 3] = [0x6d52_3710, 0x1cba_8b71, 0xab4c_53fc];

    #[test]
    fn it_is_zero_on_the_lattice_bounded_and_continuous() {
        let mut largest = 0.0_f64;
        for number in 0..20_000 {
            let t = f64::from(number);
            let point = [0.37 * t - 900.0, 0.11 * t, -0.23 * t];
            let value = noise(point);
            largest = largest.max(value.abs());
            let near = noise([point[0] + 1e-6, point[1], point[2] - 1e-6]);
            assert!((value - near).abs() < 1e-5);
            assert_eq!(noise(point.map(f64::floor)), 0.0);
        }
        assert!((0.5..1.1).contains(&largest), "{largest}");
    }

    #[test]
    fn precisions_agree_and_far_points_are_defined() {
        for number in 0..2000 {
            let t = number as f32;
            let point = [0.37 * t, 3.0 - 0.5 * t, 0.01 * t];
            let difference = f64::from(noise(point)) - noise(point.map(f64::from));
            assert!(difference.abs() < 1e-6, "{difference}");
        }
        assert_eq!(noise([1e30_f32, -1e30, 8_388_609.0]), 0.0);
        assert!(noise([f64::NAN, 0.5, 0.5]).is_nan() && noise([f32::INFINITY; 3]).is_nan());
    }
}
