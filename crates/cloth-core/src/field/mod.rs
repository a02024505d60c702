//! Procedural force fields: an expression of the language of [`FieldProgram`], for every backend.

mod call;
mod cuda;
mod error;
mod functions;
mod node;
mod noise;
mod parser;
mod registers;
mod shader;
mod token;
mod wgsl;

use std::sync::Arc;

use node::{Node, NodeIndex};
pub(crate) use noise::hash;
use registers::Instruction;

pub use error::FieldError;
pub use registers::{FieldInputs, FieldRegisters};

/// A force \[N\] as an expression of where a particle is, how it moves, and when.
///
/// ```
/// use cloth_core::FieldProgram;
///
/// // A swirl around the z axis, stronger for heavy particles, which dies down.
/// let swirl = FieldProgram::compile(
///     "let around = cross(vec3(0, 0, 1), x); m * exp(-t / 2) * around / (1 + dot(x, x))",
/// )?;
/// let force = swirl.evaluate([1.0, 0.0, 0.0], [0.0; 3], 0.0, 0.01, 0, 1e-3);
/// assert_eq!(force, [0.0, 0.005, 0.0]);
///
/// let error = FieldProgram::compile("m * (x + 1)").unwrap_err();
/// assert_eq!((error.line, error.column), (1, 8));
/// assert_eq!(error.problem, "`+` takes two scalars or two vec3, found a vec3 and a scalar");
/// # Ok::<(), cloth_core::FieldError>(())
/// ```
///
/// # The language
///
/// An expression of type vec3, after any number of definitions `let name = expression;`.
///
/// | | |
/// |---|---|
/// | values | `x` position \[m\], `v` velocity \[m/s\] (vec3); `t` time at the start of the substep \[s\], `dt` its length \[s\], `m` mass \[kg\], `id` index of the particle, from 0; `pi`; numbers |
/// | `+ - * / ^` | as usual; vec3 with vec3 for `+ -`, a scalar on either side of `*` or right of `/`; `^` binds tighter than a sign and groups from the right |
/// | `< <= > >= == !=`, `and or not` | conditions, of scalars |
/// | `select(condition, a, b)` | a if the condition holds, else b; both are computed |
/// | `.x .y .z`, `vec3(a, b, c)` | components |
/// | `sin cos exp log sqrt abs` | of a scalar, or component by component |
/// | `min(a, b)`, `max(a, b)`, `clamp(a, low, high)` | the same; a scalar can bound a vec3 |
/// | `mix(a, b, s)` | a + s (b - a) |
/// | `dot cross length normalize` | of vec3; `normalize` of a zero vector is zero |
/// | `noise(p)` | gradient noise at a vec3, between about -1 and 1, one bump in a unit of length |
///
/// There are no loops. A text has at most 16 KiB and 64 levels of nesting, an expression at most 4096
/// operations and 256 values that are needed at once.
///
/// # What is computed
///
/// Parts made of numbers alone are computed in double precision when the expression is read, and must be
/// finite. All other operations are rounded once, in the order of the text, in the precision of the
/// solver; functions are made of such operations too, the same on every backend. Integer powers up
/// to 16 are products; other powers are exp(b log a), which is NaN for a negative a.
/// Division by zero, roots and logarithms of negative numbers give infinities and NaN as IEEE arithmetic
/// has them; a force that is not finite ends the run with an error that names the particle, unless
/// `select` has put another value in its place.
#[derive(Clone)]
pub struct FieldProgram {
    source: Arc<str>,
    axes: FieldAxes,
    nodes: Vec<Node>,
    outputs: [NodeIndex; 3],
    instructions: Vec<Instruction>,
    output_registers: [u8; 3],
    constants: Vec<f64>,
}

impl FieldProgram {
    /// Checks and compiles an expression.
    ///
    /// # Errors
    /// [`FieldError`] with line and column of what is wrong.
    pub fn compile(source: &str) -> Result<Self, FieldError> {
        Self::compile_in(source, FieldAxes::Engine)
    }

    /// Checks and compiles an expression whose vectors are in these coordinates: those it reads as
    /// well as the force.
    ///
    /// # Errors
    /// As [`Self::compile`].
    pub fn compile_in(source: &str, axes: FieldAxes) -> Result<Self, FieldError> {
        let (graph, outputs) = parser::parse(source, axes)?;
        let outputs = axes.order().map(|axis| outputs[usize::from(axis)]);
        let (nodes, outputs) = graph.needed(outputs);
        let allocation = registers::allocate(&nodes, outputs).ok_or_else(|| {
            let problem = "too many values are needed at once: make the expression shorter";
            FieldError::at(source, 0, problem)
        })?;
        Ok(Self {
            source: source.into(),
            axes,
            nodes,
            outputs,
            instructions: allocation.instructions,
            output_registers: allocation.outputs,
            constants: allocation.constants,
        })
    }

    /// The text.
    #[must_use]
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Operations on one particle.
    #[must_use]
    pub fn operation_count(&self) -> usize {
        self.instructions.len()
    }
}

/// The coordinates of an expression.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FieldAxes {
    /// Those of the engine: right handed, z up.
    #[default]
    Engine,
    /// Left handed, y up: y and z are exchanged.
    LeftHanded,
}

impl FieldAxes {
    /// The axis of the engine for each axis of the expression, and the other way round.
    const fn order(self) -> [u8; 3] {
        match self {
            Self::Engine => [0, 1, 2],
            Self::LeftHanded => [0, 2, 1],
        }
    }
}

/// Two programs of the same text and coordinates are equal.
impl PartialEq for FieldProgram {
    fn eq(&self, other: &Self) -> bool {
        (&self.source, self.axes) == (&other.source, other.axes)
    }
}

impl std::fmt::Debug for FieldProgram {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("FieldProgram").field(&self.source).finish()
    }
}

#[cfg(test)]
mod tests;
