//! What is wrong with a seam.

use crate::ModelError;

/// A seam that makes no sense. Vertices count within their cloth, from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SeamError {
    /// A seam without stitches.
    #[error("seam {seam:?} has no stitches: give it some, or remove it")]
    Empty {
        /// Name of the seam.
        seam: String,
    },
    /// A seam that is to be welded, and to break.
    #[error(
        "seam {seam:?} has a strength and is welded: what is one does not break; hold it, with `end = \"hold\"`, or remove the strength"
    )]
    WeldedStrength {
        /// Name of the seam.
        seam: String,
    },
    /// It ends to close before it begins.
    #[error(
        "seam {seam:?} closes from {} s to {} s: the second time must be later than the first", closing[0], closing[1]
    )]
    Time {
        /// Name of the seam.
        seam: String,
        /// The times \[s\].
        closing: [f64; 2],
    },
    /// It names a cloth that the model does not have.
    #[error("seam {seam:?} sews a cloth {cloth:?}, which does not exist: name one of the cloths")]
    UnknownCloth {
        /// Name of the seam.
        seam: String,
        /// The name of no cloth.
        cloth: String,
    },
    /// It names a vertex that its cloth does not have.
    #[error(
        "seam {seam:?} stitches vertex {vertex} of cloth {cloth:?}, which has {vertices}: vertices count from 0"
    )]
    OutOfRange {
        /// Name of the seam.
        seam: String,
        /// Name of the cloth.
        cloth: String,
        /// The vertex.
        vertex: u32,
        /// Vertices of the cloth.
        vertices: u32,
    },
    /// A stitch from a vertex to itself.
    #[error("seam {seam:?} stitches vertex {vertex} to itself: remove that stitch")]
    ToItself {
        /// Name of the seam.
        seam: String,
        /// The vertex.
        vertex: u32,
    },
    /// A stitch between particles that are joined already.
    #[error(
        "seam {seam:?} stitches vertices {} and {}, which another stitch or a spring joins already: remove that stitch", vertices[0], vertices[1]
    )]
    Joined {
        /// Name of the seam.
        seam: String,
        /// The vertices, each in its cloth.
        vertices: [u32; 2],
    },
    /// Stitches that keep a distance, and others beside them.
    #[error(
        "seam {seam:?} has {ties} ties and {stitches} stitches: give one for each stitch and hold the seam by springs, or none"
    )]
    Ties {
        /// Name of the seam.
        seam: String,
        /// Its ties.
        ties: usize,
        /// Its stitches.
        stitches: usize,
    },
    /// Particles of two cloths cannot become one.
    #[error(
        "seam {seam:?} is to be welded between cloths {:?} and {:?}: put both panels into one cloth, or let springs hold the seam", cloths[0], cloths[1]
    )]
    WeldBetweenCloths {
        /// Name of the seam.
        seam: String,
        /// Names of the cloths.
        cloths: [String; 2],
    },
    /// A welded cloth has its shape at rest from its pattern alone.
    #[error(
        "seam {seam:?} of cloth {cloth:?} is to be welded: that needs fabric whose rest shape is its pattern; give it one, or let springs hold the seam"
    )]
    WeldWithoutPattern {
        /// Name of the seam.
        seam: String,
        /// Name of the cloth.
        cloth: String,
    },
    /// Two corners of a triangle would become one.
    #[error(
        "the seams of cloth {cloth:?} make vertices {} and {} of triangle {triangle} one: stitch them to different vertices, or make the seam there finer", vertices[0], vertices[1]
    )]
    Collapses {
        /// Name of the cloth.
        cloth: String,
        /// The triangle.
        triangle: usize,
        /// Its corners.
        vertices: [u32; 2],
    },
}

impl From<SeamError> for ModelError {
    fn from(error: SeamError) -> Self {
        Self::Seam(Box::new(error))
    }
}
