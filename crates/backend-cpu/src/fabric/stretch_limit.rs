//! NUMERICS §4: triangles of fabric that are stretched too far, one colour after the other.

use cloth_core::{
    Colouring, Model, Real, StrainLimit,
    fabric::{membrane::RestState, stretch_limit::correction},
};
use rayon::prelude::*;

use super::TASK;
use crate::memory::{Masses, Motion};

/// The triangles by colours. No two of a colour share a particle: they are computed side by side, and then moved.
#[derive(Debug)]
pub(crate) struct StretchLimiter<T> {
    colours: Vec<Vec<Limited<T>>>,
    ratio: T,
    shifts: Vec<Option<[[T; 3]; 3]>>,
}

#[derive(Clone, Copy, Debug)]
struct Limited<T> {
    particles: [u32; 3],
    rest: RestState<T>,
}

impl<T: Real> StretchLimiter<T> {
    pub(crate) fn new(model: &Model, limit: Option<&StrainLimit>) -> Option<Self> {
        let limit = limit?;
        let triangles = model.elements().triangles();
        let colouring = Colouring::of_triangles(triangles, model.particle_count());
        let limited = |&number: &u32| {
            let triangle = &triangles[number as usize];
            Limited { particles: triangle.particles, rest: triangle.rest.rounded() }
        };
        let colour = |colour: usize| colouring.colour(colour).iter().map(limited).collect();
        let colours = (0..colouring.len()).map(colour).collect();
        (!triangles.is_empty()).then(|| Self {
            colours,
            ratio: T::from_f64(limit.ratio),
            shifts: Vec::new(),
        })
    }

    pub(crate) fn colour_count(&self) -> usize {
        self.colours.len()
    }

    /// Shortens the triangles of one colour in a substep of `length` \[s\].
    pub(crate) fn apply(
        &mut self,
        colour: usize,
        length: T,
        masses: &Masses<T>,
        motion: &mut Motion<T>,
    ) {
        let (triangles, ratio) = (&self.colours[colour], self.ratio);
        let present = &*motion;
        let shifts = triangles.par_iter().with_min_len(TASK).map(|triangle| {
            let corners = triangle.particles.map(|i| present.position.get(i as usize));
            let inverse_masses = triangle.particles.map(|i| masses.inverse[i as usize]);
            correction(corners, inverse_masses, &triangle.rest, ratio)
        });
        shifts.collect_into_vec(&mut self.shifts);
        for (triangle, shift) in triangles.iter().zip(&self.shifts) {
            let Some(shift) = shift else { continue };
            for (particle, shift) in triangle.particles.into_iter().zip(shift) {
                let mut x = motion.position.get(particle as usize);
                let mut v = motion.velocity.get(particle as usize);
                for axis in 0..3 {
                    x[axis] += shift[axis];
                    v[axis] += shift[axis] / length;
                }
                motion.position.set(particle as usize, x);
                motion.velocity.set(particle as usize, v);
            }
        }
    }
}
