//! What can be wrong with a fabric, its sheet or its rest shape.

use crate::ModelError;

/// A fabric, laboratory sheet or rest shape that makes no sense. Indices are zero based and count within the cloth.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FabricError {
    /// A number, or what is wrong with the triangles as a surface.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A triangle is of a fabric that does not exist.
    #[error(
        "triangle {triangle} of cloth {cloth:?} is of fabric {fabric} of its panels, which have {fabrics}: correct the number"
    )]
    PanelOutOfRange {
        /// Name of the cloth.
        cloth: String,
        /// The triangle.
        triangle: usize,
        /// The number given, from 1.
        fabric: u32,
        /// How many fabrics there are.
        fabrics: usize,
    },
    /// A coupling that would let the cloth gain energy from being stretched.
    #[error(
        "the biaxial coupling of {fabric} is {coupling} N/m: with slopes of {warp} and {weft} N/m at rest it must lie between \
         -{largest:.6} and {largest:.6} N/m, or some stretch would pull the cloth apart; use a smaller one"
    )]
    Coupling {
        /// Whose it is.
        fabric: String,
        /// The coupling \[N/m\].
        coupling: f64,
        /// Slope of the curve of the warp at rest \[N/m\].
        warp: f64,
        /// Slope of the curve of the weft at rest \[N/m\].
        weft: f64,
        /// Largest coupling there can be \[N/m\].
        largest: f64,
    },
    /// A largest stretch that leaves cloth no room.
    #[error(
        "the largest stretch of {fabric} is {limit}: it is a length over the length at rest, at least {least}; give 1.1 for a tenth of \
         extension, or 100 for hardly any limit"
    )]
    StretchLimit {
        /// Whose it is.
        fabric: String,
        /// The limit.
        limit: f64,
        /// The least there can be.
        least: f64,
    },
    /// A rigidity along the bias that no plate has with those along warp and weft.
    #[error(
        "the bending rigidity of {fabric} at 45 degrees is {bias} N m: with {warp} along the warp and {weft} along the weft it must be \
         at least {least:.6e} N m; measure it again, or leave it out"
    )]
    BiasRigidity {
        /// Whose it is.
        fabric: String,
        /// The rigidity at 45 degrees \[N m\].
        bias: f64,
        /// That of the warp \[N m\].
        warp: f64,
        /// That of the weft \[N m\].
        weft: f64,
        /// The least possible \[N m\].
        least: f64,
    },
    /// A triangle without area in the pattern.
    #[error(
        "cloth {cloth:?}: triangle {triangle} has no area in its pattern coordinates: move its coordinates apart, or leave the pattern \
         out, so that the shape in space counts"
    )]
    PatternDegenerate {
        /// Name of the cloth.
        cloth: String,
        /// Index of the triangle.
        triangle: usize,
    },
    /// Neighbours that share an edge of the pattern and lie on the same side of it.
    #[error(
        "cloth {cloth:?}: triangles {} and {} lie on each other in the pattern: one of them is flipped; turn its coordinates over",
        triangles[0], triangles[1]
    )]
    PatternFlipped {
        /// Name of the cloth.
        cloth: String,
        /// The two triangles.
        triangles: [u32; 2],
    },
    /// Not one coordinate for each corner.
    #[error(
        "cloth {cloth:?}: {found} triangles have pattern coordinates, but there are {expected}: give coordinates to each face"
    )]
    PatternLength {
        /// Name of the cloth.
        cloth: String,
        /// Triangles of the pattern.
        found: usize,
        /// Triangles of the mesh.
        expected: usize,
    },
    /// Not one angle of the warp for each triangle.
    #[error(
        "cloth {cloth:?}: {found} triangles have an angle of the warp, but there are {expected}: give one to each, or none"
    )]
    GrainLength {
        /// Name of the cloth.
        cloth: String,
        /// Angles there are.
        found: usize,
        /// Triangles of the mesh.
        expected: usize,
    },
    /// A corner names a coordinate that does not exist.
    #[error(
        "cloth {cloth:?}: triangle {triangle} names pattern coordinate {coordinate}, but there are {coordinates}: correct the face"
    )]
    PatternOutOfRange {
        /// Name of the cloth.
        cloth: String,
        /// Index of the triangle.
        triangle: usize,
        /// The coordinate it names.
        coordinate: u32,
        /// Coordinates there are.
        coordinates: usize,
    },
    /// A direction of the warp that a triangle does not have.
    #[error(
        "cloth {cloth:?}: the warp direction stands upright on triangle {triangle}: choose one that lies along the cloth, or give \
         pattern coordinates"
    )]
    WarpUpright {
        /// Name of the cloth.
        cloth: String,
        /// Index of the triangle.
        triangle: usize,
    },
    /// A tensile curve that cannot be fitted.
    #[error("the tensile curve of {owner}: {problem}")]
    TensileCurve {
        /// Whose it is.
        owner: String,
        /// What is wrong, and what mends it.
        problem: String,
    },
}
