//! Forces on single particles.

use cloth_core::{Anchor, AnchorSpring, ForceControl};
use proptest::{collection::vec, prelude::*};

/// Forces on the particles of any model: as many as it has, if there are so many, later ones for a particle winning.
#[derive(Clone, Debug)]
pub struct RandomForces(Vec<(u32, Option<AnchorSpring>, [f64; 3])>);

impl RandomForces {
    /// Those of a model with so many particles, ascending, each particle once.
    #[must_use]
    pub fn of(&self, particles: usize) -> Vec<ForceControl> {
        let mut last = std::collections::BTreeMap::new();
        for &(number, spring, force) in &self.0 {
            let particle = number % particles as u32;
            last.insert(particle, ForceControl { particle, force, spring });
        }
        last.into_values().collect()
    }

    /// Some forces of a model with so many particles that depend on nothing but a seed.
    #[must_use]
    pub fn of_seed(seed: u64, particles: usize) -> Vec<ForceControl> {
        Self::from_seed(seed).of(particles)
    }

    /// Some forces that depend on nothing but a seed.
    #[must_use]
    pub fn from_seed(seed: u64) -> Self {
        let mut random = crate::random::Random::new(seed ^ 0x0f0e);
        let entries = (0..8).map(|number: u32| {
            let anchor = match number % 3 {
                0 => Anchor::Here,
                _ => Anchor::At(random.vector(0.5)),
            };
            let spring = (number != 7).then(|| AnchorSpring {
                anchor,
                stiffness: random.logarithmic(1.0, 1e5),
                damping: random.logarithmic(1e-4, 1.0),
                reach: if number.is_multiple_of(2) { f64::INFINITY } else { 0.05 },
            });
            (random.between(0.0, 1e6) as u32, spring, random.vector(0.1))
        });
        Self(entries.collect())
    }
}

/// Forces of any size that a cloth may meet, springs from loose to far too stiff for an explicit step.
pub fn forces() -> impl Strategy<Value = RandomForces> {
    let vector = |size: f64| [-size..size, -size..size, -size..size];
    let anchor = prop_oneof![Just(Anchor::Here), vector(1.0).prop_map(Anchor::At)];
    let reach = prop_oneof![Just(f64::INFINITY), Just(0.0), 1e-3..2.0];
    let exponent = |low: f64, high: f64| (low..high).prop_map(|power| 10_f64.powf(power));
    let spring = (anchor, exponent(-3.0, 7.0), exponent(-5.0, 3.0), reach).prop_map(
        |(anchor, stiffness, damping, reach)| AnchorSpring { anchor, stiffness, damping, reach },
    );
    vec((any::<u32>(), prop::option::weighted(0.8, spring), vector(2.0)), 1..40)
        .prop_map(RandomForces)
}
