//! How large an explicit time step may be (NUMERICS §4).

use glam::DVec3;

use super::{Model, SpringKind};

/// Rounds of the power iteration at most. The Rayleigh quotient is within a percent after these on
/// grids of any size, as the highest modes of a grid lie close together.
const ROUNDS: usize = 100;

/// Springs visited in all rounds together at most, some seconds of work; a model so large gets fewer
/// rounds, but never below [`ROUNDS_MIN`].
const VISITS: usize = 200_000_000;

/// Rounds after which the estimate is within some percent.
const ROUNDS_MIN: usize = 20;

impl Model {
    /// Estimate of the largest stable time step of symplectic Euler, 2/omega_max \[s\], for the
    /// undamped springs at their rest lengths; infinite for a model without springs. A spring that
    /// buckles counts with the steepest part of its tension (NUMERICS §2).
    ///
    /// omega_max^2 is the largest eigenvalue of M^-1/2 K M^-1/2, found by power iteration. The
    /// estimate does not see contact, damping or pins, and springs stiffen sideways when stretched:
    /// stay some ten percent below it.
    #[must_use]
    pub fn stable_time_step(&self) -> f64 {
        let omega_squared = self.omega_squared_max();
        if omega_squared > 0.0 { 2.0 / omega_squared.sqrt() } else { f64::INFINITY }
    }

    fn omega_squared_max(&self) -> f64 {
        let stiffness: Vec<f64> =
            self.springs.kinds().iter().map(SpringKind::stiffness_max).collect();
        let springs: Vec<([usize; 2], f64, DVec3)> = self
            .springs
            .iter()
            .map(|spring| {
                let [i, j] = spring.particles.map(|particle| particle as usize);
                let difference = DVec3::from(self.positions[j]) - DVec3::from(self.positions[i]);
                let stiffness = stiffness[spring.kind as usize];
                ([i, j], stiffness, difference.normalize_or(DVec3::X))
            })
            .collect();
        let roots: Vec<f64> = self.masses.iter().map(|mass| mass.sqrt().recip()).collect();
        // A start that alternates from particle to particle is close to the highest mode; the
        // second factor keeps it from being orthogonal to it on any regular pattern.
        let mut vector: Vec<DVec3> = (0..self.particle_count())
            .map(|i| {
                let phase = i as f64;
                DVec3::new((1.9 * phase).sin(), (2.3 * phase + 1.0).sin(), (2.7 * phase).cos())
            })
            .collect();
        let mut eigenvalue = 0.0;
        let mut image = vec![DVec3::ZERO; vector.len()];
        let rounds = (VISITS / springs.len().max(1)).clamp(ROUNDS_MIN, ROUNDS);
        for _ in 0..rounds {
            let length = vector.iter().map(|entry| entry.length_squared()).sum::<f64>().sqrt();
            if length == 0.0 {
                return 0.0;
            }
            vector.iter_mut().for_each(|entry| *entry /= length);
            image.fill(DVec3::ZERO);
            for &([i, j], stiffness, direction) in &springs {
                let stretch = direction.dot(vector[i] * roots[i] - vector[j] * roots[j]);
                let force = direction * (stiffness * stretch);
                image[i] += force * roots[i];
                image[j] -= force * roots[j];
            }
            eigenvalue = vector.iter().zip(&image).map(|(a, b)| a.dot(*b)).sum();
            std::mem::swap(&mut vector, &mut image);
        }
        eigenvalue
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        Cloth, Geometry, Mass, MaterialPreset, ModelBuilder, NetworkSpring, SpringClass,
        SpringCoefficients, SpringNetwork,
    };

    #[test]
    fn a_chain_of_equal_masses_has_the_known_limit() {
        // omega_max of a free chain of n masses: 2 sqrt(k/m) sin(pi (n - 1) / (2 n)).
        let count = 12_u32;
        let [stiffness, mass] = [50.0, 2e-3];
        let mut material = MaterialPreset::ALL[0].material(0.1);
        material.mass = Mass::PerParticle(mass);
        material.stretch = SpringCoefficients { stiffness, damping: 0.0 };
        let network = SpringNetwork {
            positions: (0..count).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect(),
            springs: (1..count)
                .map(|i| NetworkSpring {
                    particles: [i - 1, i],
                    class: SpringClass::Stretch,
                    rest_length: None,
                    coefficients: None,
                })
                .collect(),
        };
        let model = ModelBuilder::new()
            .cloth(Cloth {
                name: "chain".into(),
                geometry: Geometry::Network(network),
                material,
                pins: vec![],
                velocity: [0.0; 3],
            })
            .build()
            .unwrap();
        let n = f64::from(count);
        let omega =
            2.0 * (stiffness / mass).sqrt() * (std::f64::consts::FRAC_PI_2 * (n - 1.0) / n).sin();
        let error = model.stable_time_step() / (2.0 / omega) - 1.0;
        assert!(error.abs() < 1e-3, "relative error {error}");
    }
}
