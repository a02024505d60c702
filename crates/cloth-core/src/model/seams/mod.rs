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

/// Length to which a stitch closes \[m\]. A spring of no length has no direction.
pub const STITCH_LENGTH: f64 = 1e-6;

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
        let gap = |index: u32| {
            let [a, b] = self.stitches[index as usize];
            let (Some(a), Some(b)) = (positions.get(a as usize), positions.get(b as usize)) else {
                return f64::INFINITY;
            };
            let width = glam::DVec3::from(*a).distance(glam::DVec3::from(*b));
            let length = self.lengths[index as usize];
            if length > STITCH_LENGTH { (width - length).max(0.0) } else { width }
        };
        self.ranges.iter().map(|seam| seam.stitches.clone().map(gap).fold(0.0, f64::max)).collect()
    }
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
        let mut classes = VertexClasses::new(self.particle_count());
        let stitches = self.seams.stitches.iter().zip(&self.seams.lengths);
        // What keeps a distance stays two places.
        stitches
            .filter(|(_, length)| **length <= STITCH_LENGTH)
            .for_each(|(&[a, b], _)| classes.join(a, b));
        classes
    }

    /// The model with its stitches as long as they are to be at `time` \[s\].
    #[must_use]
    pub fn sewn_at(&self, time: f64) -> Self {
        let mut model = self.clone();
        for ClosingKind { kind, lengths: [start, end], closing } in &self.seams.kinds {
            let left = share_left(*closing, time);
            let length = match *end <= STITCH_LENGTH {
                true => (start * left).max(STITCH_LENGTH),
                false => end + left * (start - end),
            };
            model.springs.kind_mut(*kind).rest_length = length;
        }
        model
    }

    /// Whether a stitch has another length at one of two times \[s\] than at the other.
    #[must_use]
    pub fn is_sewn_between(&self, times: [f64; 2]) -> bool {
        let [start, end] = times;
        self.seams.ranges.iter().any(|seam| {
            share_left(seam.closing, start).to_bits() != share_left(seam.closing, end).to_bits()
        })
    }
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
            rest_length: a.distance(b).max(STITCH_LENGTH),
            stiffness: share * seam.stiffness,
            damping: share
                * seam.damping.unwrap_or_else(|| 2.0 * (seam.stiffness * reduced).sqrt()),
            rigidity: None,
        }
    }
}
