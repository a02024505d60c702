//! Parts of a model in each of which a sweep over coloured springs can be done without the others (NUMERICS §4).

use super::SpringColouring;
use crate::NONE;

/// Colours up to which regions are made: of so many, what a particle depends on is the whole model.
const COLOURS_MAX: usize = 64;

/// A sweep of Gauss-Seidel over colours changes a particle by its own springs, and by what these particles went through before, and so on:
/// from a set of particles backwards through the colours, all that one sweep can bring to them. A region has particles of its
/// own, those that they depend on, and the springs between them. Who has the state at the start of a sweep can so do the whole sweep for
/// its own particles alone; at borders some springs are done twice, with the same result.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ColourRegions {
    /// Each region.
    pub regions: Vec<ColourRegion>,
    /// The particles of all regions, each with its own first.
    pub particles: Vec<u32>,
    /// Where the springs of a colour begin, `colours + 1` numbers for each region.
    pub rows: Vec<u32>,
    /// The springs: two places among the particles of the region, and the kind.
    pub springs: Vec<[u32; 3]>,
}

/// A part of the particles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ColourRegion {
    /// Where its particles begin.
    pub first_particle: u32,
    /// Number of its own particles.
    pub owned: u32,
    /// Number of its particles with those that these depend on.
    pub particles: u32,
}

impl ColourRegions {
    /// The regions whose own particles are the chunks of `size` entries of `order`, a permutation of the particles in which
    /// [`NONE`] stands for nothing. `None` if there are more than 64 colours, or a region has more than `most` particles.
    ///
    /// # Panics
    /// If `size` is zero, or `order` names a particle that is not below `particle_count`.
    #[must_use]
    pub fn new(
        colouring: &SpringColouring,
        order: &[u32],
        size: usize,
        most: usize,
        particle_count: usize,
    ) -> Option<Self> {
        let colours = colouring.len();
        if colours > COLOURS_MAX {
            return None;
        }
        // The one spring that a particle has of each colour.
        let mut spring_of = vec![NONE; particle_count * colours];
        for colour in 0..colours {
            for (&[i, j, _], number) in colouring.colour(colour).iter().zip(0_u32..) {
                for particle in [i, j] {
                    spring_of[particle as usize * colours + colour] = number;
                }
            }
        }
        let mut found = Self::default();
        let mut place = vec![NONE; particle_count];
        for own in order.chunks(size) {
            let first_particle = found.particles.len();
            let mut of_colours: Vec<Vec<[u32; 3]>> = vec![Vec::new(); colours];
            for &particle in own.iter().filter(|&&particle| particle != NONE) {
                place[particle as usize] = (found.particles.len() - first_particle) as u32;
                found.particles.push(particle);
            }
            let owned = found.particles.len() - first_particle;
            for (colour, springs) in of_colours.iter_mut().enumerate().rev() {
                for at in 0..found.particles.len() - first_particle {
                    let particle = found.particles[first_particle + at];
                    let number = spring_of[particle as usize * colours + colour];
                    if number == NONE {
                        continue;
                    }
                    let [i, j, kind] = colouring.colour(colour)[number as usize];
                    let other = if i == particle { j } else { i };
                    let there = place[other as usize];
                    // Already done from its other end.
                    if there != NONE && (there as usize) < at {
                        continue;
                    }
                    if there == NONE {
                        place[other as usize] = (found.particles.len() - first_particle) as u32;
                        found.particles.push(other);
                    }
                    springs.push([place[i as usize], place[j as usize], kind]);
                }
            }
            found.rows.push(found.springs.len() as u32);
            for springs in of_colours {
                found.springs.extend(springs);
                found.rows.push(found.springs.len() as u32);
            }
            let all = found.particles.len() - first_particle;
            if all > most {
                return None;
            }
            for &particle in &found.particles[first_particle..] {
                place[particle as usize] = NONE;
            }
            found.regions.push(ColourRegion {
                first_particle: first_particle as u32,
                owned: owned as u32,
                particles: all as u32,
            });
        }
        Some(found)
    }

    /// The largest number of springs of a region, of so many colours.
    #[must_use]
    pub fn springs_max(&self, colours: usize) -> usize {
        let rows = self.rows.chunks(colours + 1);
        rows.map(|rows| (rows[rows.len() - 1] - rows[0]) as usize).max().unwrap_or(0)
    }

    /// The largest number of particles of a region.
    #[must_use]
    pub fn particles_max(&self) -> usize {
        self.regions.iter().map(|region| region.particles as usize).max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder, SpringClass};

    /// A spring does something to both ends that depends on both.
    fn relax(values: &mut [u64], [i, j]: [usize; 2], kind: u32) {
        let mixed = values[i].wrapping_mul(31) ^ values[j].wrapping_mul(17) ^ u64::from(kind);
        values[i] = values[i].wrapping_add(mixed.rotate_left(7));
        values[j] = values[j].wrapping_add(mixed.rotate_right(9));
    }

    #[test]
    fn a_region_alone_gives_what_a_sweep_over_all_gives() {
        let material = MaterialPreset::ALL[0].material(0.02);
        let geometry = Geometry::Grid(GridPatch::horizontal(41, 0.02, 0.0));
        let name = "cloth".to_owned();
        let cloth =
            Cloth { name, geometry, material: material.into(), pins: vec![], velocity: [0.0; 3] };
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        let count = model.particle_count();
        let classes = [SpringClass::Stretch, SpringClass::Shear];
        let colouring = SpringColouring::greedy(model.springs(), count, &classes);
        let start: Vec<u64> = (0..count as u64).map(|i| i.wrapping_mul(0x9e37_79b9)).collect();
        let mut expected = start.clone();
        for colour in 0..colouring.len() {
            for &[i, j, kind] in colouring.colour(colour) {
                relax(&mut expected, [i as usize, j as usize], kind);
            }
        }
        let order = model.particle_groups(32);
        let found = ColourRegions::new(&colouring, &order, 64, 1000, count).unwrap();
        assert!(found.regions.len() > 5, "{} regions", found.regions.len());
        assert!(found.particles_max() < count / 2, "regions are parts of the whole");
        let sweep = |skipped: usize| {
            let mut all = vec![0; count];
            for (region, rows) in found.regions.iter().zip(found.rows.chunks(colouring.len() + 1)) {
                let particles = &found.particles[region.first_particle as usize..];
                let particles = &particles[..region.particles as usize];
                let mut values: Vec<u64> = particles.iter().map(|&i| start[i as usize]).collect();
                let springs = &found.springs[rows[0] as usize..rows[colouring.len()] as usize];
                for &[i, j, kind] in springs.iter().skip(skipped) {
                    relax(&mut values, [i as usize, j as usize], kind);
                }
                for (&particle, &value) in particles.iter().zip(&values).take(region.owned as usize)
                {
                    all[particle as usize] = value;
                }
            }
            all
        };
        assert_eq!(sweep(0), expected);
        assert_ne!(sweep(1), expected, "every spring of a region is needed");
        assert!(found.springs_max(colouring.len()) * found.regions.len() >= found.springs.len());
        assert_eq!(ColourRegions::new(&colouring, &order, 64, 100, count), None);
    }
}
