//! Ways of free particles are shortened until all pairs are proven, and no triangle is stretched too far (NUMERICS §15).

use rayon::prelude::*;

use super::{
    super::SeparatingPlane, Certifier, PairSearch, UnprovenPair, Ways, along, body_note, pinched,
};
use crate::{Error, Real, Result};

/// Times that particles slide along planes before their ways are shortened.
const SLIDING_ROUNDS: u32 = 6;

/// Times that ways are shortened by planes before particles stay where they are.
const TRUNCATION_ROUNDS: u32 = 6;

/// Times that this is tried before all that is free stays where it is: where everything runs into what has stopped, row after row of a large mesh, each
/// would take a round.
const ROUNDS_MAX: u32 = 200;

/// Times that ways are shortened by triangles that are stretched too far before their particles stay where they are.
const STRETCH_ROUNDS: u32 = 24;

/// Pairs in a task.
const TASK: usize = 256;

/// What is done about triangles that end beyond their largest stretch, or that at these places.
#[derive(Clone, Copy, Debug)]
pub(super) enum Bounds<'a, T> {
    /// Nothing.
    None,
    /// They are shortened one after the other, which keeps momentum, and need not be enough.
    Sweeps(&'a [[T; 3]]),
    /// Ways from these places are shortened, which is enough as none is stretched too far there.
    Shares(&'a [[T; 3]]),
}

/// Where particles start, where they would go, and where they end.
struct Shortened<'a, T, W = &'a [[T; 3]]> {
    start: &'a [[T; 3]],
    wanted: W,
    end: &'a mut [[T; 3]],
}

impl<T: Real> Certifier<T> {
    /// As [`Self::shorten`], on straight ways from the start of a substep, where no triangle was stretched too far. If pairs do not let it be done,
    /// `end` stays as it is: that nothing passes comes first.
    pub(super) fn shorten_from_start(
        &mut self,
        search: &mut impl PairSearch<T>,
        (first, end): (&[[T; 3]], &mut [[T; 3]]),
        delta: T,
        pairs: &mut Vec<UnprovenPair>,
        is_held: &(impl Fn(u32) -> bool + Sync),
    ) -> Result<()> {
        let proven = end.to_vec();
        pairs.clear();
        let ways = Ways { start: first, end, delta, is_new: false, follows: false };
        search.unproven(&ways, None, pairs)?;
        self.exempt_remove(pairs);
        let bounds = Bounds::Shares(first);
        let shortened = self.shorten(search, (first, end), (delta, bounds), pairs, is_held);
        if matches!(shortened, Err(Error::Pinched { .. })) {
            end.copy_from_slice(&proven);
            return Ok(());
        }
        shortened
    }

    /// Changes the ends of particles of unproven pairs, until there are none: they slide along planes between their features, then
    /// their ways are shortened, then they stay where they are.
    pub(super) fn shorten(
        &mut self,
        search: &mut impl PairSearch<T>,
        (start, end): (&[[T; 3]], &mut [[T; 3]]),
        (delta, bounds): (T, Bounds<'_, T>),
        pairs: &mut Vec<UnprovenPair>,
        is_held: &(impl Fn(u32) -> bool + Sync),
    ) -> Result<()> {
        let mut wanted = std::mem::take(&mut self.aims);
        wanted.clear();
        wanted.extend_from_slice(end);
        let ways = Shortened { start, wanted: &mut *wanted, end };
        let outcome = self.shorten_to_aims(search, ways, (delta, bounds), pairs, is_held);
        self.aims = wanted;
        outcome
    }

    fn shorten_to_aims(
        &mut self,
        search: &mut impl PairSearch<T>,
        Shortened { start, wanted, end }: Shortened<'_, T, &mut [[T; 3]]>,
        (delta, bounds): (T, Bounds<'_, T>),
        pairs: &mut Vec<UnprovenPair>,
        is_held: &(impl Fn(u32) -> bool + Sync),
    ) -> Result<()> {
        self.shares.fill(T::ONE);
        self.marked.fill(false);
        let outside = self.half_spaces.outside(start, end, delta);
        for _ in 0..SLIDING_ROUNDS {
            // Each pair starts from where the last one has put its particles.
            pairs.par_sort_unstable();
            self.changed.fill(false);
            let ways = Shortened { start, wanted: &*wanted, end };
            self.slide(ways, delta, pairs, is_held);
            if let Bounds::Sweeps(first) = bounds {
                self.stretch.shorten(first, end, is_held, &mut self.changed);
                self.marked
                    .iter_mut()
                    .zip(&self.changed)
                    .for_each(|(marked, changed)| *marked |= changed);
            }
            if !self.half_spaces.is_empty() {
                let changed = self.changed.iter().enumerate().filter(|(_, changed)| **changed);
                for (i, _) in changed {
                    end[i] = outside.moved(start[i], end[i]).unwrap_or(end[i]);
                }
            }
            self.unproven_again(search, (start, end), delta, pairs)?;
            if pairs.is_empty() {
                break;
            }
        }
        wanted.copy_from_slice(end);
        for round in 0.. {
            let mut goes_on = false;
            self.changed.fill(false);
            if round == ROUNDS_MAX {
                goes_on = self.stop_all((start, end), is_held);
            } else if !pairs.is_empty() {
                let plane = round < TRUNCATION_ROUNDS;
                let ways = Shortened { start, wanted: &*wanted, end };
                goes_on = self.truncate(ways, (delta, plane), pairs, is_held);
            }
            let stretched = match bounds {
                Bounds::Shares(first) => self.stretch.shares(first, end, is_held),
                _ => Vec::new(),
            };
            let before = if stretched.is_empty() { Vec::new() } else { self.shares.clone() };
            for &(particles, share) in &stretched {
                let share = if round < STRETCH_ROUNDS { share } else { T::ZERO };
                for i in particles.into_iter().filter(|&i| !is_held(i)) {
                    let i = i as usize;
                    self.shares[i] = self.shares[i].minimum(share * before[i]);
                    end[i] = along(start[i], wanted[i], self.shares[i]);
                    self.marked[i] = true;
                    self.changed[i] = true;
                }
            }
            if pairs.is_empty() && stretched.is_empty() {
                return Ok(());
            }
            if !goes_on && stretched.is_empty() && round >= TRUNCATION_ROUNDS {
                return Err(pinched(pairs, start, &[]));
            }
            self.unproven_again(search, (start, end), delta, pairs)?;
        }
        Ok(())
    }

    /// Particles of pairs slide along the planes between their features.
    fn slide(
        &mut self,
        Shortened { start, wanted, end }: Shortened<'_, T>,
        delta: T,
        pairs: &[UnprovenPair],
        is_held: &impl Fn(u32) -> bool,
    ) {
        let planes = planes((start, wanted), delta, pairs);
        for (pair, plane) in pairs.iter().zip(planes) {
            for (place, particle) in pair.particles.into_iter().enumerate() {
                let i = particle as usize;
                if is_held(particle) {
                    continue;
                }
                let slid = plane.and_then(|plane| plane.projected(place, end[i]));
                if let Some(slid) = slid {
                    end[i] = slid;
                }
                if slid.is_some() || !self.marked[i] {
                    body_note(&mut self.bodies, i, pair);
                }
                self.marked[i] = true;
                self.changed[i] = true;
            }
        }
    }

    /// Particles of pairs go as far as the planes between their features let them, or stay where they are. Returns whether any has changed.
    fn truncate(
        &mut self,
        Shortened { start, wanted, end }: Shortened<'_, T>,
        (delta, has_planes): (T, bool),
        pairs: &[UnprovenPair],
        is_held: &impl Fn(u32) -> bool,
    ) -> bool {
        let mut changes = false;
        let planes = match has_planes {
            true => planes((start, wanted), delta, pairs),
            false => vec![None; pairs.len()],
        };
        for (pair, plane) in pairs.iter().zip(planes) {
            let (from, to) = (pair.at(start), pair.at(wanted));
            for (place, particle) in pair.particles.into_iter().enumerate() {
                let i = particle as usize;
                if is_held(particle) {
                    continue;
                }
                let share = match plane {
                    Some(plane) => plane.share(place, from[place], to[place]),
                    None => T::ZERO,
                };
                let is_shorter = share < self.shares[i];
                if is_shorter {
                    self.shares[i] = share;
                }
                end[i] = along(start[i], wanted[i], self.shares[i]);
                if is_shorter || !self.marked[i] {
                    changes = true;
                    body_note(&mut self.bodies, i, pair);
                }
                self.marked[i] = true;
                self.changed[i] = true;
            }
        }
        changes
    }

    /// All particles that are free stay where they are. Returns whether any has changed.
    fn stop_all(
        &mut self,
        (start, end): (&[[T; 3]], &mut [[T; 3]]),
        is_held: &impl Fn(u32) -> bool,
    ) -> bool {
        let mut changes = false;
        for (i, (start, end)) in start.iter().zip(end).enumerate() {
            if !is_held(i as u32) && start != end {
                *end = *start;
                self.shares[i] = T::ZERO;
                (self.marked[i], self.changed[i], changes) = (true, true, true);
            }
        }
        changes
    }

    /// The pairs that are unproven now, of the particles that have changed or were in a pair that was: all others are as proven as before.
    fn unproven_again(
        &self,
        search: &mut impl PairSearch<T>,
        (start, end): (&[[T; 3]], &[[T; 3]]),
        delta: T,
        pairs: &mut Vec<UnprovenPair>,
    ) -> Result<()> {
        pairs.clear();
        let ways = Ways { start, end, delta, is_new: false, follows: true };
        search.unproven(&ways, Some(&self.changed), pairs)?;
        self.exempt_remove(pairs);
        Ok(())
    }
}

/// The planes between the features of pairs on their ways, where there are any.
fn planes<T: Real>(
    (start, wanted): (&[[T; 3]], &[[T; 3]]),
    delta: T,
    pairs: &[UnprovenPair],
) -> Vec<Option<SeparatingPlane<T>>> {
    let plane = |pair: &UnprovenPair| {
        SeparatingPlane::new(&pair.at(start), &pair.at(wanted), pair.candidate.split(), delta)
    };
    pairs.par_iter().with_min_len(TASK).map(plane).collect()
}
