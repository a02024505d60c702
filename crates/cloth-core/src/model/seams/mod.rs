//! Seams: vertices of cloths that are drawn together, and then are one (NUMERICS §16).

mod classes;
mod error;
mod weld;

pub use classes::VertexClasses;
pub use error::SeamError;
pub use weld::Weld;

use std::ops::Range;

use super::{Model, SpringClass, SpringKind, springs::SpringsBuilder};
use crate::{
    ModelError,
    error::{finite_all, not_negative, positive},
};

/// Where the vertices of a stitch are closer than this \[m\] they are one place for contact: less than a stitch closes to, so that it holds for what lies
/// on each other from the start.
const JOINED_GAP: f64 = 5e-5;

/// How many times as stiff a stitch that is to be welded becomes at most while it is too wide for that after its time, and how many times it doubles until
/// it has had as long again.
const PULL_MAX: f64 = 100.0;
const PULL_DOUBLINGS: f64 = 10.0;

/// Share of the width of a stitch at which contact beside it begins, if that is less than its distance: what is drawn together does not push
/// itself apart.
const SEAM_REACH: f64 = 0.25;

/// Least such distance, relative to the length to which stitches close: contact has to push before the certificate has to stop something, which keeps
/// no momentum.
const SEAM_REACH_MIN: f64 = 0.6;

/// Length to which a stitch closes \[m\], if it is longer at the start. A spring of no length has no direction, and features nearer than a fifth of this do not
/// pass the certificate of contact.
pub const STITCH_LENGTH: f64 = 1e-4;

/// Least length of a spring \[m\].
const LENGTH_MIN: f64 = 1e-6;

/// A seam, before it becomes part of a model: stitches, each between two vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct Seam {
    /// Name, unique among the seams of a model.
    pub name: String,
    /// Names of the cloths of the first and of the second vertex of each stitch; the same one for a seam within a cloth.
    pub cloths: [String; 2],
    /// The vertices of each stitch, as indices within these cloths.
    pub stitches: Vec<[u32; 2]>,
    /// Stiffness of a stitch \[N/m\].
    pub stiffness: f64,
    /// Damping of a stitch \[N s/m\]; critical for the lighter of its pairs of particles if not given.
    pub damping: Option<f64>,
    /// When it begins to close, and when it is closed \[s\].
    pub closing: [f64; 2],
    /// Whether the vertices of each stitch become one once it is closed. Else springs hold them.
    pub weld: bool,
    /// Where stitches are to stay apart: one for each stitch, or none if all close.
    pub ties: Vec<SeamTie>,
}

/// A stitch whose vertices keep a distance, as those of a button and of the cloth below it do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamTie {
    /// Length to which the stitch goes \[m\].
    pub length: f64,
    /// Share of the stiffness and damping of the seam.
    pub share: f64,
}

impl SeamTie {
    /// A stitch that closes.
    pub const CLOSED: Self = Self { length: STITCH_LENGTH, share: 1.0 };
}

impl Seam {
    /// A seam within `cloth` that closes in the first second and is welded then.
    #[must_use]
    pub fn new(name: impl Into<String>, cloth: &str, stitches: Vec<[u32; 2]>) -> Self {
        Self {
            name: name.into(),
            cloths: [cloth.into(), cloth.into()],
            stitches,
            stiffness: 100.0,
            damping: None,
            closing: [0.0, 1.0],
            weld: true,
            ties: Vec::new(),
        }
    }

    /// The stitches with what each goes to.
    pub(super) fn tied(&self) -> impl Iterator<Item = ([u32; 2], SeamTie)> {
        let ties = self.ties.iter().copied().chain(std::iter::repeat(SeamTie::CLOSED));
        self.stitches.iter().copied().zip(ties)
    }

    fn validate(&self) -> Result<(), ModelError> {
        let Self { name, cloths: _, stitches, stiffness, damping, closing, weld, ties } = self;
        for tie in ties {
            positive(|| format!("length of a tie of seam {name:?}"), tie.length)?;
            positive(|| format!("share of a tie of seam {name:?}"), tie.share)?;
        }
        if !ties.is_empty() && (ties.len() != stitches.len() || *weld) {
            let (ties, stitches) = (ties.len(), stitches.len());
            return Err(SeamError::Ties { seam: name.clone(), ties, stitches }.into());
        }
        positive(|| format!("stiffness of seam {name:?}"), *stiffness)?;
        if let Some(damping) = damping {
            not_negative(|| format!("damping of seam {name:?}"), *damping)?;
        }
        finite_all(|| format!("time of seam {name:?}"), closing)?;
        not_negative(|| format!("start of seam {name:?}"), closing[0])?;
        if closing[1] <= closing[0] {
            return Err(SeamError::Time { seam: name.clone(), closing: *closing }.into());
        }
        if stitches.is_empty() {
            return Err(SeamError::Empty { seam: name.clone() }.into());
        }
        Ok(())
    }
}

/// Where a seam lies in the composite model.
#[derive(Clone, Debug, PartialEq)]
pub struct SeamRange {
    /// Name of the seam.
    pub name: String,
    /// Its stitches among those of all seams.
    pub stitches: Range<u32>,
    /// When it begins to close, and when it is closed \[s\].
    pub closing: [f64; 2],
    /// Whether it is welded once it is closed.
    pub weld: bool,
}

/// A kind of springs whose rest length changes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ClosingKind {
    kind: u32,
    /// At the start, and in the end \[m\].
    lengths: [f64; 2],
    closing: [f64; 2],
    weld: bool,
}

/// The seams of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seams {
    ranges: Vec<SeamRange>,
    /// Particles of each stitch in the composite model.
    stitches: Vec<[u32; 2]>,
    /// Length to which each goes \[m\].
    lengths: Vec<f64>,
    kinds: Vec<ClosingKind>,
    /// How wide each stitch is for contact \[m\]; 0 if its vertices are one place.
    widths: Vec<f64>,
}

impl Seams {
    /// The seams.
    #[must_use]
    pub fn ranges(&self) -> &[SeamRange] {
        &self.ranges
    }

    /// Particles of the stitches of all seams.
    #[must_use]
    pub fn stitches(&self) -> &[[u32; 2]] {
        &self.stitches
    }

    /// Particles of the stitches of one seam.
    #[must_use]
    pub fn of(&self, seam: &SeamRange) -> &[[u32; 2]] {
        &self.stitches[seam.stitches.start as usize..seam.stitches.end as usize]
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }

    /// When the last seam that is welded is closed \[s\], if any is.
    #[must_use]
    pub fn weld_time(&self) -> Option<f64> {
        let ends = self.ranges.iter().filter(|seam| seam.weld).map(|seam| seam.closing[1]);
        ends.reduce(f64::max)
    }

    /// The widest stitch of each seam \[m\] while particles are at `positions`; of one whose vertices keep a distance, what it is wider than that.
    #[must_use]
    pub fn gaps(&self, positions: &[[f64; 3]]) -> Vec<f64> {
        let gap = |index: u32| self.gap(index as usize, positions);
        self.ranges.iter().map(|seam| seam.stitches.clone().map(gap).fold(0.0, f64::max)).collect()
    }

    /// The widest of all stitches, by its number, and how wide it is as [`Self::gaps`] measures it \[m\].
    #[must_use]
    pub fn widest(&self, positions: &[[f64; 3]]) -> Option<(usize, f64)> {
        let all = (0..self.stitches.len()).map(|stitch| (stitch, self.gap(stitch, positions)));
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn gap(&self, stitch: usize, positions: &[[f64; 3]]) -> f64 {
        let [a, b] = self.stitches[stitch];
        let (Some(a), Some(b)) = (positions.get(a as usize), positions.get(b as usize)) else {
            return f64::INFINITY;
        };
        let width = glam::DVec3::from(*a).distance(glam::DVec3::from(*b));
        let length = self.lengths[stitch];
        if length > STITCH_LENGTH { (width - length).max(0.0) } else { width }
    }
}

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

    /// Which particles a seam makes, or will make, one place: those of one class are no obstacle to each other in contact.
    #[must_use]
    pub fn seam_classes(&self) -> VertexClasses {
        self.classes_of(|_| true)
    }

    /// Which particles are one place for contact: those of stitches that are nearly closed.
    #[must_use]
    pub(crate) fn joined_classes(&self) -> VertexClasses {
        self.classes_of(|stitch| self.seams.widths.get(stitch).is_none_or(|width| *width == 0.0))
    }

    /// Distance \[m\] at which contact begins between features that have particles of one of [`Self::seam_classes`], by the number of the
    /// class; empty if no stitch is open.
    pub(crate) fn seam_reaches(&self) -> Vec<f64> {
        let seams = &self.seams;
        if seams.widths.iter().all(|width| *width == 0.0) {
            return Vec::new();
        }
        let classes = self.seam_classes();
        let mut reaches = vec![0.0; self.particle_count()];
        for (&[a, _], width) in seams.stitches.iter().zip(&seams.widths) {
            let reach: &mut f64 = &mut reaches[classes.of(a) as usize];
            let least = if *width > 0.0 { SEAM_REACH_MIN * STITCH_LENGTH } else { 0.0 };
            *reach = reach.max(SEAM_REACH * width).max(least);
        }
        reaches
    }

    fn classes_of(&self, is_one: impl Fn(usize) -> bool) -> VertexClasses {
        let mut classes = VertexClasses::new(self.particle_count());
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
        let open = kinds.filter(|(_, width)| **width > 0.0);
        open.map(|(of, _)| self.springs.kinds()[of.kind as usize].stiffness).fold(0.0, f64::max)
    }

    /// How wide each stitch is for contact \[m\] while particles are at `positions`: a power of two, so that small changes are none, or 0 where its
    /// vertices are one place. An open stitch is an obstacle, or panels would go through each other beside it, and could not be drawn together
    /// any more.
    #[must_use]
    pub fn stitch_widths(&self, positions: &[[f64; 3]]) -> Vec<f64> {
        let place = |i: u32| positions.get(i as usize).copied().map(glam::DVec3::from);
        let width = |&[a, b]: &[u32; 2]| {
            let width = place(a).zip(place(b)).map_or(0.0, |(a, b)| a.distance(b));
            if width > JOINED_GAP { width.log2().floor().exp2() } else { 0.0 }
        };
        self.seams.stitches.iter().map(width).collect()
    }

    /// The model with its stitches as they are to be.
    #[must_use]
    pub fn sewn_at(&self, stitching: &Stitching<'_>) -> Self {
        let Stitching { time, pulls, widths } = *stitching;
        let mut model = self.clone();
        model.seams.widths = widths.to_vec();
        for ClosingKind { kind, lengths: [start, end], closing, weld } in &self.seams.kinds {
            let left = share_left(*closing, time);
            let length = match *end <= STITCH_LENGTH {
                true => (start * left).max(STITCH_LENGTH.min(*start)),
                false => end + left * (start - end),
            };
            let pull = if pulls && *weld { pull(*closing, time) } else { 1.0 };
            let kind = model.springs.kind_mut(*kind);
            kind.rest_length = length;
            kind.stiffness *= pull;
            kind.damping *= pull.sqrt();
        }
        model
    }

    /// Whether a stitch has another length, or stiffness if it `pulls`, at one of two times \[s\] than at the other.
    #[must_use]
    pub fn is_sewn_between(&self, times: [f64; 2], pulls: bool) -> bool {
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
    /// Whether those that are to be welded become stiffer after their time. Explicit steps would have to become shorter for it.
    pub pulls: bool,
    /// How wide they are for contact \[m\], as [`Model::stitch_widths`] says; all are closed if this is empty.
    pub widths: &'a [f64],
}

/// What stitches are made of while a model is built.
pub(super) struct Seamstress<'a> {
    /// Name and particles of each cloth.
    pub cloths: Vec<(&'a str, Range<u32>)>,
    pub positions: &'a [[f64; 3]],
    pub masses: &'a [f64],
}

impl Seamstress<'_> {
    /// Adds the springs of all seams.
    pub(super) fn sew(
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
