//! NUMERICS §5, `vector_dot` and `vector_combine`.

use cloth_core::stepper::linear::block_sum;

use crate::Vector;

/// Particles of a packet, packets of a part, and parts of a block.
const LANES: usize = 16;
const PACKETS: usize = 8;
const PARTS: usize = 4;

/// The scalar product, in the order that all backends add in.
#[must_use]
pub fn vector_dot(a: &[Vector<f64>], b: &[Vector<f64>]) -> f64 {
    let products: Vec<f64> = a.iter().zip(b).map(|(a, b)| a.dot(*b)).collect();
    block_sum(products.chunks(LANES * PACKETS * PARTS).map(|block| {
        let part = |number| block.chunks(LANES * PACKETS).nth(number).map_or(0.0, part_sum);
        (part(0) + part(1)) + (part(2) + part(3))
    }))
}

/// The sum of a part: lane by lane, then a tree of the lanes.
fn part_sum(products: &[f64]) -> f64 {
    let at = |packet: usize, lane: usize| {
        products.get(packet * LANES + lane).copied().unwrap_or_default()
    };
    let mut lanes: [f64; LANES] = std::array::from_fn(|lane| {
        let pair = |number| at(2 * number, lane) + at(2 * number + 1, lane);
        (0..PACKETS / 2).map(pair).sum()
    });
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            lanes[lane] += lanes[lane + half];
        }
        half /= 2;
    }
    lanes[0]
}

/// to = from_scale from + to_scale to. A scale of zero drops its vector, whatever it holds.
pub fn vector_combine(
    (from_scale, from): (f64, &[Vector<f64>]),
    (to_scale, to): (f64, &mut [Vector<f64>]),
) {
    let scaled = |scale: f64, vector: Vector<f64>| {
        if scale == 0.0 { Vector::ZERO } else { vector.scaled(scale) }
    };
    for (to, from) in to.iter_mut().zip(from) {
        *to = scaled(from_scale, *from) + scaled(to_scale, *to);
    }
}
