//! Seams become springs of a model.

use std::ops::Range;

use super::{ClosingKind, Seam, SeamError, SeamRange, Seams};
use crate::{ModelError, SpringClass, SpringKind, model::springs::SpringsBuilder};

/// Least length of a spring \[m\].
const LENGTH_MIN: f64 = 1e-6;

/// What stitches are made of while a model is built.
pub(in crate::model) struct Seamstress<'a> {
    /// Name and particles of each cloth.
    pub cloths: Vec<(&'a str, Range<u32>)>,
    pub positions: &'a [[f64; 3]],
    pub masses: &'a [f64],
}

impl Seamstress<'_> {
    /// Adds the springs of all seams.
    pub(in crate::model) fn sew(
        &self,
        seams: &[Seam],
        springs: &mut SpringsBuilder,
    ) -> Result<Seams, ModelError> {
        let mut sewn = Seams::default();
        let mut rows = Vec::new();
        for seam in seams {
            seam.validate()?;
            let first = sewn.stitches.len() as u32;
            let ranges = seam.cloths.each_ref().map(|name| self.particles(seam, name));
            let [a, b] = ranges;
            let ranges = [a?, b?];
            for (stitch, tie) in seam.tied() {
                let particles = self.stitch(seam, &ranges, stitch)?;
                let kind = self.kind(seam, particles, tie.share);
                let number = springs.kind_own(kind);
                sewn.kinds.push(ClosingKind {
                    kind: number,
                    lengths: [kind.rest_length, tie.length],
                    closing: seam.closing,
                    weld: seam.weld,
                });
                rows.push((particles, number));
                sewn.stitches.push(particles);
                sewn.lengths.push(tie.length);
            }
            sewn.strengths.extend(self.strengths(seam, &sewn.stitches[first as usize..]));
            sewn.ranges.push(SeamRange {
                name: seam.name.clone(),
                stitches: first..sewn.stitches.len() as u32,
                closing: seam.closing,
                weld: seam.weld,
            });
        }
        rows.sort_unstable();
        if let Err([a, b]) = springs.insert(&rows) {
            let of = |stitch: &[u32; 2]| *stitch == [a, b];
            let index = sewn.stitches.iter().rposition(of).unwrap_or(0) as u32;
            let seam = sewn.ranges.iter().find(|seam| seam.stitches.contains(&index));
            let seam = seam.map(|seam| seam.name.clone()).unwrap_or_default();
            return Err(SeamError::Joined { seam, vertices: [a, b].map(|i| self.local(i)) }.into());
        }
        Ok(sewn)
    }

    fn particles(&self, seam: &Seam, name: &str) -> Result<Range<u32>, ModelError> {
        let found = self.cloths.iter().find(|(cloth, _)| *cloth == name);
        found.map(|(_, particles)| particles.clone()).ok_or_else(|| {
            SeamError::UnknownCloth { seam: seam.name.clone(), cloth: name.into() }.into()
        })
    }

    /// Number of a particle within its cloth.
    fn local(&self, particle: u32) -> u32 {
        let of = self.cloths.iter().find(|(_, particles)| particles.contains(&particle));
        of.map_or(particle, |(_, particles)| particle - particles.start)
    }

    fn stitch(
        &self,
        seam: &Seam,
        ranges: &[Range<u32>; 2],
        stitch: [u32; 2],
    ) -> Result<[u32; 2], ModelError> {
        let mut particles = [0; 2];
        for side in 0..2 {
            let range = &ranges[side];
            if stitch[side] >= range.end - range.start {
                return Err(SeamError::OutOfRange {
                    seam: seam.name.clone(),
                    cloth: seam.cloths[side].clone(),
                    vertex: stitch[side],
                    vertices: range.end - range.start,
                }
                .into());
            }
            particles[side] = range.start + stitch[side];
        }
        let [a, b] = particles;
        if a == b {
            return Err(SeamError::ToItself { seam: seam.name.clone(), vertex: stitch[0] }.into());
        }
        Ok([a.min(b), a.max(b)])
    }

    /// The force at which each stitch of a seam breaks \[N\]: what the seam bears over the distance to the nearest other one.
    fn strengths(&self, seam: &Seam, stitches: &[[u32; 2]]) -> Vec<f64> {
        let Some(strength) = seam.strength else { return vec![f64::INFINITY; stitches.len()] };
        let place = |stitch: &[u32; 2]| glam::DVec3::from(self.positions[stitch[0] as usize]);
        let places: Vec<_> = stitches.iter().map(place).collect();
        // Along an axis only those need a look that are nearer there than the nearest one so far.
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by(|&a, &b| places[a].x.total_cmp(&places[b].x).then(a.cmp(&b)));
        let mut strengths = vec![strength; places.len()];
        for (rank, &own) in order.iter().enumerate() {
            let mut nearest = f64::INFINITY;
            let after = order[rank + 1..].iter();
            for others in [
                &mut after.copied() as &mut dyn Iterator<Item = usize>,
                &mut order[..rank].iter().rev().copied(),
            ] {
                for other in others {
                    if (places[other].x - places[own].x).abs() >= nearest {
                        break;
                    }
                    nearest = nearest.min(places[other].distance(places[own]));
                }
            }
            // A single stitch is a seam of a metre.
            if nearest.is_finite() {
                strengths[own] = strength * nearest;
            }
        }
        strengths
    }

    fn kind(&self, seam: &Seam, particles: [u32; 2], share: f64) -> SpringKind {
        let [a, b] = particles.map(|i| glam::DVec3::from(self.positions[i as usize]));
        let [m, n] = particles.map(|i| self.masses[i as usize]);
        let reduced = m * n / (m + n);
        SpringKind {
            class: SpringClass::Seam,
            rest_length: a.distance(b).max(LENGTH_MIN),
            stiffness: share * seam.stiffness,
            damping: share
                * seam.damping.unwrap_or_else(|| 2.0 * (seam.stiffness * reduced).sqrt()),
            rigidity: None,
        }
    }
}
