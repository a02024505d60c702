//! Particles in small groups that stay together.

use cloth_core::{Model, NONE, Real};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::bounds::Bounds;
use crate::memory::VectorField;

/// Particles in a group: one AVX register of f32.
pub(super) const GROUP: usize = 8;

/// Groups in a cluster, the unit of tasks and of the bound on motion.
pub(super) const CLUSTER: usize = 32;

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
    clusters: Vec<ClusterBounds<T>>,
}

/// Boxes around a cluster.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClusterBounds<T> {
    /// Around its particles.
    pub(super) position: Bounds<T>,
    /// Around the displacements of its particles since a reference.
    pub(super) displacement: Bounds<T>,
}

impl<T: Real> Groups<T> {
    pub(super) fn new(model: &Model, with_rest: bool) -> Self {
        let order = sorted_order(model);
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
        let empty = ClusterBounds { position: Bounds::empty(), displacement: Bounds::empty() };
        Self {
            position: blank(),
            rest,
            bounds: vec![Bounds::empty(); group_count],
            clusters: vec![empty; group_count.div_ceil(CLUSTER)],
            order,
            places,
        }
    }

    /// Reads positions, and computes all boxes; displacements are taken from `reference`, positions
    /// by place, if there is one.
    pub(super) fn refit(
        &mut self,
        position: &VectorField<T>,
        reference: Option<&[Vec<T>; 3]>,
        arch: pulp::Arch,
    ) {
        let margin = position.margin();
        let source = position.padded();
        let order = &self.order;
        let [x, y, z] = &mut self.position;
        (
            x.par_chunks_mut(CLUSTER_PARTICLES),
            y.par_chunks_mut(CLUSTER_PARTICLES),
            z.par_chunks_mut(CLUSTER_PARTICLES),
            self.bounds.par_chunks_mut(CLUSTER),
            &mut self.clusters,
        )
            .into_par_iter()
            .enumerate()
            .for_each(|(c, (x, y, z, bounds, cluster))| {
                let first = c * CLUSTER_PARTICLES;
                let end = first + x.len();
                arch.dispatch(RefitTask {
                    order: &order[first..end],
                    source,
                    margin,
                    reference: reference
                        .map(|reference| reference.each_ref().map(|r| &r[first..end])),
                    position: [x, y, z],
                    bounds,
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

    pub(super) fn positions(&self) -> &[Vec<T>; 3] {
        &self.position
    }

    /// Positions of the particles of a group.
    #[inline(always)]
    pub(super) fn group(&self, group: usize) -> [&[T; GROUP]; 3] {
        let [x, y, z] = &self.position;
        [group_of(x, group), group_of(y, group), group_of(z, group)]
    }

    /// Square of the distance of two places at rest, where it matters.
    #[inline(always)]
    pub(super) fn rest_distance_squared(&self, a: usize, b: usize) -> Option<T> {
        self.rest.as_ref().map(|rest| {
            let [x, y, z] = rest.each_ref().map(|component| component[a] - component[b]);
            x * x + y * y + z * z
        })
    }

    pub(super) fn bounds(&self) -> &[Bounds<T>] {
        &self.bounds
    }

    pub(super) fn clusters(&self) -> &[ClusterBounds<T>] {
        &self.clusters
    }

    pub(super) fn group_count(&self) -> usize {
        self.bounds.len()
    }

    pub(super) fn cluster_count(&self) -> usize {
        self.clusters.len()
    }

    pub(super) fn place_count(&self) -> usize {
        self.order.len()
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
    reference: Option<[&'a [T]; 3]>,
    position: [&'a mut [T]; 3],
    bounds: &'a mut [Bounds<T>],
    cluster: &'a mut ClusterBounds<T>,
}

impl<T: Real> NullaryFnOnce for RefitTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let [x, y, z] = self.position;
        for (place, &particle) in self.order.iter().enumerate() {
            if particle != NONE {
                let at = self.margin + particle as usize;
                x[place] = self.source[0][at];
                y[place] = self.source[1][at];
                z[place] = self.source[2][at];
            }
        }
        let mut all = Bounds::empty();
        for (g, bounds) in self.bounds.iter_mut().enumerate() {
            let mut own = Bounds::empty();
            for place in g * GROUP..(g + 1) * GROUP {
                own.insert([x[place], y[place], z[place]]);
            }
            all.merge(&own);
            *bounds = own;
        }
        self.cluster.position = all;
        // Bounds of a whole cluster by lanes first: independent minima hide each other's latency.
        let mut lanes = [Bounds::empty(); GROUP];
        if let Some([rx, ry, rz]) = self.reference {
            for first in (0..x.len()).step_by(GROUP) {
                for (lane, bounds) in lanes.iter_mut().enumerate() {
                    let place = first + lane;
                    bounds.insert([
                        x[place] - rx[place],
                        y[place] - ry[place],
                        z[place] - rz[place],
                    ]);
                }
            }
        }
        self.cluster.displacement = Bounds::empty();
        for bounds in &lanes {
            self.cluster.displacement.merge(bounds);
        }
    }
}

/// Particles of each cloth sorted by recursive bisection across the longest side of their rest
/// positions, down to groups; each cloth filled up to whole groups.
fn sorted_order(model: &Model) -> Vec<u32> {
    let mut order = Vec::new();
    for cloth in model.cloths() {
        let start = order.len();
        order.extend(cloth.particles.clone());
        bisect(model.positions(), &mut order[start..]);
        order.resize(order.len().next_multiple_of(GROUP), NONE);
    }
    order
}

fn bisect(positions: &[[f64; 3]], particles: &mut [u32]) {
    if particles.len() <= GROUP {
        return;
    }
    let mut bounds = Bounds::<f64>::empty();
    for &particle in particles.iter() {
        bounds.insert(positions[particle as usize]);
    }
    let side = |axis: usize| bounds.high[axis] - bounds.low[axis];
    let axis =
        (1..3).fold(0, |longest, axis| if side(axis) > side(longest) { axis } else { longest });
    let middle = (particles.len() / 2).next_multiple_of(GROUP);
    particles.select_nth_unstable_by(middle.min(particles.len() - 1), |&a, &b| {
        let key = |particle: u32| positions[particle as usize][axis];
        key(a).total_cmp(&key(b)).then(a.cmp(&b))
    });
    let (low, high) = particles.split_at_mut(middle.min(particles.len()));
    bisect(positions, low);
    bisect(positions, high);
}
