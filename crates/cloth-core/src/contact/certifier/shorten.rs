//! Ways of free particles are shortened until all pairs are proven (NUMERICS §15).

use super::{
    super::SeparatingPlane, Certifier, PairSearch, UnprovenPair, Ways, along, body_note, pinched,
};
use crate::{Real, Result};

/// Times that particles slide along planes before their ways are shortened.
const SLIDING_ROUNDS: u32 = 6;

/// Times that ways are shortened by planes before particles stay where they are.
const TRUNCATION_ROUNDS: u32 = 6;

impl<T: Real> Certifier<T> {
    /// Changes the ends of particles of unproven pairs, until there are none: they slide along planes between their features, then
    /// their ways are shortened, then they stay where they are.
    pub(super) fn shorten(
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
