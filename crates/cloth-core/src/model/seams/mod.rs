//! Seams: vertices of cloths that are drawn together, and then are one (NUMERICS §16).

mod classes;
mod error;
mod seamstress;
mod stitching;
#[cfg(test)]
mod tests;
mod weld;

pub use classes::VertexClasses;
pub use error::SeamError;
pub(super) use seamstress::Seamstress;
pub use stitching::{BROKEN, Pulls, Stitching};
pub use weld::{Weld, Welding};

use std::ops::Range;

use crate::{
    ModelError, State,
    error::{finite_all, not_negative, positive},
};

/// Length to which a stitch closes \[m\], if it is longer at the start. A spring of no length has no direction, and features nearer than a fifth of this do not
/// pass the certificate of contact.
pub const STITCH_LENGTH: f64 = 1e-4;

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
    /// Force per length of the seam \[N/m\] at which stitches that hold it break, once it is closed; `None` for none.
    pub strength: Option<f64>,
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
            strength: None,
        }
    }

    /// The stitches with what each goes to.
    pub(super) fn tied(&self) -> impl Iterator<Item = ([u32; 2], SeamTie)> {
        let ties = self.ties.iter().copied().chain(std::iter::repeat(SeamTie::CLOSED));
        self.stitches.iter().copied().zip(ties)
    }

    fn validate(&self) -> Result<(), ModelError> {
        let Self { name, cloths: _, stitches, stiffness, damping, closing, weld, ties, strength } =
            self;
        if let Some(strength) = strength {
            positive(|| format!("strength of seam {name:?}"), *strength)?;
            if *weld {
                return Err(SeamError::WeldedStrength { seam: name.clone() }.into());
            }
        }
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
    /// How wide each stitch is for contact \[m\]; 0 if its vertices are one place, infinite once it is broken.
    widths: Vec<f64>,
    /// Force at which each breaks \[N\]; infinite if it does not.
    strengths: Vec<f64>,
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

    /// Whether any stitch can break.
    #[must_use]
    pub fn can_break(&self) -> bool {
        self.strengths.iter().any(|strength| strength.is_finite())
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

    /// The stitches that are to be welded and whose particles are not one in `state`, to the last bit; ascending.
    #[must_use]
    pub fn open_in(&self, state: &State) -> Vec<u32> {
        let bits = |values: &[[f64; 3]], i: u32| {
            values.get(i as usize).map(|value| value.map(f64::to_bits))
        };
        let is_open = |&stitch: &u32| {
            let [a, b] = self.stitches[stitch as usize]
                .map(|i| (bits(&state.positions, i), bits(&state.velocities, i)));
            a != b
        };
        self.to_weld().filter(is_open).collect()
    }

    /// The stitches that are to be welded, ascending.
    pub fn to_weld(&self) -> impl Iterator<Item = u32> + '_ {
        self.ranges.iter().filter(|seam| seam.weld).flat_map(|seam| seam.stitches.clone())
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
        let gap = |stitch: u32| self.gap(stitch, positions);
        self.ranges.iter().map(|seam| seam.stitches.clone().map(gap).fold(0.0, f64::max)).collect()
    }

    /// The widest of all stitches that count, by its number, and how wide it is as [`Self::gaps`] measures it \[m\].
    #[must_use]
    pub fn widest(
        &self,
        positions: &[[f64; 3]],
        counts: impl Fn(usize) -> bool,
    ) -> Option<(usize, f64)> {
        let all = (0..self.stitches.len()).filter(|&stitch| counts(stitch));
        let all = all.map(|stitch| (stitch, self.gap(stitch as u32, positions)));
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// How wide a stitch is while particles are at `positions`, or what it is wider than its vertices are to be apart \[m\]; infinite where there is
    /// no such stitch or particle.
    #[must_use]
    pub fn gap(&self, stitch: u32, positions: &[[f64; 3]]) -> f64 {
        let place = |i: u32| positions.get(i as usize).copied().map(glam::DVec3::from);
        let ends = self.stitches.get(stitch as usize).map(|ends| ends.map(place));
        let Some([Some(a), Some(b)]) = ends else { return f64::INFINITY };
        let width = a.distance(b);
        let length = self.lengths[stitch as usize];
        if length > STITCH_LENGTH { (width - length).max(0.0) } else { width }
    }
}
