//! `contact_carry` and `contact_certify` (NUMERICS §15): ways are shortened until it is proven that no two features meet.

use crate::{Error, Real, Result};

use super::{
    Candidate, Carrier, SeparatingPlane, certificate_distance, closest_axis, is_apart, is_proven,
    plus, sub,
};

/// Times that particles slide along planes before their ways are shortened.
const SLIDING_ROUNDS: u32 = 6;

/// Times that ways are shortened by planes before particles stay where they are.
const TRUNCATION_ROUNDS: u32 = 6;

/// In how many parts prescribed ways are gone: more where fewer are not proven.
const CARRY_PARTS: [u32; 3] = [1, 4, 16];

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
    /// Where particles are once prescribed ways are gone.
    carried: Vec<[T; 3]>,
    pairs: Vec<UnprovenPair>,
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
            shares: vec![T::ONE; count],
            marked: vec![false; count],
            carried: Vec::new(),
            pairs: Vec::new(),
        }
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

    /// Changes `end` \[m\] so that the ways from `start` are proven to be free of meetings. `is_held` says whose ways are
    /// prescribed and stay as they are. Returns how many others were changed.
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
        is_held: impl Fn(u32) -> bool,
    ) -> Result<u64> {
        self.certify_with(search, (start, end), is_held, &())
    }

    /// The same, where prescribed ways may be those of rigid bodies.
    ///
    /// # Errors
    /// As [`Self::certify`].
    pub fn certify_with(
        &mut self,
        search: &mut impl PairSearch<T>,
        (start, end): (&[[T; 3]], &mut [[T; 3]]),
        is_held: impl Fn(u32) -> bool,
        carrier: &impl Carrier<T>,
    ) -> Result<u64> {
        let numbers = || start.iter().chain(&*end).flatten();
        if !numbers().all(|x| x.is_finite()) {
            return Ok(0);
        }
        let largest = numbers().fold(T::ZERO, |largest, x| largest.maximum(x.abs()));
        let delta = certificate_distance(largest);
        self.bodies.fill(None);
        let mut pairs = std::mem::take(&mut self.pairs);
        pairs.clear();
        let ways = Ways { start, end, delta, is_new: self.is_new };
        search.unproven(&ways, None, &mut pairs)?;
        self.exempt_update(&mut pairs, start);
        let outcome = if pairs.is_empty() {
            Ok(0)
        } else {
            self.resolve(search, (start, end), delta, &mut pairs, (is_held, carrier))
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
        if !self.exempt.is_empty() {
            pairs.retain(|pair| self.exempt.binary_search(&pair.candidate).is_err());
        }
    }

    fn resolve(
        &mut self,
        search: &mut impl PairSearch<T>,
        (start, end): (&[[T; 3]], &mut [[T; 3]]),
        delta: T,
        pairs: &mut Vec<UnprovenPair>,
        (is_held, carrier): (impl Fn(u32) -> bool, &impl Carrier<T>),
    ) -> Result<u64> {
        let moves = |i: u32| is_held(i) && start[i as usize] != end[i as usize];
        let wanted = end.to_vec();
        if pairs.iter().any(|pair| pair.particles.into_iter().any(moves)) {
            self.carry(search, (start, end), delta, (&is_held, carrier))?;
            let carried = std::mem::take(&mut self.carried);
            pairs.clear();
            let ways = Ways { start: &carried, end, delta, is_new: false };
            let found = search.unproven(&ways, None, pairs);
            self.exempt_remove(pairs);
            let shortened =
                found.and_then(|()| self.shorten(search, (&carried, end), delta, pairs, &is_held));
            self.carried = carried;
            shortened?;
        } else {
            self.shorten(search, (start, end), delta, pairs, &is_held)?;
        }
        Ok(wanted.iter().zip(end).filter(|(wanted, end)| wanted != end).count() as u64)
    }

    /// `contact_carry`: prescribed ways are gone, in more and smaller parts if it cannot be proven otherwise.
    fn carry(
        &mut self,
        search: &mut impl PairSearch<T>,
        (start, end): (&[[T; 3]], &[[T; 3]]),
        delta: T,
        (is_held, carrier): (&impl Fn(u32) -> bool, &impl Carrier<T>),
    ) -> Result<()> {
        let mut outcome = Ok(());
        for parts in CARRY_PARTS {
            let mut at = start.to_vec();
            outcome = (1..=parts).try_for_each(|part| {
                let share = T::from_f64(f64::from(part) / f64::from(parts));
                let target = |i: usize| along(start[i], end[i], share);
                let length = T::ONE / T::from_f64(f64::from(parts));
                self.carry_part(search, (&at, target), (delta, length), (is_held, carrier))?;
                std::mem::swap(&mut at, &mut self.carried);
                Ok(())
            });
            self.carried = at;
            if !matches!(outcome, Err(Error::Pinched { .. })) {
                break;
            }
        }
        outcome
    }

    /// A part of prescribed ways is gone, as long as `length` of all of them, and free particles that are in their way go along, as do
    /// those in the way of these: as parts of a rigid body, if it is one that comes; else the longest way of their pair.
    fn carry_part(
        &mut self,
        search: &mut impl PairSearch<T>,
        (start, target): (&[[T; 3]], impl Fn(usize) -> [T; 3]),
        (delta, length_of_part): (T, T),
        (is_held, carrier): (&impl Fn(u32) -> bool, &impl Carrier<T>),
    ) -> Result<()> {
        let is_whole = length_of_part == T::ONE;
        let mut carried = start.to_vec();
        // The rigid body that each goes along with.
        let mut along: Vec<Option<u32>> = vec![None; start.len()];
        self.marked.fill(false);
        for (i, carried) in carried.iter_mut().enumerate() {
            if is_held(i as u32) {
                *carried = target(i);
                self.marked[i] = true;
                along[i] = carrier.body(i as u32);
            }
        }
        let mut pairs = Vec::new();
        loop {
            pairs.clear();
            let ways = Ways { start, end: &carried, delta, is_new: false };
            search.unproven(&ways, Some(&self.marked), &mut pairs)?;
            self.exempt_remove(&mut pairs);
            // What goes along with one rigid body keeps its distance (NUMERICS §15).
            let is_rigid = |pair: &UnprovenPair| {
                let [first, others @ ..] = pair.particles.map(|i| along[i as usize]);
                let split = pair.candidate.split();
                let from = pair.at(start);
                let margin = T::from_f64(0.5) * delta;
                first.is_some()
                    && others.iter().all(|other| *other == first)
                    && is_apart(&from, closest_axis(&from, split), split, margin)
            };
            pairs.retain(|pair| !(is_whole && is_rigid(pair)));
            if pairs.is_empty() {
                self.carried = carried;
                return Ok(());
            }
            pairs.sort_unstable();
            let mut goes_on = false;
            for pair in &pairs {
                let way = |i: u32| sub(carried[i as usize], start[i as usize]);
                let by = (pair.particles.into_iter())
                    .max_by(|&i, &j| length(way(i)).total_cmp(&length(way(j))))
                    .unwrap_or_default();
                if carrier.jumps(by) {
                    return Err(pinched(pair, start));
                }
                let (longest, body) = (way(by), along[by as usize]);
                for i in pair.particles.map(|particle| particle as usize) {
                    if !self.marked[i] {
                        self.marked[i] = true;
                        goes_on = true;
                        body_note(&mut self.bodies, i, pair);
                        along[i] = body;
                        let of_body = |body| carrier.way(body, start[i]);
                        let way =
                            body.map_or(longest, |body| of_body(body).map(|x| length_of_part * x));
                        carried[i] = plus(start[i], T::ONE, way);
                    }
                }
            }
            if !goes_on {
                return Err(pinched(&pairs[0], start));
            }
        }
    }

    /// Changes the ends of particles of unproven pairs, until there are none: they slide along planes between their features, then
    /// their ways are shortened, then they stay where they are.
    fn shorten(
        &mut self,
        search: &mut impl PairSearch<T>,
        (start, end): (&[[T; 3]], &mut [[T; 3]]),
        delta: T,
        pairs: &mut Vec<UnprovenPair>,
        is_held: &impl Fn(u32) -> bool,
    ) -> Result<()> {
        self.shares.fill(T::ONE);
        self.marked.fill(false);
        let mut wanted = end.to_vec();
        let mut round = 0;
        while !pairs.is_empty() {
            let slides = round < SLIDING_ROUNDS;
            if slides {
                // Each pair starts from where the last one has put its particles.
                pairs.sort_unstable();
            } else if round == SLIDING_ROUNDS {
                wanted.copy_from_slice(end);
            }
            let mut goes_on = slides;
            for pair in &*pairs {
                let (from, to) = (pair.at(start), pair.at(&wanted));
                let plane = (round < SLIDING_ROUNDS + TRUNCATION_ROUNDS)
                    .then(|| SeparatingPlane::new(&from, &to, pair.candidate.split(), delta))
                    .flatten();
                for (place, particle) in pair.particles.into_iter().enumerate() {
                    let i = particle as usize;
                    if is_held(particle) {
                        continue;
                    }
                    let mut changes = !self.marked[i];
                    if slides {
                        let slid = plane.and_then(|plane| plane.projected(place, end[i]));
                        if let Some(slid) = slid {
                            (end[i], changes) = (slid, true);
                        }
                    } else {
                        let share = match plane {
                            Some(plane) => plane.share(place, from[place], to[place]),
                            None => T::ZERO,
                        };
                        if share < self.shares[i] {
                            changes = true;
                            self.shares[i] = share;
                        }
                        end[i] = along(start[i], wanted[i], self.shares[i]);
                    }
                    self.marked[i] = true;
                    if changes {
                        goes_on = true;
                        body_note(&mut self.bodies, i, pair);
                    }
                }
            }
            if !goes_on && round >= SLIDING_ROUNDS + TRUNCATION_ROUNDS {
                return Err(pinched(&pairs[0], start));
            }
            round += 1;
            pairs.clear();
            let ways = Ways { start, end, delta, is_new: false };
            search.unproven(&ways, Some(&self.marked), pairs)?;
            self.exempt_remove(pairs);
        }
        Ok(())
    }
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

fn pinched<T: Real>(pair: &UnprovenPair, start: &[[T; 3]]) -> Error {
    let place = pair.at(start)[0].map(T::to_f64);
    Error::Pinched { particles: pair.particles, place }
}
