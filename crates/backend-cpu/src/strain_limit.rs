//! NUMERICS §4: over-long springs are shortened, one colour after the other.

use cloth_core::{Model, Real, SpringColouring, StrainLimit};
use rayon::prelude::*;

use crate::{
    memory::{LANES, Masses, Motion, MotionChunk},
    vector::{dot, sub},
};

/// Parts that the particles are split into. Springs within a part are worked on in parallel, one
/// task for each part; the few between parts come after them. Springs of a colour share no particle,
/// so that this order does not show in the result.
const PARTS: usize = 16;

/// The springs that are limited, by colours.
#[derive(Debug)]
pub(crate) struct StrainLimiter<T> {
    colours: Vec<Colour>,
    /// Largest length of each kind of spring \[m\].
    longest: Vec<T>,
    part_length: usize,
}

/// Springs without a common particle, each as its two particles and its kind.
#[derive(Debug, Default)]
struct Colour {
    /// Within each part, indices relative to its first particle.
    parts: Vec<Vec<[u32; 3]>>,
    between: Vec<[u32; 3]>,
}

impl<T: Real> StrainLimiter<T> {
    pub(crate) fn new(model: &Model, limit: Option<&StrainLimit>) -> Option<Self> {
        let limit = limit?;
        let springs = model.springs();
        let particle_count = model.particle_count();
        let colouring = SpringColouring::greedy(springs, particle_count, &limit.classes);
        let part_length = particle_count.div_ceil(PARTS).next_multiple_of(LANES);
        let colours = (0..colouring.len())
            .map(|colour| {
                let mut sorted = Colour {
                    parts: vec![Vec::new(); particle_count.div_ceil(part_length)],
                    between: Vec::new(),
                };
                for &[i, j, kind] in colouring.colour(colour) {
                    let [a, b] = [i, j].map(|particle| particle as usize / part_length);
                    if a == b {
                        let first = (a * part_length) as u32;
                        sorted.parts[a].push([i - first, j - first, kind]);
                    } else {
                        sorted.between.push([i, j, kind]);
                    }
                }
                sorted
            })
            .collect();
        let longest = springs
            .kinds()
            .iter()
            .map(|kind| T::from_f64(limit.ratio) * T::from_f64(kind.rest_length))
            .collect();
        Some(Self { colours, longest, part_length })
    }

    pub(crate) fn colour_count(&self) -> usize {
        self.colours.len()
    }

    /// Shortens the springs of one colour in a substep of `length` \[s\].
    pub(crate) fn apply(
        &self,
        colour: usize,
        length: T,
        masses: &Masses<T>,
        motion: &mut Motion<T>,
    ) {
        let Colour { parts, between } = &self.colours[colour];
        motion.chunks_mut(self.part_length).zip(parts).enumerate().for_each(
            |(part, (chunk, springs))| {
                let MotionChunk { position, velocity } = chunk;
                let first = part * self.part_length;
                for &[i, j, kind] in springs {
                    let [i, j] = [i as usize, j as usize];
                    let inverse = [masses.inverse[first + i], masses.inverse[first + j]];
                    let ends = [i, j].map(|end| position.each_ref().map(|c| c[end]));
                    let Some(shift) = correction(ends, inverse, self.longest[kind as usize]) else {
                        continue;
                    };
                    for (end, inverse) in [(i, inverse[0]), (j, -inverse[1])] {
                        for axis in 0..3 {
                            let change = inverse * shift[axis];
                            position[axis][end] += change;
                            velocity[axis][end] += change / length;
                        }
                    }
                }
            },
        );
        for &[i, j, kind] in between {
            let [i, j] = [i as usize, j as usize];
            let inverse = [masses.inverse[i], masses.inverse[j]];
            let ends = [i, j].map(|end| motion.position.get(end));
            let Some(shift) = correction(ends, inverse, self.longest[kind as usize]) else {
                continue;
            };
            for (end, inverse) in [(i, inverse[0]), (j, -inverse[1])] {
                let mut x = motion.position.get(end);
                let mut v = motion.velocity.get(end);
                for axis in 0..3 {
                    let change = inverse * shift[axis];
                    x[axis] += change;
                    v[axis] += change / length;
                }
                motion.position.set(end, x);
                motion.velocity.set(end, v);
            }
        }
    }
}

/// e n of NUMERICS, `None` if the spring is not too long or both ends are held.
#[inline(always)]
fn correction<T: Real>(ends: [[T; 3]; 2], inverse_mass: [T; 2], longest: T) -> Option<[T; 3]> {
    let difference = sub(ends[1], ends[0]);
    let length = dot(difference, difference).sqrt();
    let total = inverse_mass[0] + inverse_mass[1];
    if length <= longest || total == T::ZERO {
        return None;
    }
    let scale = (length - longest) / total / length;
    Some(difference.map(|component| scale * component))
}
