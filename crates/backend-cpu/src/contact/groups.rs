//! Particles in small groups that stay together.

use cloth_core::{Model, NONE, Real};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::bounds::{Bounds, BoundsByLane};
use crate::memory::{LANES, VectorField};

/// Particles in a group.
pub(super) const GROUP: usize = LANES;

/// Groups in a cluster, the unit of tasks and of the bound on motion.
pub(super) const CLUSTER: usize = 16;

/// Particles in a cluster.
pub(super) const CLUSTER_PARTICLES: usize = GROUP * CLUSTER;

/// The particles of all cloths, sorted into groups, with their positions and boxes.
#[derive(Debug)]
pub(super) struct Groups<T> {
    /// The particle at each place, [`NONE`] where a group is not full.
    order: Vec<u32>,
    /// The place of each particle.
    places: Vec<u32>,
    /// Positions by place; NaN where there is no particle, so that no comparison holds there.
    position: [Vec<T>; 3],
    /// Rest positions by place, where pairs that start close are left out.
    rest: Option<[Vec<T>; 3]>,
    bounds: Vec<Bounds<T>>,
    /// Displacements of the particles of each group since the last refit.
    steps: Vec<Step<T>>,
    clusters: Vec<ClusterBounds<T>>,
}

/// A ball around the displacements \[m\] of the particles of a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<T> {
    centre: [T; 3],
    radius: T,
}

impl<T: Real> Step<T> {
    /// The ball around a box.
    #[inline(always)]
    pub(super) fn around(bounds: &Bounds<T>) -> Self {
        let half = T::from_f64(0.5);
        let mut centre = [T::ZERO; 3];
        let mut sides = [T::ZERO; 3];
        for axis in 0..3 {
            centre[axis] = half * (bounds.low[axis] + bounds.high[axis]);
            sides[axis] = bounds.high[axis] - bounds.low[axis];
        }
        let diagonal = (sides[0] * sides[0] + sides[1] * sides[1] + sides[2] * sides[2]).sqrt();
        Self { centre, radius: half * diagonal }
    }

    /// A box around the ball.
    pub(super) fn bounds(&self) -> Bounds<T> {
        Bounds {
            low: self.centre.map(|value| value - self.radius),
            high: self.centre.map(|value| value + self.radius),
        }
    }

    /// A ball around the displacements of a group. NaN if the group is not full, which only means
    /// that it is never taken for unmoved.
    #[inline(always)]
    fn between(before: [&[T; GROUP]; 3], now: [&[T; GROUP]; 3]) -> Self {
        let mut moved = [[T::ZERO; GROUP]; 3];
        let mut centre = [T::ZERO; 3];
        for axis in 0..3 {
            for lane in 0..GROUP {
                moved[axis][lane] = now[axis][lane] - before[axis][lane];
            }
            let [a, b] = [moved[axis][0], moved[axis][GROUP - 1]];
            centre[axis] = T::from_f64(0.5) * (a + b);
        }
        let mut squares = [T::ZERO; GROUP];
        for lane in 0..GROUP {
            let dx = moved[0][lane] - centre[0];
            let dy = moved[1][lane] - centre[1];
            let dz = moved[2][lane] - centre[2];
            squares[lane] = dx * dx + dy * dy + dz * dz;
        }
        let mut width = GROUP / 2;
        while width > 0 {
            for lane in 0..width {
                squares[lane] = squares[lane].maximum(squares[lane + width]);
            }
            width /= 2;
        }
        Self { centre, radius: squares[0].sqrt() }
    }

    /// The most by which a particle of one group can have come closer to one of the other.
    #[inline(always)]
    pub(super) fn approach(&self, other: &Self) -> T {
        let dx = self.centre[0] - other.centre[0];
        let dy = self.centre[1] - other.centre[1];
        let dz = self.centre[2] - other.centre[2];
        (dx * dx + dy * dy + dz * dz).sqrt() + (self.radius + other.radius)
    }
}

/// Where a cluster is and how it moved.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClusterBounds<T> {
    /// Around its particles.
    pub(super) position: Bounds<T>,
    /// Around their displacements since the last refit.
    pub(super) step: Step<T>,
}

impl<T: Real> Groups<T> {
    pub(super) fn new(model: &Model, with_rest: bool) -> Self {
        let order = model.particle_groups(GROUP);
        let mut places = vec![0; model.particle_count()];
        for (place, &particle) in order.iter().enumerate().filter(|(_, p)| **p != NONE) {
            places[particle as usize] = place as u32;
        }
        let nan = T::from_f64(f64::NAN);
        let blank = || std::array::from_fn(|_| vec![nan; order.len()]);
        let rest = with_rest.then(|| {
            let mut rest: [Vec<T>; 3] = blank();
            for (place, &particle) in order.iter().enumerate().filter(|(_, p)| **p != NONE) {
                for (axis, component) in rest.iter_mut().enumerate() {
                    component[place] = T::from_f64(model.positions()[particle as usize][axis]);
                }
            }
            rest
        });
        let group_count = order.len() / GROUP;
        let still = Step { centre: [T::ZERO; 3], radius: T::ZERO };
        let empty = ClusterBounds { position: Bounds::empty(), step: still };
        Self {
            position: blank(),
            rest,
            bounds: vec![Bounds::empty(); group_count],
            steps: vec![still; group_count],
            clusters: vec![empty; group_count.div_ceil(CLUSTER)],
            order,
            places,
        }
    }

    /// Reads positions, and computes all boxes and displacements.
    pub(super) fn refit(&mut self, position: &VectorField<T>, arch: pulp::Arch) {
        let margin = position.margin();
        let source = position.padded();
        let order = &self.order;
        let [x, y, z] = &mut self.position;
        (
            x.par_chunks_mut(CLUSTER_PARTICLES),
            y.par_chunks_mut(CLUSTER_PARTICLES),
            z.par_chunks_mut(CLUSTER_PARTICLES),
            self.bounds.par_chunks_mut(CLUSTER),
            self.steps.par_chunks_mut(CLUSTER),
            &mut self.clusters,
        )
            .into_par_iter()
            .enumerate()
            .for_each(|(c, (x, y, z, bounds, steps, cluster))| {
                let first = c * CLUSTER_PARTICLES;
                let end = first + x.len();
                arch.dispatch(RefitTask {
                    order: &order[first..end],
                    source,
                    margin,
                    position: [x, y, z],
                    bounds,
                    steps,
                    cluster,
                });
            });
    }

    #[inline(always)]
    pub(super) fn place(&self, particle: usize) -> usize {
        self.places[particle] as usize
    }

    /// The particle at a place, or [`NONE`].
    #[inline(always)]
    pub(super) fn particle(&self, place: usize) -> u32 {
        self.order[place]
    }

    /// Positions of the particles of a group.
    #[inline(always)]
    pub(super) fn group(&self, group: usize) -> [&[T; GROUP]; 3] {
        let [x, y, z] = &self.position;
        [group_of(x, group), group_of(y, group), group_of(z, group)]
    }

    /// Rest positions of the particles of a group, where they matter.
    #[inline(always)]
    pub(super) fn group_at_rest(&self, group: usize) -> Option<[&[T; GROUP]; 3]> {
        let [x, y, z] = self.rest.as_ref()?;
        Some([group_of(x, group), group_of(y, group), group_of(z, group)])
    }

    /// Whether pairs that are close at rest are left out.
    pub(super) fn has_rest(&self) -> bool {
        self.rest.is_some()
    }

    pub(super) fn bounds(&self) -> &[Bounds<T>] {
        &self.bounds
    }

    pub(super) fn steps(&self) -> &[Step<T>] {
        &self.steps
    }

    pub(super) fn clusters(&self) -> &[ClusterBounds<T>] {
        &self.clusters
    }

    pub(super) fn particle_count(&self) -> usize {
        self.places.len()
    }

    pub(super) fn cluster_count(&self) -> usize {
        self.clusters.len()
    }
}

#[inline(always)]
fn group_of<T>(values: &[T], group: usize) -> &[T; GROUP] {
    match values[group * GROUP..].first_chunk() {
        Some(values) => values,
        None => unreachable!("arrays by place hold whole groups"),
    }
}

/// New positions and boxes of one cluster.
struct RefitTask<'a, T> {
    order: &'a [u32],
    source: [&'a [T]; 3],
    margin: usize,
    position: [&'a mut [T]; 3],
    bounds: &'a mut [Bounds<T>],
    steps: &'a mut [Step<T>],
    cluster: &'a mut ClusterBounds<T>,
}

impl<T: Real> NullaryFnOnce for RefitTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let [x, y, z] = self.position;
        // All scattered reads come first: a vector load right after the scalar stores that make up
        // its lanes would have to wait for them.
        let mut before = [[T::ZERO; CLUSTER_PARTICLES]; 3];
        for (before, now) in before.iter_mut().zip([&*x, &*y, &*z]) {
            before[..now.len()].copy_from_slice(now);
        }
        for (place, &particle) in self.order.iter().enumerate() {
            if particle != NONE {
                let at = self.margin + particle as usize;
                x[place] = self.source[0][at];
                y[place] = self.source[1][at];
                z[place] = self.source[2][at];
            }
        }
        let mut all = Bounds::empty();
        let mut displacement = BoundsByLane::empty();
        for (group, bounds) in self.bounds.iter_mut().enumerate() {
            let now = [group_of(x, group), group_of(y, group), group_of(z, group)];
            let mut own = BoundsByLane::empty();
            own.insert(now);
            *bounds = own.reduce();
            all.merge(bounds);
            let [bx, by, bz] = &before;
            let before = [group_of(bx, group), group_of(by, group), group_of(bz, group)];
            self.steps[group] = Step::between(before, now);
            displacement.insert_difference(now, before);
        }
        self.cluster.position = all;
        self.cluster.step = Step::around(&displacement.reduce());
    }
}
