//! Interactions in groups without a common particle (NUMERICS §4).

use crate::{FabricTriangle, SpringClass, Springs};

/// Interactions sorted into colours: no two of one colour share a particle, so that all of a colour can be changed at the same time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Colouring {
    offsets: Vec<u32>,
    members: Vec<u32>,
}

impl Colouring {
    /// Greedy colouring of interactions of `arity` particles each, whose particles stand one after the other in `particles`, in their
    /// order: each takes the smallest colour that is free at all of its particles. The same ones always get the same colours.
    ///
    /// # Panics
    /// If `arity` is zero, or a particle is not below `particle_count`.
    #[must_use]
    pub fn greedy(particles: &[u32], arity: usize, particle_count: usize) -> Self {
        let members_of = |member: u32| &particles[member as usize * arity..][..arity];
        let mut pending: Vec<u32> = (0..(particles.len() / arity) as u32).collect();
        let mut colouring = Self { offsets: vec![0], members: Vec::with_capacity(pending.len()) };
        let mut used = vec![0_u64; particle_count];
        // A word holds 64 colours. Interactions that find none free wait for the next 64.
        while !pending.is_empty() {
            used.fill(0);
            let mut groups: Vec<Vec<u32>> = Vec::new();
            pending.retain(|&member| {
                let own = members_of(member);
                let taken = own.iter().fold(0, |taken, &particle| taken | used[particle as usize]);
                let colour = taken.trailing_ones();
                if colour == u64::BITS {
                    return true;
                }
                own.iter().for_each(|&particle| used[particle as usize] |= 1 << colour);
                if groups.len() <= colour as usize {
                    groups.resize_with(colour as usize + 1, Vec::new);
                }
                groups[colour as usize].push(member);
                false
            });
            for group in groups {
                colouring.members.extend(group);
                colouring.offsets.push(colouring.members.len() as u32);
            }
        }
        colouring
    }

    /// Greedy colouring of the triangles of fabric, in their order.
    #[must_use]
    pub fn of_triangles(triangles: &[FabricTriangle], particle_count: usize) -> Self {
        let corners: Vec<u32> = triangles.iter().flat_map(|triangle| triangle.particles).collect();
        Self::greedy(&corners, 3, particle_count)
    }

    /// Number of colours.
    #[must_use]
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Whether there is no colour.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The interactions of one colour, by their place in the list.
    #[must_use]
    pub fn colour(&self, colour: usize) -> &[u32] {
        &self.members[self.offsets[colour] as usize..self.offsets[colour + 1] as usize]
    }
}

/// The springs of some classes in colours.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SpringColouring {
    colouring: Colouring,
    springs: Vec<[u32; 3]>,
}

impl SpringColouring {
    /// Greedy colouring of the springs of the given classes, in the order of the springs.
    #[must_use]
    pub fn greedy(springs: &Springs, particle_count: usize, classes: &[SpringClass]) -> Self {
        let chosen: Vec<[u32; 3]> = springs
            .iter()
            .filter(|spring| classes.contains(&springs.kinds()[spring.kind as usize].class))
            .map(|spring| [spring.particles[0], spring.particles[1], spring.kind])
            .collect();
        let ends: Vec<u32> = chosen.iter().flat_map(|&[i, j, _]| [i, j]).collect();
        let colouring = Colouring::greedy(&ends, 2, particle_count);
        // Those of a colour one after the other, as backends read them.
        let springs = colouring.members.iter().map(|&member| chosen[member as usize]).collect();
        Self { colouring, springs }
    }

    /// Number of colours.
    #[must_use]
    pub fn len(&self) -> usize {
        self.colouring.len()
    }

    /// Whether there is no colour.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.colouring.is_empty()
    }

    /// The springs of one colour, each as its two particles and its kind.
    #[must_use]
    pub fn colour(&self, colour: usize) -> &[[u32; 3]] {
        let offsets = &self.colouring.offsets;
        &self.springs[offsets[colour] as usize..offsets[colour + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder, NetworkSpring, SpringNetwork,
    };

    fn check(geometry: Geometry, classes: &[SpringClass]) -> SpringColouring {
        let material = MaterialPreset::ALL[0].material(0.02);
        let name = "cloth".to_owned();
        let cloth =
            Cloth { name, geometry, material: material.into(), pins: vec![], velocity: [0.0; 3] };
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        let springs = model.springs();
        let colouring = SpringColouring::greedy(springs, model.particle_count(), classes);
        let mut count = 0;
        for colour in 0..colouring.len() {
            let mut used = vec![false; model.particle_count()];
            for &[i, j, kind] in colouring.colour(colour) {
                assert!(springs.joins(i, j));
                assert!(classes.contains(&springs.kinds()[kind as usize].class));
                for particle in [i, j] {
                    assert!(!std::mem::replace(&mut used[particle as usize], true));
                }
                count += 1;
            }
        }
        let wanted = springs.kind_indices().iter();
        let wanted =
            wanted.filter(|&&kind| classes.contains(&springs.kinds()[kind as usize].class));
        assert_eq!(count, wanted.count(), "every spring of the classes has one colour");
        colouring
    }

    #[test]
    fn springs_of_a_colour_share_no_particle() {
        let patch = GridPatch::horizontal(13, 0.02, 0.0);
        let colouring = check(Geometry::Grid(patch), &[SpringClass::Stretch, SpringClass::Shear]);
        assert!(colouring.len() <= 15, "greedy needs at most 2 x 8 - 1 for eight neighbours");
    }

    #[test]
    fn a_hub_with_more_springs_than_a_word_has_bits_is_coloured() {
        let network = SpringNetwork {
            positions: (0..101).map(|i| [0.01 * f64::from(i), 1.0, 0.0]).collect(),
            springs: (1..101)
                .map(|i| NetworkSpring {
                    particles: [0, i],
                    class: SpringClass::Stretch,
                    rest_length: None,
                    coefficients: None,
                })
                .collect(),
        };
        let geometry = Geometry::Network(network);
        // Without triangles there is no area to take the mass from.
        let mut material = MaterialPreset::ALL[0].material(0.02);
        material.mass = crate::Mass::PerParticle(1e-4);
        let name = "hub".to_owned();
        let cloth =
            Cloth { name, geometry, material: material.into(), pins: vec![], velocity: [0.0; 3] };
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        let colouring = SpringColouring::greedy(model.springs(), 101, &[SpringClass::Stretch]);
        assert_eq!(colouring.len(), 100);
        assert!((0..100).all(|colour| colouring.colour(colour).len() == 1));
    }

    #[test]
    fn interactions_of_four_particles_are_coloured_alike() {
        // A strip of quadrilaterals: neighbours share two particles, those after them none.
        let strip: Vec<u32> =
            (0..10).flat_map(|k| [2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 3]).collect();
        let colouring = Colouring::greedy(&strip, 4, 22);
        assert_eq!(colouring.len(), 2);
        assert_eq!(colouring.colour(0), [0, 2, 4, 6, 8]);
        assert_eq!(colouring.colour(1), [1, 3, 5, 7, 9]);
    }
}
