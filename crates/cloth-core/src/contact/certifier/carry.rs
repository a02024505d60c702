//! `contact_carry`: prescribed ways are gone, and what is in their way goes along (NUMERICS §15).

use std::slice;

use super::{
    super::{Carrier, ghosts::anchors, is_proven, plus, sub},
    Certifier, PairSearch, UnprovenPair, Ways, along, body_note, length, pinched,
};
use crate::{Error, Real, Result};

/// In how many parts prescribed ways are gone: more where fewer are not proven.
const CARRY_PARTS: [u32; 3] = [1, 4, 16];

/// What goes nobody's way but its own.
pub(super) const NO_LEADER: u32 = u32::MAX;

impl<T: Real> Certifier<T> {
    /// `contact_carry`: prescribed ways are gone. Cloth that cannot make way becomes a ghost, if there may be any. Where it could if there were no planes it
    /// goes into these, unless whoever moves the bodies can stop them.
    pub(super) fn carry(
        &mut self,
        search: &mut impl PairSearch<T>,
        ways: (&[[T; 3]], &[[T; 3]]),
        delta: T,
        (is_held, carrier): (&impl Fn(u32) -> bool, &impl Carrier<T>),
    ) -> Result<()> {
        loop {
            self.stuck.clear();
            let mut gone = self.carry_in_parts(search, ways, delta, (is_held, carrier));
            let has_planes = !(self.half_spaces.is_empty() || self.half_spaces.stop_bodies);
            if has_planes && matches!(gone, Err(Error::Pinched { .. })) {
                self.half_spaces.give_way = true;
                gone = self.carry_in_parts(search, ways, delta, (is_held, carrier));
                self.half_spaces.give_way = false;
            }
            let stuck = std::mem::take(&mut self.stuck);
            let is_pinched = matches!(gone, Err(Error::Pinched { .. })) && !stuck.is_empty();
            if !(is_pinched && self.makes_ghosts && self.let_through(&stuck, ways.0, carrier)) {
                return gone;
            }
        }
    }

    /// Makes ghosts of the particles of pairs that could not make way, and of all that have pushed them; where all are ghosts already, cloth may
    /// go through cloth. Returns whether anything has changed.
    fn let_through(
        &mut self,
        stuck: &[UnprovenPair],
        start: &[[T; 3]],
        carrier: &impl Carrier<T>,
    ) -> bool {
        let (faces, first) = (carrier.faces(), self.bodies.len());
        if faces.is_empty() {
            return false;
        }
        let anchors = |i: u32| {
            let faces = faces.iter().copied();
            anchors(start[i as usize], faces, |node| start[first + node as usize])
        };
        let mut pinched = Vec::new();
        self.marked.fill(false);
        for mut particle in stuck.iter().flat_map(|pair| pair.particles) {
            while particle != NO_LEADER && !self.marked[particle as usize] {
                self.marked[particle as usize] = true;
                pinched.push(particle);
                particle = self.leader[particle as usize];
            }
        }
        if self.ghosts.add(pinched, anchors) {
            return true;
        }
        let before = self.exempt.len();
        self.exempt.extend(stuck.iter().map(|pair| pair.candidate));
        self.exempt.sort_unstable();
        self.exempt.dedup();
        self.exempt.len() > before
    }

    /// Prescribed ways are gone in more and smaller parts if it cannot be proven otherwise.
    fn carry_in_parts(
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
        self.leader.fill(NO_LEADER);
        for (i, carried) in carried.iter_mut().enumerate() {
            if is_held(i as u32) {
                *carried = target(i);
                self.marked[i] = true;
                along[i] = carrier.body(i as u32);
            }
        }
        let outside = self.half_spaces.outside(start, &carried, delta);
        let mut pairs = Vec::new();
        let mut follows = false;
        loop {
            pairs.clear();
            let ways = Ways { start, end: &carried, delta, is_new: false, follows };
            follows = true;
            search.unproven(&ways, Some(&self.marked), &mut pairs)?;
            self.exempt_remove(&mut pairs);
            // What goes along with one rigid body keeps its distance (NUMERICS §15).
            let is_rigid = |pair: &UnprovenPair| {
                let [first, others @ ..] = pair.particles.map(|i| along[i as usize]);
                let split = pair.candidate.split();
                // In double precision: rounding turns the closest axis too far for triangles that are thousands of times as long as the gap.
                let from = pair.at(start).map(|place| place.map(T::to_f64));
                first.is_some()
                    && others.iter().all(|other| *other == first)
                    && is_proven(&from, &from, split, 0.5 * delta.to_f64())
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
                    return Err(pinched(slice::from_ref(pair), start, &self.leader));
                }
                let (longest, body) = (way(by), along[by as usize]);
                for i in pair.particles.map(|particle| particle as usize) {
                    if !self.marked[i] {
                        self.marked[i] = true;
                        self.leader[i] = by;
                        goes_on = true;
                        body_note(&mut self.bodies, i, pair);
                        along[i] = body;
                        let of_body = |body| carrier.way(body, start[i]);
                        let way =
                            body.map_or(longest, |body| of_body(body).map(|x| length_of_part * x));
                        carried[i] = plus(start[i], T::ONE, way);
                        if let Some(place) = outside.moved(start[i], carried[i]) {
                            (carried[i], along[i]) = (place, None);
                        }
                    }
                }
            }
            if !goes_on {
                // One with a body tells more than one of cloth that is between its parts.
                let is_of_body = |node: &u32| *node as usize >= self.bodies.len();
                let with_body = |pair: &&UnprovenPair| {
                    !self.bodies.is_empty() && pair.particles.iter().any(is_of_body)
                };
                let told = pairs.iter().position(|pair| with_body(&pair)).unwrap_or(0);
                pairs.swap(0, told);
                let outcome = Err(pinched(&pairs, start, &self.leader));
                self.stuck = pairs;
                return outcome;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::super::Candidate, *};

    /// A vertex, and a triangle of a drum that turns by four degrees about the y axis.
    struct Drum;

    impl PairSearch<f32> for Drum {
        fn unproven(
            &mut self,
            ways: &Ways<'_, f32>,
            _: Option<&[bool]>,
            out: &mut Vec<UnprovenPair>,
        ) -> Result<()> {
            let pair = UnprovenPair {
                candidate: Candidate::VertexTriangle([0, 0]),
                particles: [0, 1, 2, 3],
            };
            let is_unproven = pair.is_unproven(ways.start, ways.end, (ways.delta, ways.is_new));
            out.extend(is_unproven.then_some(pair));
            Ok(())
        }
    }

    impl Carrier<f32> for Drum {
        fn body(&self, node: u32) -> Option<u32> {
            (node > 0).then_some(0)
        }

        fn way(&self, _: u32, place: [f32; 3]) -> [f32; 3] {
            let (sin, cos) = 4.0_f64.to_radians().sin_cos();
            let [x, _, z] = place.map(f64::from);
            [cos * x + sin * z - x, 0.0, cos * z - sin * x - z].map(|way| way as f32)
        }

        fn jumps(&self, _: u32) -> bool {
            false
        }

        fn faces(&self) -> Vec<[u32; 3]> {
            vec![[0, 1, 2]]
        }
    }

    /// The triangle is 5,000 times as long as the gap: in single precision the way to its closest point is turned by enough for a corner to be on the
    /// wrong side. A towel in a dryer was pinched so.
    #[test]
    fn what_is_close_to_a_long_triangle_goes_along_with_it() {
        let start = [
            [0.077_561_93, 0.109_617_62, -0.273_040_7],
            [0.086_159_52, -0.2, -0.213_252_29],
            [0.075_114, 0.2, -0.290_444_28],
            [0.086_159_52, 0.2, -0.213_252_29],
        ];
        let end = start.map(|place| plus(place, 1.0, Drum.way(0, place)));
        let mut certifier = Certifier::<f32>::with_nodes(1, 4);
        // All of the way at once: only what goes along with a rigid body is proven so.
        let (is_held, whole) = (|node: u32| node > 0, (2e-5, 1.0));
        certifier
            .carry_part(&mut Drum, (&start, |node| end[node]), whole, (&is_held, &Drum))
            .unwrap();
        for (carried, end) in certifier.carried[0].iter().zip(end[0]) {
            assert!((carried - end).abs() < 1e-6, "{:?}", certifier.carried);
        }
    }
}
