//! `contact_carry` and `contact_certify` (NUMERICS §15): ways are shortened until it is proven that no two features meet.

mod carry;
mod half_spaces;
mod shorten;
mod stretch;

use super::{
    Candidate, Carrier, ContactStencil, ContactSurface, Ghost, certificate_distance,
    ghosts::Ghosts, is_proven, plus, sub,
};
use crate::{Error, Model, Real, Result};
use carry::NO_LEADER;
use half_spaces::HalfSpaces;
use rayon::prelude::*;
use shorten::Bounds;
use std::collections::BTreeSet;
use stretch::StretchBounds;

/// Nodes in a task.
const NODES_OF_TASK: usize = 4096;

/// A pair of which it is not proven that its features do not meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct UnprovenPair {
    /// The pair.
    pub candidate: Candidate,
    /// Its particles.
    pub particles: [u32; 4],
}

impl UnprovenPair {
    fn at<T: Copy>(&self, positions: &[[T; 3]]) -> [[T; 3]; 4] {
        self.particles.map(|particle| positions[particle as usize])
    }

    /// Whether nothing proves that its features do not meet on these ways: the test of all searches. A pair that does not move
    /// stays as it is, which needs no proof but where `is_new` says that it has never had any.
    #[inline(always)]
    #[must_use]
    pub fn is_unproven<T: Real>(
        &self,
        start: &[[T; 3]],
        end: &[[T; 3]],
        (delta, is_new): (T, bool),
    ) -> bool {
        let [from, to] = [self.at(start), self.at(end)];
        (is_new || from != to) && !is_proven(&from, &to, self.candidate.split(), delta)
    }
}

/// Ways on which features might meet.
#[derive(Clone, Copy, Debug)]
pub struct Ways<'a, T> {
    /// Positions of all particles at the start \[m\].
    pub start: &'a [[T; 3]],
    /// Those at the end \[m\].
    pub end: &'a [[T; 3]],
    /// Distance that features are to have at the end \[m\].
    pub delta: T,
    /// Whether pairs that do not move are looked at as well.
    pub is_new: bool,
    /// Whether they are those that were looked at last but for the ends of marked particles.
    pub follows: bool,
}

/// Ways whose ends a certificate changes.
#[derive(Debug)]
pub struct CertifiedWays<'a, T> {
    /// Positions of all particles at the start \[m\].
    pub start: &'a [[T; 3]],
    /// Those at the end \[m\].
    pub end: &'a mut [[T; 3]],
    /// Those at the start of the substep \[m\], if the ways end it: then no triangle of fabric ends stretched beyond its limit, or farther than it
    /// was there. An iterate may be, as its forces tell the next one.
    pub first: Option<&'a [[T; 3]]>,
}

/// Finds pairs that may meet: all that a backend has to know to certify motion.
pub trait PairSearch<T> {
    /// Puts in `out`, in any order, every pair that is unproven on these ways, if one of its particles is marked; all such pairs
    /// without marks. What it does not look at must be apart along an axis of space at both ends, by more than delta at the last one.
    ///
    /// # Errors
    /// `Overflow` if there are more pairs than can be counted.
    fn unproven(
        &mut self,
        ways: &Ways<'_, T>,
        marked: Option<&[bool]>,
        out: &mut Vec<UnprovenPair>,
    ) -> Result<()>;
}

/// Proves that no two features meet in a substep, and shortens the ways of particles where there is no proof.
///
/// Without exempt pairs, and with a search that leaves out nothing, every state that it leaves has no more pairs of triangles that go
/// through each other than the first one.
#[derive(Clone, Debug)]
pub struct Certifier<T> {
    /// Pairs that have never been apart, ascending.
    exempt: Vec<Candidate>,
    /// Whether positions were given from outside since the last substep.
    is_new: bool,
    /// Which share of its way each particle goes.
    shares: Vec<T>,
    marked: Vec<bool>,
    /// Which particles have changed since the pairs were last looked at.
    changed: Vec<bool>,
    /// Where particles are once prescribed ways are gone.
    carried: Vec<[T; 3]>,
    /// Where particles were to end, before all that was done about it, and before ways were last shortened.
    wanted: Vec<[T; 3]>,
    aims: Vec<[T; 3]>,
    pairs: Vec<UnprovenPair>,
    stretch: StretchBounds<T>,
    half_spaces: HalfSpaces,
    /// Where bodies pinch cloth, it is left inside of them.
    makes_ghosts: bool,
    ghosts: Ghosts,
    /// Pairs of which no particle could make way when prescribed ways were last gone, and the particle that each went along with.
    stuck: Vec<UnprovenPair>,
    leader: Vec<u32>,
    /// For each particle a node of a body that it was stopped by or carried along by in the last substep; empty without bodies.
    bodies: Vec<Option<u32>>,
}

impl<T: Real> Certifier<T> {
    /// For so many particles.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self::with_nodes(count, count)
    }

    /// For so many particles, and so many particles and nodes of bodies together.
    #[must_use]
    pub fn with_nodes(particles: usize, count: usize) -> Self {
        Self {
            bodies: vec![None; if count > particles { particles } else { 0 }],
            exempt: Vec::new(),
            is_new: true,
            makes_ghosts: false,
            ghosts: Ghosts::new(particles),
            stuck: Vec::new(),
            leader: vec![NO_LEADER; count],
            shares: vec![T::ONE; count],
            marked: vec![false; count],
            changed: vec![false; count],
            carried: Vec::new(),
            wanted: Vec::new(),
            aims: Vec::new(),
            pairs: Vec::new(),
            stretch: StretchBounds::default(),
            half_spaces: HalfSpaces::default(),
        }
    }

    /// The same, which takes no triangle of fabric beyond its largest stretch.
    #[must_use]
    pub fn with_stretch_limits(self, model: &Model) -> Self {
        Self { stretch: StretchBounds::new(model), ..self }
    }

    /// The same, which moves nothing into planes.
    #[must_use]
    pub fn with_planes(self, model: &Model, surface: &ContactSurface) -> Self {
        Self { half_spaces: HalfSpaces::new(model, surface), ..self }
    }

    /// The same, which leaves cloth inside of bodies that pinch it.
    #[must_use]
    pub fn with_ghosts(self, makes_ghosts: bool) -> Self {
        Self { makes_ghosts, ..self }
    }

    /// What bodies have pinched, ascending by particle.
    #[must_use]
    pub fn ghosts(&self) -> &[Ghost] {
        self.ghosts.list()
    }

    /// Takes in what bodies have pinched.
    pub fn ghosts_set(&mut self, ghosts: &[Ghost]) {
        self.ghosts.set(ghosts.to_vec());
    }

    /// Leaves the contacts that act: not those of a body with what it has pinched.
    pub fn acting_keep(&self, found: &mut [Option<ContactStencil<T>>]) {
        if !self.ghosts().is_empty() {
            for place in found {
                place.take_if(|stencil| self.ghosts.leave_out_contact(stencil));
            }
        }
    }

    /// `state_keep`.
    pub fn keep(&mut self) {
        self.ghosts.keep();
    }

    /// `state_restore`.
    pub fn restore(&mut self) {
        self.ghosts.restore();
    }

    /// Positions have been given from outside: what goes through each other in them is exempt.
    pub fn positions_given(&mut self) {
        self.is_new = true;
    }

    /// Whether [`Self::certify`] must look at the next ways even where all pairs are proven: there are exempt pairs, or may be.
    #[must_use]
    pub fn must_look(&self) -> bool {
        self.is_new || !self.exempt.is_empty()
    }

    /// Whether a triangle of fabric has a largest stretch, and ends beyond it on these ways, whatever is proven of pairs.
    #[must_use]
    pub fn overstretches(
        &self,
        start: impl Fn(u32) -> [T; 3] + Sync,
        end: impl Fn(u32) -> [T; 3] + Sync,
    ) -> bool {
        self.stretch.is_exceeded(start, end)
    }

    /// Whether [`Self::overstretches`] may ever be so.
    #[must_use]
    pub fn limits_stretch(&self) -> bool {
        !self.stretch.is_empty()
    }

    /// Pairs that are left out of the proof.
    #[must_use]
    pub fn exempt(&self) -> &[Candidate] {
        &self.exempt
    }

    /// A node of a body that has stopped a particle or carried it along in the last substep.
    #[must_use]
    pub fn body_at(&self, particle: usize) -> Option<u32> {
        self.bodies.get(particle).copied().flatten()
    }

    /// Changes `end` \[m\] so that the ways from `start` are proven to be free of meetings, and no triangle is stretched beyond its limit.
    /// `is_held` says whose ways are prescribed and stay as they are. Returns how many others were changed.
    ///
    /// Numbers that are not finite are left to whoever looks for divergence.
    ///
    /// # Errors
    /// `Pinched` if prescribed ways do not leave one for the rest; those of the search.
    pub fn certify(
        &mut self,
        search: &mut impl PairSearch<T>,
        start: &[[T; 3]],
        end: &mut [[T; 3]],
        is_held: impl Fn(u32) -> bool + Sync,
    ) -> Result<u64> {
        let ways = CertifiedWays { start, end, first: Some(start) };
        self.certify_with(search, ways, is_held, &())
    }

    /// The same, where prescribed ways may be those of rigid bodies.
    ///
    /// # Errors
    /// As [`Self::certify`].
    pub fn certify_with(
        &mut self,
        search: &mut impl PairSearch<T>,
        CertifiedWays { start, end, first }: CertifiedWays<'_, T>,
        is_held: impl Fn(u32) -> bool + Sync,
        carrier: &impl Carrier<T>,
    ) -> Result<u64> {
        let Some(largest) = largest_finite(start, end) else { return Ok(0) };
        let delta = certificate_distance(largest);
        self.bodies.fill(None);
        let mut pairs = std::mem::take(&mut self.pairs);
        pairs.clear();
        let ways = Ways { start, end, delta, is_new: self.is_new, follows: false };
        search.unproven(&ways, None, &mut pairs)?;
        pairs.retain(|pair| !self.ghosts.leave_out_pair(pair));
        self.exempt_update(&mut pairs, start);
        let outcome = if pairs.is_empty() && !self.stretches_from(first, end) {
            Ok(0)
        } else {
            let ways = CertifiedWays { start, end, first };
            self.resolve(search, ways, delta, &mut pairs, (is_held, carrier))
        };
        self.pairs = pairs;
        outcome
    }

    /// Takes out the pairs that nothing proves to be apart at the start, as they never have been.
    fn exempt_update(&mut self, pairs: &mut Vec<UnprovenPair>, start: &[[T; 3]]) {
        let (is_new, before) = (std::mem::take(&mut self.is_new), std::mem::take(&mut self.exempt));
        if !is_new && before.is_empty() {
            return;
        }
        pairs.retain(|pair| {
            let from = pair.at(start);
            let was = is_new || before.binary_search(&pair.candidate).is_ok();
            let exempt = was && !is_proven(&from, &from, pair.candidate.split(), T::ZERO);
            if exempt {
                self.exempt.push(pair.candidate);
            }
            !exempt
        });
        self.exempt.sort_unstable();
    }

    fn exempt_remove(&self, pairs: &mut Vec<UnprovenPair>) {
        pairs.retain(|pair| !self.ghosts.leave_out_pair(pair));
        if !self.exempt.is_empty() {
            pairs.retain(|pair| self.exempt.binary_search(&pair.candidate).is_err());
        }
    }

    fn stretches_from(&self, first: Option<&[[T; 3]]>, end: &[[T; 3]]) -> bool {
        first.is_some_and(|first| self.overstretches(|i| first[i as usize], |i| end[i as usize]))
    }

    fn resolve(
        &mut self,
        search: &mut impl PairSearch<T>,
        ways: CertifiedWays<'_, T>,
        delta: T,
        pairs: &mut Vec<UnprovenPair>,
        prescribed: (impl Fn(u32) -> bool + Sync, &impl Carrier<T>),
    ) -> Result<u64> {
        let mut wanted = std::mem::take(&mut self.wanted);
        wanted.clear();
        wanted.extend_from_slice(ways.end);
        let outcome = self.resolve_from(search, (ways, &wanted), delta, pairs, prescribed);
        self.wanted = wanted;
        outcome
    }

    fn resolve_from(
        &mut self,
        search: &mut impl PairSearch<T>,
        (CertifiedWays { start, end, first }, wanted): (CertifiedWays<'_, T>, &[[T; 3]]),
        delta: T,
        pairs: &mut Vec<UnprovenPair>,
        (is_held, carrier): (impl Fn(u32) -> bool + Sync, &impl Carrier<T>),
    ) -> Result<u64> {
        let moves = |i: u32| is_held(i) && start[i as usize] != wanted[i as usize];
        let mut is_in_the_way = pairs.iter().any(|pair| pair.particles.into_iter().any(moves));
        if !is_in_the_way {
            let bounds = first.map_or(Bounds::None, Bounds::Sweeps);
            let shortened = self.shorten(search, (start, end), (delta, bounds), pairs, &is_held);
            // What is stopped can be in the way of what is not.
            is_in_the_way = matches!(shortened, Err(Error::Pinched { .. }));
            if is_in_the_way {
                end.copy_from_slice(wanted);
            } else {
                shortened?;
            }
        }
        if is_in_the_way {
            let ways = CertifiedWays { start, end, first };
            self.resolve_carried(search, ways, delta, pairs, (&is_held, carrier))?;
        }
        if let Some(first) = first
            && self.half_spaces.are_entered(first, wanted, end, (delta, &is_held))
        {
            // What was stopped is where an iterate was, which planes do not keep out: from the start of the substep on they do.
            end.copy_from_slice(wanted);
            let ways = CertifiedWays { start: first, end, first: Some(first) };
            self.resolve_carried(search, ways, delta, pairs, (&is_held, carrier))?;
        }
        if let Some(first) = first
            && self.stretches_from(Some(first), end)
        {
            self.shorten_from_start(search, (first, end), delta, pairs, &is_held)?;
        }
        Ok(wanted.iter().zip(end).filter(|(wanted, end)| wanted != end).count() as u64)
    }

    /// Prescribed ways are gone first, then the rest.
    fn resolve_carried(
        &mut self,
        search: &mut impl PairSearch<T>,
        CertifiedWays { start, end, first }: CertifiedWays<'_, T>,
        delta: T,
        pairs: &mut Vec<UnprovenPair>,
        (is_held, carrier): (&(impl Fn(u32) -> bool + Sync), &impl Carrier<T>),
    ) -> Result<()> {
        self.carry(search, (start, end), delta, (is_held, carrier))?;
        let carried = std::mem::take(&mut self.carried);
        pairs.clear();
        let ways = Ways { start: &carried, end, delta, is_new: false, follows: false };
        let found = search.unproven(&ways, None, pairs);
        self.exempt_remove(pairs);
        let bounds = first.map_or(Bounds::None, Bounds::Sweeps);
        let shortened = found
            .and_then(|()| self.shorten(search, (&carried, end), (delta, bounds), pairs, is_held));
        self.carried = carried;
        shortened
    }
}

/// The largest coordinate of all, if all are finite.
fn largest_finite<T: Real>(start: &[[T; 3]], end: &[[T; 3]]) -> Option<T> {
    let of = |x: &[T; 3]| x.iter().fold(T::ZERO, |largest, x| largest.maximum(x.abs()));
    let is_finite = |x: &[T; 3]| x.iter().all(|x| x.is_finite());
    let ways = start.par_iter().zip(end).with_min_len(NODES_OF_TASK);
    let largest = ways
        .map(|(a, b)| (of(a).maximum(of(b)), is_finite(a) && is_finite(b)))
        .reduce(|| (T::ZERO, true), |a, b| (a.0.maximum(b.0), a.1 && b.1));
    largest.1.then_some(largest.0)
}

/// Notes which body a pair is with, if it is one.
fn body_note(bodies: &mut [Option<u32>], particle: usize, pair: &UnprovenPair) {
    let particles = bodies.len() as u32;
    if let Some(body) = bodies.get_mut(particle) {
        *body = pair.particles.into_iter().find(|&node| node >= particles);
    }
}

/// So much of the way from one point to another, both of which are exact.
fn along<T: Real>(from: [T; 3], to: [T; 3], share: T) -> [T; 3] {
    if share >= T::ONE {
        to
    } else if share <= T::ZERO {
        from
    } else {
        plus(from, share, sub(to, from))
    }
}

fn length<T: Real>(v: [T; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).to_f64()
}

/// What is told of pairs that cannot make way, the first of which is named; `leader` says what each particle goes along with.
fn pinched<T: Real>(pairs: &[UnprovenPair], start: &[[T; 3]], leader: &[u32]) -> Error {
    let (particles, place) = pairs
        .first()
        .map(|pair| (pair.particles, pair.at(start)[0].map(T::to_f64)))
        .unwrap_or_default();
    let mut all = BTreeSet::new();
    for mut particle in pairs.iter().flat_map(|pair| pair.particles) {
        while all.insert(particle) {
            match leader.get(particle as usize) {
                Some(&by) if by != NO_LEADER => particle = by,
                _ => break,
            }
        }
    }
    Error::Pinched { particles, place, all: all.into_iter().collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks at given pairs, and counts how often.
    struct Pairs(Vec<UnprovenPair>, u32);

    impl PairSearch<f64> for Pairs {
        fn unproven(
            &mut self,
            ways: &Ways<'_, f64>,
            marked: Option<&[bool]>,
            out: &mut Vec<UnprovenPair>,
        ) -> Result<()> {
            self.1 += 1;
            let is_marked = |pair: &&UnprovenPair| {
                marked.is_none_or(|marked| pair.particles.iter().any(|&i| marked[i as usize]))
            };
            let asked = (ways.delta, ways.is_new);
            let is_unproven = |pair: &&UnprovenPair| pair.is_unproven(ways.start, ways.end, asked);
            out.extend(self.0.iter().filter(is_marked).filter(is_unproven));
            Ok(())
        }
    }

    /// A point between two triangles, the lower one of which is prescribed.
    fn rig() -> (Pairs, Certifier<f64>) {
        let pair = |triangle: u32| UnprovenPair {
            candidate: Candidate::VertexTriangle([0, triangle]),
            particles: [0, 1, 2, 3].map(|k| if k == 0 { 0 } else { 3 * triangle + k }),
        };
        (Pairs(vec![pair(0), pair(1)], 0), Certifier::new(7))
    }

    fn places(point: f64, below: f64, above: f64) -> Vec<[f64; 3]> {
        let triangle = |z: f64| [[-0.01, -0.01, z], [0.01, -0.01, z], [0.0, 0.02, z]];
        [[0.0, 0.0, point]].into_iter().chain(triangle(below)).chain(triangle(above)).collect()
    }

    /// The point flees from the triangle that comes, and is stopped by the other one: then it is in the way of the first after all.
    #[test]
    fn what_is_stopped_goes_along_with_what_comes() {
        let (mut search, mut certifier) = rig();
        let start = places(0.0, -1e-4, 5e-4);
        let mut end = places(4e-3, 2e-3, 5e-4);
        let is_held = |i: u32| (1..4).contains(&i);
        let changed = certifier.certify(&mut search, &start, &mut end, is_held).unwrap();
        assert!(changed > 0);
        assert_eq!(end[1..4], places(0.0, 2e-3, 0.0)[1..4], "what is prescribed stays so");
        let heights = [end[1][2], end[0][2], end[4][2]];
        assert!(heights[0] < heights[1] && heights[1] < heights[2], "{heights:?}");
    }

    /// Layers fall on one that is held, each on what has just stopped: a round for each would go on for long.
    #[test]
    fn what_runs_into_what_has_stopped_ends_after_some_rounds() {
        for (layers, most) in [(40, 60), (600, 220)] {
            let pair = |k: u32| UnprovenPair {
                candidate: Candidate::VertexTriangle([k + 3, k / 3]),
                particles: [k + 3, k - k % 3, k - k % 3 + 1, k - k % 3 + 2],
            };
            let mut search = Pairs((0..3 * (layers - 1)).map(pair).collect(), 0);
            let at = |layer: u32, corner: u32| {
                // Each corner is above the inside of the triangle below.
                let size = 0.995_f64.powi(layer as i32);
                let [x, y] = [[-0.1, -0.1], [0.2, -0.1], [0.0, 0.3]][corner as usize];
                [size * x, size * y, 1e-3 * f64::from(layer)]
            };
            let start: Vec<_> =
                (0..3 * layers).map(|particle| at(particle / 3, particle % 3)).collect();
            let mut end: Vec<_> = start.clone();
            end[3..].iter_mut().for_each(|x| x[2] -= 2.0);
            let mut certifier = Certifier::<f64>::new(start.len());
            let changed = certifier.certify(&mut search, &start, &mut end, |i| i < 3).unwrap();
            assert!(changed > 0 && search.1 < most, "{layers}: {} looks", search.1);
            let mut left = vec![];
            let ways = Ways { start: &start, end: &end, delta: 0.0, is_new: false, follows: false };
            search.unproven(&ways, None, &mut left).unwrap();
            assert!(left.is_empty(), "{} pairs are left", left.len());
        }
    }

    #[test]
    fn without_bodies_nothing_is_left_inside_of_them() {
        for makes_ghosts in [false, true] {
            let (mut search, certifier) = rig();
            let mut certifier = certifier.with_ghosts(makes_ghosts);
            let mut end = places(0.0, 2e-3, 1e-3);
            let start = places(0.0, -1e-3, 1e-3);
            let is_held = |i: u32| i > 0;
            let error = certifier.certify(&mut search, &start, &mut end, is_held).unwrap_err();
            assert!(matches!(error, Error::Pinched { .. }), "{error}");
            assert!(certifier.ghosts().is_empty());
        }
    }
}
