//! What can keep a picture from being made.

use super::PICTURE_SIDE_LIMIT;

/// A picture that cannot be rendered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The size is zero or too large.
    #[error(
        "a picture of {width} x {height} pixels cannot be rendered; \
         use 1 to {PICTURE_SIDE_LIMIT} pixels a side"
    )]
    Size {
        /// Width asked for \[pixel\].
        width: u32,
        /// Height asked for \[pixel\].
        height: u32,
    },
    /// The camera has no direction, is turned onto its up vector or has an impossible angle.
    #[error("the camera cannot see: {problem}; correct it or leave it out to show everything")]
    Camera {
        /// What is wrong.
        problem: &'static str,
    },
    /// A triangle uses a particle or texture coordinate that does not exist.
    #[error(
        "triangle {triangle} of the picture uses an index out of range; \
         pass the arrays of the same model"
    )]
    Index {
        /// The triangle, zero based.
        triangle: usize,
    },
    /// What is to be shown on the cloths belongs to another model.
    #[error(
        "the heat map or the threads of the picture are of a model with other particles or triangles; \
         make them of the same model"
    )]
    Overlays,
    /// A position is infinite or not a number.
    #[error(
        "position {particle} of the picture is not finite; \
         the simulation has diverged, use a smaller time step"
    )]
    Position {
        /// The particle or the vertex of a collider, zero based.
        particle: usize,
    },
}
