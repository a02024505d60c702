//! The springs between the pointer and the cloth.
//!
//! Each particle around the one under the pointer gets a spring to where it is when it is taken
//! ([`cloth::Anchor::Here`]); pulling moves all anchors. Nobody has to know where the particles are, so that they can stay on their
//! device. A single spring would tear its particle out of the cloth.

use cloth::{Anchor, AnchorSpring, ForceControl, Model};
use glam::DVec3;

use crate::Ray;

use super::pick::Pick;

/// Angular frequency with which the whole cloth would swing on the springs \[1/s\]: three times a second,
/// so that a cloth that is lifted hangs 3 cm below the pointer.
const FREQUENCY: f64 = std::f64::consts::TAU * 3.0;
/// Radius of what is pulled, in units of the size of the cloth.
const RADIUS: f64 = 0.1;
/// Distance from its anchor beyond which a particle is not pulled harder, in units of the size of the cloth.
const REACH: f64 = 0.5;
/// Highest speed of the anchors, in units of the size of the cloth \[1/s\]: a pointer that jumps is followed, but not as fast.
const SPEED: f64 = 7.2;

/// A hold on the cloth.
#[derive(Clone, Debug)]
pub(super) struct Grab {
    /// The particle under the pointer.
    pub(super) particle: u32,
    /// Where the pointer pulls it \[m\].
    pub(super) target: [f64; 3],
    /// Distance of the target from the eye \[m\].
    distance: f64,
    /// Where the pointer took it \[m\].
    start: DVec3,
    /// How far the anchors are from where they began \[m\].
    offset: DVec3,
    /// Highest speed of the anchors \[m/s\].
    speed: f64,
    springs: Vec<ForceControl>,
}

impl Grab {
    /// A hold on what a ray met. Its springs are together as stiff as it takes for the whole cloth to swing three times a second,
    /// and damped critically for what they hold.
    pub(super) fn new(model: &Model, ray: &Ray, pick: Pick) -> Self {
        let cloth = &model.cloths()[model.cloth_of(pick.particle)];
        let range = cloth.particles.start as usize..cloth.particles.end as usize;
        // The rest shape is flat where the present one may be folded: what is near there is near
        // along the cloth.
        let rest = model.positions();
        let bounds = cloth::io::Bounds::of(&rest[range.clone()]);
        let size = (DVec3::from(bounds.max) - DVec3::from(bounds.min)).length();
        let radius = (RADIUS * size).max(1e-9);
        let center = DVec3::from(rest[pick.particle as usize]);
        let masses = model.masses();
        let weights = cloth.particles.clone().filter_map(|particle| {
            let share = center.distance(rest[particle as usize].into()) / radius;
            let weight = (1.0 - share * share).powi(2) * masses[particle as usize];
            (share < 1.0).then_some((particle, weight))
        });
        let weights: Vec<(u32, f64)> = weights.collect();
        let mass: f64 = weights.iter().map(|&(_, weight)| weight).sum();
        let whole: f64 = masses[range].iter().sum();
        let stiffness = whole * FREQUENCY * FREQUENCY;
        let damping = 2.0 * (stiffness * mass).sqrt();
        let springs = weights.iter().map(|&(particle, weight)| {
            let share = weight / mass;
            let spring = AnchorSpring {
                anchor: Anchor::Here,
                stiffness: share * stiffness,
                damping: share * damping,
                reach: REACH * size,
            };
            ForceControl { particle, force: [0.0; 3], spring: Some(spring) }
        });
        let start = DVec3::from(ray.at(pick.distance));
        Self {
            particle: pick.particle,
            target: start.to_array(),
            distance: pick.distance,
            start,
            offset: DVec3::ZERO,
            speed: SPEED * size,
            springs: springs.collect(),
        }
    }

    /// The springs, anchored where they begin.
    pub(super) fn springs(&self) -> &[ForceControl] {
        &self.springs
    }

    /// The same hold, which knows where particles are \[m\].
    pub(super) fn with_anchors(mut self, positions: &[[f64; 3]]) -> Self {
        for force in &mut self.springs {
            if let Some(spring) = &mut force.spring {
                spring.anchor = Anchor::At(positions[force.particle as usize]);
            }
        }
        self
    }

    /// The springs of a hold that knows its anchors, where these are in the middle of a frame of `duration` \[s\].
    pub(super) fn springs_along(&mut self, duration: f64) -> impl Iterator<Item = ForceControl> {
        let before = self.offset;
        let after = DVec3::from(self.follow(duration));
        let offset = 0.5 * (before + after);
        self.springs.iter().map(move |&(mut force)| {
            if let Some(AnchorSpring { anchor: Anchor::At(place), .. }) = &mut force.spring {
                *place = (DVec3::from(*place) + offset).to_array();
            }
            force
        })
    }

    /// Moves the pointer elsewhere, at the same distance from the eye.
    pub(super) fn pointer_move(&mut self, ray: &Ray) {
        self.target = ray.at(self.distance);
    }

    /// How far anchors are to be from where they began at the end of a frame of `duration` \[s\].
    pub(super) fn follow(&mut self, duration: f64) -> [f64; 3] {
        let way = DVec3::from(self.target) - self.start - self.offset;
        self.offset += way.clamp_length_max(self.speed * duration);
        self.offset.to_array()
    }
}

#[cfg(test)]
mod tests {
    use cloth::scene::{CompileOptions, Scene};

    use super::*;

    #[test]
    fn anchors_follow_a_jump_at_their_highest_speed_and_arrive() {
        let model =
            Scene::builtin("drape").unwrap().compile(&CompileOptions::default()).unwrap().model;
        let ray = Ray { origin: [0.0, -3.0, 0.0], direction: [0.0, 1.0, 0.0] };
        let mut grab = Grab::new(&model, &ray, Pick { particle: 0, distance: 3.0 });
        assert!(grab.springs.iter().any(|spring| spring.particle == 0) && grab.springs.len() > 5);
        let total: f64 = grab.springs.iter().filter_map(|f| Some(f.spring?.stiffness)).sum();
        let mass: f64 = model.masses().iter().sum();
        assert!((total / mass).sqrt() - FREQUENCY < 1e-9 * FREQUENCY);
        grab.pointer_move(&Ray { origin: [1.0, -3.0, 0.0], ..ray });
        let first = grab.follow(1e-3);
        assert!((first[0] - 1e-3 * grab.speed).abs() < 1e-12, "{first:?}");
        for _ in 0..10_000 {
            grab.follow(1e-3);
        }
        assert!(grab.offset.distance(DVec3::X) < 1e-12, "{:?}", grab.offset);
    }
}
