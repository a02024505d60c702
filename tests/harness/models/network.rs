//! Particles joined at random.

use cloth_core::{NetworkSpring, SpringClass, SpringNetwork};

use crate::random::Random;

/// Shortest rest length of a spring \[m\]: a spring so short is nearly degenerate.
const REST_LENGTH_MIN: f64 = 1e-6;

/// `particles` in a cube whose volume gives them `spacing` \[m\], and at most `springs` springs
/// between random pairs. The last quarter of the particles has none: empty rows of the matrix.
#[must_use]
pub(super) fn random_network(
    particles: u32,
    springs: u32,
    spacing: f64,
    random: &mut Random,
) -> SpringNetwork {
    let size = 0.5 * spacing * f64::from(particles).cbrt();
    let positions: Vec<_> = (0..particles).map(|_| random.vector(size)).collect();
    let joined = (particles - particles / 4) as usize;
    let mut network = SpringNetwork { positions, springs: Vec::new() };
    if joined < 2 {
        return network;
    }
    let classes = [SpringClass::Stretch, SpringClass::Shear, SpringClass::Bend];
    for _ in 0..springs {
        let pair = [0, 1].map(|_| random.index(joined) as u32);
        if pair[0] == pair[1] {
            continue;
        }
        let rest_length = match random.index(4) {
            0 => None,
            1 => Some(random.logarithmic(REST_LENGTH_MIN, spacing)),
            _ => Some(random.between(0.5 * spacing, 1.5 * spacing)),
        };
        let class = classes[random.index(3)];
        network.springs.push(NetworkSpring {
            particles: pair,
            class,
            rest_length,
            coefficients: None,
        });
    }
    network
}
