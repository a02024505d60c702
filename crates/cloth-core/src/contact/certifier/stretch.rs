//! Triangles of fabric that no motion takes beyond their largest stretch (NUMERICS §15).

use rayon::prelude::*;

use super::{
    super::{dot, plus},
    along,
};
use crate::{
    Model, Real,
    fabric::{
        membrane::{RestState, deformation},
        stretch_limit::correction,
    },
};

/// Triangles in a task.
const TASK: usize = 1024;

/// Halvings of the interval in which the share of a way ends.
const HALVINGS: u32 = 12;

/// Times that triangles that end too long are shortened one after the other.
const SWEEPS: u32 = 200;

/// Share of the largest extension to which a triangle is shortened that exceeds it, so that few times are enough.
const SHARE: f64 = 0.95;

/// What rounding may do to the square of a stretch, in distances from 1 to the next number.
const ROUNDING: f64 = 16.0;

/// Triangles with a largest stretch.
#[derive(Clone, Debug, Default)]
pub(super) struct StretchBounds<T> {
    triangles: Vec<Bounded<T>>,
    /// Where the triangles of each particle begin, and the end; then these.
    starts: Vec<u32>,
    of_particles: Vec<u32>,
    /// Of particles \[1/kg\].
    inverse_masses: Vec<T>,
}

#[derive(Clone, Copy, Debug)]
struct Bounded<T> {
    particles: [u32; 3],
    rest: RestState<T>,
    /// Square of the largest stretch.
    largest: T,
    /// The stretch to which it is shortened.
    target: T,
}

/// The squares of the largest stretch that a triangle may have, and of that which it has at the start.
#[derive(Clone, Copy, Debug)]
struct Exceeded<T> {
    bound: T,
    at_start: T,
}

impl<T: Real> StretchBounds<T> {
    pub(super) fn new(model: &Model) -> Self {
        let elements = model.elements();
        let bounded = elements.triangles().iter().filter_map(|triangle| {
            let limit = elements.fabrics()[triangle.fabric as usize].stretch_limit;
            limit.is_finite().then(|| Bounded {
                particles: triangle.particles,
                rest: triangle.rest.rounded(),
                largest: T::from_f64(limit * limit),
                target: T::from_f64(1.0 + SHARE * (limit - 1.0)),
            })
        });
        let inverse = |mass: &f64| T::from_f64(mass.recip());
        let triangles: Vec<Bounded<T>> = bounded.collect();
        let mut corners: Vec<_> = (triangles.iter().zip(0_u32..))
            .flat_map(|(bounded, triangle)| bounded.particles.map(|i| (i, triangle)))
            .collect();
        corners.sort_unstable();
        let mut starts = vec![0; model.particle_count() + 1];
        corners.iter().for_each(|&(i, _)| starts[i as usize + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        Self {
            triangles,
            starts,
            of_particles: corners.into_iter().map(|(_, triangle)| triangle).collect(),
            inverse_masses: model.masses().iter().map(inverse).collect(),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Whether a triangle ends beyond its largest stretch.
    pub(super) fn is_exceeded(
        &self,
        start: impl Fn(u32) -> [T; 3] + Sync,
        end: impl Fn(u32) -> [T; 3] + Sync,
    ) -> bool {
        let exceeds = |triangle: &Bounded<T>| triangle.exceeded(&start, &end).is_some();
        self.triangles.par_iter().with_min_len(TASK).any(exceeds)
    }

    /// Shortens triangles that end beyond their largest stretch, one after the other, which keeps momentum, until there are none or it takes
    /// too long. Whom that moves is marked.
    pub(super) fn shorten(
        &self,
        start: &[[T; 3]],
        end: &mut [[T; 3]],
        is_held: impl Fn(u32) -> bool,
        marked: &mut [bool],
    ) {
        let exceeded = |triangle: &Bounded<T>, end: &[[T; 3]]| {
            triangle.exceeded(&|i| start[i as usize], &|i| end[i as usize])
        };
        let mut stretched = self.all(|triangle| exceeded(triangle, end));
        let mut moved = Vec::new();
        for _ in 0..SWEEPS {
            if stretched.is_empty() {
                return;
            }
            moved.clear();
            for (triangle, bound) in stretched {
                // What was stretched farther at the start is not stretched on; what was not gets a little more room than it needs.
                let is_new = bound.at_start <= triangle.largest;
                let target = if is_new { triangle.target } else { bound.at_start.sqrt() };
                let corners = triangle.particles.map(|i| end[i as usize]);
                let inverse_masses = triangle.particles.map(|i| match is_held(i) {
                    true => T::ZERO,
                    false => self.inverse_masses[i as usize],
                });
                let shift = correction(corners, inverse_masses, &triangle.rest, target);
                for (i, shift) in triangle.particles.into_iter().zip(shift.into_iter().flatten()) {
                    if shift != [T::ZERO; 3] {
                        end[i as usize] = plus(end[i as usize], T::ONE, shift);
                        marked[i as usize] = true;
                        moved.extend_from_slice(self.of_particle(i));
                    }
                }
            }
            // What has not moved is as long as before.
            moved.sort_unstable();
            moved.dedup();
            let all = moved.par_iter().with_min_len(TASK);
            let all = all.map(|&triangle| &self.triangles[triangle as usize]);
            let end = &*end;
            let found = all.filter_map(|one| exceeded(one, end).map(|bound| (one, bound)));
            stretched = found.collect();
        }
    }

    /// The triangles of a particle.
    fn of_particle(&self, particle: u32) -> &[u32] {
        let i = particle as usize;
        &self.of_particles[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// The particles of triangles that end beyond their largest stretch, in order, and which share of their ways they may go.
    pub(super) fn shares(
        &self,
        start: &[[T; 3]],
        end: &[[T; 3]],
        is_held: &(impl Fn(u32) -> bool + Sync),
    ) -> Vec<([u32; 3], T)> {
        let shares = self
            .all(|triangle| triangle.share(&|i| start[i as usize], &|i| end[i as usize], is_held));
        shares.into_iter().map(|(triangle, share)| (triangle.particles, share)).collect()
    }

    /// What there is of triangles, in their order.
    fn all<V: Send>(
        &self,
        of: impl Fn(&Bounded<T>) -> Option<V> + Sync + Send,
    ) -> Vec<(&Bounded<T>, V)> {
        let all = self.triangles.par_iter().with_min_len(TASK);
        all.filter_map(|triangle| of(triangle).map(|value| (triangle, value))).collect()
    }
}

impl<T: Real> Bounded<T> {
    /// What the triangle exceeds at the end of these ways, if it does.
    #[inline(always)]
    fn exceeded(
        &self,
        start: &impl Fn(u32) -> [T; 3],
        end: &impl Fn(u32) -> [T; 3],
    ) -> Option<Exceeded<T>> {
        let rounding = T::ONE + T::from_f64(ROUNDING) * T::EPSILON;
        let at_end = self.square(self.particles.map(end));
        // What is not finite is for others to say.
        if !at_end.is_finite() || at_end <= rounding * self.largest {
            return None;
        }
        let at_start = self.square(self.particles.map(start));
        let bound = rounding * self.largest.maximum(at_start);
        (at_end > bound).then_some(Exceeded { bound, at_start })
    }

    /// Which share of their ways the particles may go, if it is not all: until the triangle is stretched as far as it may be, or as it is at the start
    /// where that is more. What is prescribed stretches as far as it will.
    #[inline(always)]
    fn share(
        &self,
        start: &impl Fn(u32) -> [T; 3],
        end: &impl Fn(u32) -> [T; 3],
        is_held: &impl Fn(u32) -> bool,
    ) -> Option<T> {
        let Exceeded { bound, .. } = self.exceeded(start, end)?;
        let [from, to] = [self.particles.map(start), self.particles.map(end)];
        let moves_by_itself = |k: usize| from[k] != to[k] && is_held(self.particles[k]);
        if (0..3).any(moves_by_itself) {
            return None;
        }
        // The square is convex along the way: it is beyond the bound from some place on.
        let (mut low, mut high) = (T::ZERO, T::ONE);
        for _ in 0..HALVINGS {
            let middle = T::from_f64(0.5) * (low + high);
            let at = std::array::from_fn(|k| along(from[k], to[k], middle));
            if self.square(at) <= bound {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(low)
    }

    /// The square of the largest stretch of the triangle with these corners: the largest eigenvalue of F^T F.
    #[inline(always)]
    fn square(&self, corners: [[T; 3]; 3]) -> T {
        let [f_u, f_v] = deformation(corners, &self.rest);
        let [c11, c22, c12] = [dot(f_u, f_u), dot(f_v, f_v), dot(f_u, f_v)];
        let half = T::from_f64(0.5);
        let (mean, apart) = (half * (c11 + c22), half * (c11 - c22));
        mean + (apart * apart + c12 * c12).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::sheet;

    const LIMIT: f64 = 1.05;

    /// Places of the particles once those of one half have gone a way, the others none.
    fn torn(model: &Model, way: f64) -> [Vec<[f64; 3]>; 2] {
        let start = model.positions().to_vec();
        let moved = |x: &[f64; 3]| [x[0] + if x[0] > 1e-3 { way } else { 0.0 }, x[1], x[2]];
        let end = start.iter().map(moved).collect();
        [start, end]
    }

    fn largest(bounds: &StretchBounds<f64>, at: &[[f64; 3]]) -> f64 {
        let square =
            |triangle: &Bounded<f64>| triangle.square(triangle.particles.map(|i| at[i as usize]));
        bounds.triangles.iter().map(square).fold(0.0, f64::max).sqrt()
    }

    #[test]
    fn sweeps_keep_momentum() {
        let model = sheet(5, LIMIT);
        let bounds = StretchBounds::<f64>::new(&model);
        let [start, mut end] = torn(&model, 0.01);
        let before = largest(&bounds, &end);
        let mut marked = vec![false; start.len()];
        let momentum =
            |at: &[[f64; 3]]| -> f64 { at.iter().zip(model.masses()).map(|(x, m)| m * x[0]).sum() };
        let wanted = end.clone();
        bounds.shorten(&start, &mut end, |_| false, &mut marked);
        assert!(before > 1.4 && largest(&bounds, &end) < LIMIT + 1e-6);
        assert!((momentum(&end) - momentum(&wanted)).abs() < 1e-12);
        for (i, marked) in marked.into_iter().enumerate() {
            assert_eq!(marked, end[i] != wanted[i], "{i}");
        }
    }

    #[test]
    fn a_share_of_the_ways_is_within_the_limit() {
        let model = sheet(5, LIMIT);
        let bounds = StretchBounds::<f64>::new(&model);
        let [start, end] = torn(&model, 0.01);
        let shares = bounds.shares(&start, &end, &|_| false);
        assert!(!shares.is_empty());
        for &(particles, share) in &shares {
            let at = particles.map(|i| along(start[i as usize], end[i as usize], share));
            let on = particles.map(|i| along(start[i as usize], end[i as usize], share + 1e-3));
            let triangle = bounds.triangles.iter().find(|one| one.particles == particles).unwrap();
            assert!(triangle.square(at).sqrt() <= LIMIT + 1e-9);
            assert!(triangle.square(on).sqrt() > LIMIT, "it could go on");
        }
        // What a pin takes along stretches as it will, and is no reason to hold the others.
        let held = |i: u32| start[i as usize] != end[i as usize];
        assert!(bounds.shares(&start, &end, &held).is_empty());
    }

    #[test]
    fn without_a_limit_there_are_no_bounds() {
        assert!(StretchBounds::<f64>::new(&sheet(5, f64::INFINITY)).is_empty());
    }
}
