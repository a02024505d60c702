//! `contact_pairs`: the list of pairs that can touch or meet, and the proof that it is complete.

use std::sync::atomic::AtomicU64;

use cloth_core::{
    Error, Real, Result,
    contact::{ContactStencil, ContactSurface, PairSearch, UnprovenPair, Ways},
};
use rayon::prelude::*;

use super::{
    bounds::{Ends, Padded, ends, padded},
    groups::Groups,
    near::NearTask,
    proofs::ProofTask,
    search::{Search, SearchTask},
};

/// Groups whose pairs are one run.
const RUN: usize = 8;

/// Pairs of a list at most: some 8 GB.
pub(super) const PAIRS_MAX: u64 = 1 << 28;

/// What the list reaches beyond the distance of contact, relative to it.
const SKIN: f64 = 1.0;

/// What rounding may do to the proof, relative to the reach of the list.
const ROUNDING: f64 = 1e-3;

/// All pairs of features, less those whose boxes are `reach` or more apart along the same axis at two sets of positions.
#[derive(Debug)]
pub(super) struct PairList<T> {
    runs: Vec<Run>,
    /// The sets of positions \[m\]; none before the first.
    references: [Vec<[T; 3]>; 2],
    /// Positions of the present search.
    padded: Vec<Padded<T>>,
    reach: T,
    pub(super) rebuilds: u32,
}

/// Pairs of a vertex and a triangle, then pairs of edges: apart, so that loops over them do not branch.
#[derive(Clone, Debug, Default)]
pub(super) struct Run {
    pub(super) vertex_triangle: Vec<UnprovenPair>,
    pub(super) edge_edge: Vec<UnprovenPair>,
}

impl Run {
    pub(super) fn len(&self) -> u64 {
        (self.vertex_triangle.len() + self.edge_edge.len()) as u64
    }

    fn clear(&mut self) {
        self.vertex_triangle.clear();
        self.edge_edge.clear();
    }
}

impl<T: Real> PairList<T> {
    pub(super) fn new(distance: f64) -> Self {
        Self {
            runs: Vec::new(),
            references: [Vec::new(), Vec::new()],
            padded: Vec::new(),
            reach: T::from_f64((1.0 + SKIN) * distance),
            rebuilds: 0,
        }
    }

    pub(super) fn len(&self) -> u64 {
        self.runs.iter().map(Run::len).sum()
    }

    /// Whether no pair is missing whose features are `distance` or less apart at these positions along all axes.
    ///
    /// A pair that is missing was `reach` apart along an axis at both sets of positions. Say that since one of these all particles have moved by
    /// c, and each by at most e along each axis beside that: it is reach - 2 e apart.
    pub(super) fn holds(&self, positions: &[[T; 3]], distance: T) -> bool {
        if self.references[0].len() != positions.len() {
            return false;
        }
        let room = (T::ONE - T::from_f64(ROUNDING)) * self.reach - distance;
        let [first, second] = &self.references;
        let moved = positions.par_iter().zip(first).zip(second).with_min_len(4096);
        let moved = moved.fold(Moved::new, |moved, ((x, a), b)| moved.with(x, a, b));
        let moved = moved.reduce(Moved::new, Moved::join);
        moved.wide(0) <= room || moved.wide(1) <= room
    }

    /// Builds the list for two sets of positions, also given vertex by vertex, and all that are the same share of the way from one to the other. With marks, pairs
    /// without a marked particle are left out: such a list holds for nothing else.
    pub(super) fn build(
        &mut self,
        (surface, [cloths, bodies]): (&ContactSurface, &mut [Groups<T>; 2]),
        (sets, vertices): ([&[[T; 3]]; 2], &[Ends<T>]),
        marked: Option<&[bool]>,
        arch: pulp::Arch,
    ) -> Result<()> {
        for (reference, set) in self.references.iter_mut().zip(sets) {
            reference.clear();
            reference.extend_from_slice(set);
        }
        let reach = self.reach;
        for groups in [&mut *cloths, &mut *bodies] {
            groups.refit(surface, vertices, arch);
            groups.mark(surface, marked);
        }
        let (cloths, bodies, total) = (&*cloths, &*bodies, AtomicU64::new(0));
        let search = Search { surface, cloths, bodies, vertices, marked, reach, total };
        self.runs.resize_with(cloths.len().div_ceil(RUN), Run::default);
        self.runs.par_iter_mut().enumerate().for_each(|(number, run)| {
            run.clear();
            let groups = number * RUN..((number + 1) * RUN).min(cloths.len());
            arch.dispatch(SearchTask { search: &search, groups, run });
        });
        let total = search.total;
        self.rebuilds += 1;
        let needed = total.into_inner();
        if needed > PAIRS_MAX {
            self.references[0].clear();
            return Err(Error::Overflow {
                buffer: "pairs of triangles that may touch",
                needed,
                capacity: PAIRS_MAX,
            });
        }
        Ok(())
    }

    /// The contacts among the pairs.
    pub(super) fn contacts(
        &mut self,
        surface: &ContactSurface,
        x: &[[T; 3]],
        arch: pulp::Arch,
    ) -> Vec<Option<ContactStencil<T>>> {
        let distance = T::from_f64(surface.reach());
        pad(x, &mut self.padded);
        let padded = &*self.padded;
        let found = self.runs.par_iter().flat_map_iter(|run| {
            let near = arch.dispatch(NearTask { run, places: x, padded, reach: distance });
            let contact = |pair: UnprovenPair| surface.contact(pair.candidate, |i| x[i as usize]);
            near.into_iter().map(contact).filter(Option::is_some)
        });
        found.collect()
    }

    pub(super) fn pairs(&self) -> impl Iterator<Item = &UnprovenPair> {
        self.runs.iter().flat_map(|run| run.vertex_triangle.iter().chain(&run.edge_edge))
    }
}

/// How particles have moved since both sets of positions.
#[derive(Clone, Copy)]
struct Moved<T> {
    low: [[T; 3]; 2],
    high: [[T; 3]; 2],
}

impl<T: Real> Moved<T> {
    fn new() -> Self {
        let (low, high) = ([[T::INFINITY; 3]; 2], [[-T::INFINITY; 3]; 2]);
        Self { low, high }
    }

    #[inline(always)]
    fn with(mut self, x: &[T; 3], a: &[T; 3], b: &[T; 3]) -> Self {
        for axis in 0..3 {
            for (set, reference) in [a, b].into_iter().enumerate() {
                let way = x[axis] - reference[axis];
                self.low[set][axis] = self.low[set][axis].minimum(way);
                self.high[set][axis] = self.high[set][axis].maximum(way);
            }
        }
        self
    }

    fn join(mut self, other: Self) -> Self {
        for set in 0..2 {
            for axis in 0..3 {
                self.low[set][axis] = self.low[set][axis].minimum(other.low[set][axis]);
                self.high[set][axis] = self.high[set][axis].maximum(other.high[set][axis]);
            }
        }
        self
    }

    /// The longest side of the box around the ways since a set: twice what particles have moved beside their common motion.
    fn wide(&self, set: usize) -> T {
        let side = |axis: usize| self.high[set][axis] - self.low[set][axis];
        side(0).maximum(side(1)).maximum(side(2))
    }
}

fn pad<T: Real>(places: &[[T; 3]], out: &mut Vec<Padded<T>>) {
    out.clear();
    out.extend(places.iter().map(|&place| padded(place)));
}

/// Both places of each vertex.
pub(super) fn ways_read<T: Real>([from, to]: [&[[T; 3]]; 2], out: &mut Vec<Ends<T>>) {
    out.clear();
    out.extend(from.iter().zip(to).map(|(&a, &b)| ends(a, b)));
}

/// The list as a search that builds it when it does not hold.
pub(super) struct ListSearch<'a, T> {
    pub(super) surface: &'a ContactSurface,
    pub(super) groups: &'a mut [Groups<T>; 2],
    pub(super) list: &'a mut PairList<T>,
    /// A list of the pairs of marked particles alone.
    pub(super) marked_list: &'a mut PairList<T>,
    /// For the ways, vertex by vertex.
    pub(super) ends: &'a mut Vec<Ends<T>>,
    pub(super) arch: pulp::Arch,
}

impl<T: Real> PairSearch<T> for ListSearch<'_, T> {
    fn unproven(
        &mut self,
        ways: &Ways<'_, T>,
        marked: Option<&[bool]>,
        out: &mut Vec<UnprovenPair>,
    ) -> Result<()> {
        let Ways { start, end, delta, .. } = *ways;
        let distance = delta + delta;
        ways_read([start, end], self.ends);
        let ends = &**self.ends;
        let mut list = &mut *self.list;
        if !(list.holds(start, distance) && list.holds(end, distance)) {
            if marked.is_some() {
                // The next round will have other marks, and nobody asks such a list for contacts.
                list = &mut *self.marked_list;
                list.reach = distance;
            }
            let sets = ([start, end], ends);
            list.build((self.surface, self.groups), sets, marked, self.arch)?;
        }
        let runs = &list.runs;
        let (ways, arch) = (*ways, self.arch);
        let found = runs
            .par_iter()
            .flat_map_iter(|run| arch.dispatch(ProofTask { run, ways, ends, marked }));
        out.par_extend(found);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use cloth_core::{
        Cloth, Collider, ColliderShape, ContactResponse, Geometry, GridPatch, MaterialPreset,
        ModelBuilder, Pose, SelfContact,
        contact::{BodyMotion, Candidate},
    };

    use super::{super::bounds::Bounds, *};

    /// A number in [-1, 1), the same on every run.
    fn number(seed: &mut u64) -> f64 {
        *seed =
            seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Around the ways of the first feature, and those of the second.
    fn boxes(
        surface: &ContactSurface,
        candidate: Candidate,
        sets: [&[[f64; 3]]; 2],
    ) -> [Bounds<f64, 8>; 2] {
        let way = |i: u32| ends(sets[0][i as usize], sets[1][i as usize]);
        let [a, b, c, d] = surface.particles(candidate).map(way);
        match candidate {
            Candidate::VertexTriangle(_) => [Bounds::around([a]), Bounds::around([b, c, d])],
            Candidate::EdgeEdge(_) => [Bounds::around([a, b]), Bounds::around([c, d])],
        }
    }

    #[test]
    fn the_list_is_that_of_all_pairs_and_says_how_long_it_holds() {
        let distance = 0.01;
        let response = ContactResponse::Triangles { friction: 0.0 };
        let contact = SelfContact { distance, response };
        let mut builder = ModelBuilder::new().self_contact(contact);
        for name in ["a", "b"] {
            builder = builder.cloth(Cloth {
                name: name.into(),
                geometry: Geometry::Grid(GridPatch::horizontal(8, 0.02, 0.0)),
                material: MaterialPreset::JERSEY.material(0.02).into(),
                pins: vec![],
                velocity: [0.0; 3],
            });
        }
        for name in ["c", "d"] {
            builder = builder.collider(Collider {
                name: name.into(),
                shape: ColliderShape::Box { half_extents: [0.02, 0.03, 0.01] },
                pose: Pose::from_translation([0.02, 0.01, 0.0]),
                friction: 0.0,
                restitution: 0.0,
            });
        }
        let model = builder.build().unwrap();
        let surface = ContactSurface::new(&model, &contact);
        let mut groups = [Groups::of_cloths(&surface), Groups::of_bodies(&surface)];
        let mut list = PairList::<f64>::new(distance);
        let mut start = model.positions().to_vec();
        start.extend(BodyMotion::<f64>::new(&model).start());
        let mut seed = 1;
        for size in [0.0, 1e-3, 0.03, 0.3] {
            let mut shaken = |size: f64, from: &[[f64; 3]]| -> Vec<[f64; 3]> {
                from.iter().map(|x| x.map(|c| c + size * number(&mut seed))).collect()
            };
            let from = shaken(size, &start);
            let to = shaken(0.5 * size, &from);
            let mut ways = Vec::new();
            ways_read([&from, &to], &mut ways);
            let sets: ([&[[f64; 3]]; 2], &[_]) = ([&from, &to], &ways);
            list.build((&surface, &mut groups), sets, None, pulp::Arch::new()).unwrap();
            let mut found: Vec<_> = list.pairs().map(|pair| pair.candidate).collect();
            found.sort_unstable();
            let reach = list.reach;
            let expected: Vec<_> = (surface.candidates())
                .filter(|&candidate| {
                    let [a, b] = boxes(&surface, candidate, [&from, &to]);
                    !a.is_apart(&b, reach)
                })
                .collect();
            assert_eq!(found, expected, "{size}");
            // With marks it is those of marked particles.
            let marked: Vec<_> = (0..from.len()).map(|i| i % 11 == 3).collect();
            let mut few = PairList::<f64>::new(distance);
            few.build((&surface, &mut groups), sets, Some(&marked), pulp::Arch::new()).unwrap();
            let mut of_marks: Vec<_> = few.pairs().map(|pair| pair.candidate).collect();
            of_marks.sort_unstable();
            let has_mark = |candidate: &&Candidate| {
                surface.particles(**candidate).iter().any(|&i| marked[i as usize])
            };
            let expected: Vec<_> = expected.iter().filter(has_mark).copied().collect();
            assert!(!of_marks.is_empty() && of_marks.len() < found.len());
            assert_eq!(of_marks, expected, "{size}, marked");
            // As long as the list says that it holds, whoever is missing is apart.
            for moved in [1e-3, 4e-3, 0.01] {
                let now: Vec<_> =
                    shaken(moved, &to).iter().map(|x| [x[0] + 0.7, x[1], x[2] - 0.4]).collect();
                if list.holds(&now, distance) {
                    let missing = surface.candidates().filter(|c| found.binary_search(c).is_err());
                    for candidate in missing {
                        let [a, b] = boxes(&surface, candidate, [&now, &now]);
                        assert!(a.is_apart(&b, distance), "{candidate:?}");
                    }
                }
                assert_eq!(list.holds(&now, distance), moved < 5e-3, "{moved}");
            }
        }
    }
}
