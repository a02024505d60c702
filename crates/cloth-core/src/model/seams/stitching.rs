//! How stitches are at a time: how long, how stiff, and how wide they are for contact (NUMERICS §16).

use super::{ClosingKind, STITCH_LENGTH, Seams, VertexClasses};
use crate::Model;

/// Where the vertices of a stitch start closer than this \[m\], and stay so, they are one place for contact: panels that lie on each other. Those
/// that come as near later stay two, as features beside them would go through each other before they are apart again.
const JOINED_GAP: f64 = 5e-5;

/// The same in explicit steps, whose soft contact would leave it to the certificate to hold closed panels apart, which keeps no momentum.
const JOINED_GAP_EXPLICIT: f64 = 1e-3;

/// The width of a stitch that is broken: it holds nothing any more.
pub const BROKEN: f64 = f64::INFINITY;

/// How many times as stiff a stitch that is to be welded becomes at most while it is too wide for that after its time, and how many times it doubles until
/// it has had as long again.
const PULL_MAX: f64 = 100.0;
const PULL_DOUBLINGS: f64 = 10.0;

/// Share of the width of a stitch at which contact beside it begins, if that is less than its distance: what is drawn together does not push
/// itself apart.
const SEAM_REACH: f64 = 0.25;

/// Width that an open stitch has for contact at least \[m\], so that one that is held does not change all the time. Contact beside it begins at .06 mm:
/// it has to push before the certificate has to stop something, which keeps no momentum.
const NARROWEST: f64 = 1.0 / 4096.0;

/// From this width on \[m\] a late stitch is drawn in beside welded ones, to it: half of what can be welded, so that it gets there under load.
pub(super) const WIDE: f64 = 1.0 / 2048.0;

/// How many times as stiff a stitch is at `time` \[s\] that was to be closed before.
fn pull(closing: [f64; 2], time: f64) -> f64 {
    let late = ((time - closing[1]) / (closing[1] - closing[0])).max(0.0);
    (PULL_DOUBLINGS * late).exp2().min(PULL_MAX)
}

/// Share of its length at the start that a stitch still has at `time` \[s\]: it begins and ends to close at rest.
fn share_left(closing: [f64; 2], time: f64) -> f64 {
    let part = ((time - closing[0]) / (closing[1] - closing[0])).clamp(0.0, 1.0);
    1.0 - part * part * (3.0 - 2.0 * part)
}

impl Model {
    /// Its seams.
    #[must_use]
    pub const fn seams(&self) -> &Seams {
        &self.seams
    }

    /// Which particles a seam makes, or will make, one place: those of one class. So are the corners at one place of a cloth that tears, torn or not.
    #[must_use]
    pub fn seam_classes(&self) -> VertexClasses {
        self.classes_of(|stitch| self.seams.widths.get(stitch) != Some(&BROKEN), true)
    }

    /// The stitches that break at these positions \[m\] and this time \[s\], ascending: those of seams that are closed by then and bear no more.
    #[must_use]
    pub fn stitches_that_break(&self, positions: &[[f64; 3]], time: f64) -> Vec<u32> {
        let seams = &self.seams;
        let breaks = |&stitch: &u32| {
            let stitch = stitch as usize;
            let ClosingKind { kind, lengths: [_, length], closing, .. } = seams.kinds[stitch];
            let [a, b] = seams.stitches[stitch].map(|i| positions.get(i as usize));
            let (Some(a), Some(b)) = (a, b) else { return false };
            let longer = glam::DVec3::from(*a).distance(glam::DVec3::from(*b)) - length;
            let stiffness = self.springs.kinds()[kind as usize].stiffness;
            closing[1] <= time && stiffness * longer > seams.strengths[stitch]
        };
        (0..seams.stitches.len() as u32).filter(breaks).collect()
    }

    /// Which particles become one where the stitches are welded that are to be, but for these, ascending, and these edges are torn: what
    /// [`Weld::map`](crate::Weld::map) says, without the model.
    #[must_use]
    pub fn welded_classes(&self, open: &[u32], torn: &[u32]) -> VertexClasses {
        let mut classes = VertexClasses::new(self.particle_count());
        let mut tears = self.tears.clone();
        tears.torn_set(torn);
        tears.join(&mut classes, false);
        let stitches = self.seams.to_weld().filter(|stitch| open.binary_search(stitch).is_err());
        for stitch in stitches {
            let [a, b] = self.seams.stitches[stitch as usize];
            classes.join(a, b);
        }
        classes
    }

    /// Which particles are one place for contact: those of stitches that are nearly closed.
    #[must_use]
    pub(crate) fn joined_classes(&self) -> VertexClasses {
        let is_one = |stitch| self.seams.widths.get(stitch).is_none_or(|width| *width == 0.0);
        self.classes_of(is_one, false)
    }

    /// Distance \[m\] at which contact begins between features that have particles of one of [`Self::seam_classes`], by the number of the
    /// class; empty if no stitch is open.
    pub(crate) fn seam_reaches(&self) -> Vec<f64> {
        let seams = &self.seams;
        let is_open = |width: &f64| *width > 0.0 && *width < BROKEN;
        if !seams.widths.iter().any(is_open) {
            return Vec::new();
        }
        let classes = self.seam_classes();
        let mut reaches = vec![0.0; self.particle_count()];
        let open = seams.stitches.iter().zip(&seams.widths).filter(|(_, width)| **width < BROKEN);
        for (&[a, _], width) in open {
            let reach: &mut f64 = &mut reaches[classes.of(a) as usize];
            *reach = reach.max(SEAM_REACH * width);
        }
        reaches
    }

    fn classes_of(&self, is_one: impl Fn(usize) -> bool, counts_torn: bool) -> VertexClasses {
        let mut classes = VertexClasses::new(self.particle_count());
        self.tears.join(&mut classes, counts_torn);
        let stitches = self.seams.stitches.iter().zip(&self.seams.lengths).enumerate();
        // What keeps a distance stays two places.
        stitches
            .filter(|(stitch, (_, length))| **length <= STITCH_LENGTH && is_one(*stitch))
            .for_each(|(_, (&[a, b], _))| classes.join(a, b));
        classes
    }

    /// Stiffness of the stiffest stitch that contact takes for open \[N/m\].
    pub(crate) fn seam_stiffness(&self) -> f64 {
        let kinds = self.seams.kinds.iter().zip(&self.seams.widths);
        let open = kinds.filter(|(_, width)| **width > 0.0 && **width < BROKEN);
        open.map(|(of, _)| self.springs.kinds()[of.kind as usize].stiffness).fold(0.0, f64::max)
    }

    /// How wide each stitch is for contact \[m\] while particles are at `positions`: a power of two, so that small changes are none, or 0 where its
    /// vertices are one place, and where they are to keep a distance. In implicit steps only what starts as one place can be one. `is_implicit` says which steps follow. An open stitch is an obstacle, or panels would go
    /// through each other beside it, and could not be drawn together any more.
    #[must_use]
    pub fn stitch_widths(&self, positions: &[[f64; 3]], is_implicit: bool) -> Vec<f64> {
        let joined = if is_implicit { JOINED_GAP } else { JOINED_GAP_EXPLICIT };
        let apart = |all: &[[f64; 3]], [a, b]: [u32; 2]| {
            let place = |i: u32| all.get(i as usize).copied().map(glam::DVec3::from);
            place(a).zip(place(b)).map_or(0.0, |(a, b)| a.distance(b))
        };
        let width = |(&stitch, length): (&[u32; 2], &f64)| {
            let width = apart(positions, stitch);
            let starts_open = is_implicit && apart(self.positions(), stitch) > joined;
            let is_open = (width > joined || starts_open) && *length <= STITCH_LENGTH;
            if is_open { width.log2().floor().exp2().max(NARROWEST) } else { 0.0 }
        };
        self.seams.stitches.iter().zip(&self.seams.lengths).map(width).collect()
    }

    /// The model with its stitches as they are to be.
    #[must_use]
    pub fn sewn_at(&self, stitching: &Stitching<'_>) -> Self {
        let Stitching { time, pulls, widths, torn } = *stitching;
        let mut model = self.clone();
        model.tears.torn_set(torn);
        model.seams.widths = widths.to_vec();
        for (stitch, of) in self.seams.kinds.iter().enumerate() {
            let ClosingKind { kind, lengths: [start, end], closing, weld } = of;
            let left = share_left(*closing, time);
            let length = match *end <= STITCH_LENGTH {
                true => (start * left).max(STITCH_LENGTH.min(*start)),
                false => end + left * (start - end),
            };
            let is_wide = || widths.get(stitch).is_some_and(|width| *width >= WIDE);
            let (pull, from) = match pulls {
                Pulls::All if *weld => (pull(*closing, time), 0.0),
                Pulls::Wide if *weld && is_wide() => (pull(*closing, time), WIDE),
                _ => (1.0, 0.0),
            };
            let kind = model.springs.kind_mut(*kind);
            // What is no wider than that is drawn as softly as ever.
            kind.rest_length = length + (1.0 - 1.0 / pull) * (from - length).max(0.0);
            kind.stiffness *= pull;
            kind.damping *= pull.sqrt();
            if widths.get(stitch) == Some(&BROKEN) {
                (kind.stiffness, kind.damping) = (0.0, 0.0);
            }
        }
        model
    }

    /// Whether a stitch has another length, or stiffness if it may pull, at one of two times \[s\] than at the other.
    #[must_use]
    pub fn is_sewn_between(&self, times: [f64; 2], pulls: Pulls) -> bool {
        let pulls = pulls != Pulls::None;
        let differs = |of: fn([f64; 2], f64) -> f64, closing: [f64; 2]| {
            let [start, end] = times.map(|time| of(closing, time).to_bits());
            start != end
        };
        self.seams.ranges.iter().any(|seam| {
            differs(share_left, seam.closing) || (pulls && seam.weld && differs(pull, seam.closing))
        })
    }
}

/// How stitches are at a time.
#[derive(Clone, Copy, Debug)]
pub struct Stitching<'a> {
    /// The time \[s\].
    pub time: f64,
    /// Which of those that are to be welded become stiffer after their time.
    pub pulls: Pulls,
    /// How wide they are for contact \[m\], as [`Model::stitch_widths`] says, or [`BROKEN`]; all are closed if this is empty.
    pub widths: &'a [f64],
    /// Edges that are torn, ascending.
    pub torn: &'a [u32],
}

/// Which stitches that are to be welded become stiffer after their time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pulls {
    /// None: explicit steps would have to become shorter for it.
    None,
    /// All.
    All,
    /// Those that are wider than half of what can be welded, by what they are wider.
    Wide,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stitch_closes_in_its_time_and_pulls_harder_after_it() {
        let closing = [1.0, 3.0];
        assert_eq!(
            [0.0, 1.0, 2.0, 3.0, 9.0].map(|t| share_left(closing, t)),
            [1.0, 1.0, 0.5, 0.0, 0.0]
        );
        // Once more each fifth of a second.
        assert_eq!(
            [0.0, 3.0, 3.2, 3.4, 9.0].map(|t| pull(closing, t).round()),
            [1.0, 1.0, 2.0, 4.0, 100.0]
        );
    }
}
