//! Every way in which building a model or running a solver can fail.

use std::fmt;

use crate::{LinearMethod, SeamError, fabric::FabricError};

/// Result with the engine's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Failure of a backend or of a running solver. Each case names what is wrong and the mend.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No device that the backend can use.
    #[error("no {backend} device: {reason}")]
    NoDevice {
        /// Name of the backend.
        backend: &'static str,
        /// What was looked for, and what to install or choose instead.
        reason: String,
    },
    /// The scene needs something that this backend cannot do.
    #[error("the {backend} backend does not support {feature}; choose another backend")]
    Unsupported {
        /// Name of the backend.
        backend: &'static str,
        /// The feature, as a user would name it.
        feature: String,
    },
    /// A size is above a hard limit; found before any work is done.
    #[error("{limit}: {requested} requested, at most {max} possible; ask for less")]
    LimitExceeded {
        /// The limit, as the device or the engine names it.
        limit: &'static str,
        /// What the model needs.
        requested: u64,
        /// What there is.
        max: u64,
    },
    /// Memory ran out, or would.
    #[error(
        "not enough memory: {requested} bytes needed, {available} available; use a smaller model"
    )]
    OutOfMemory {
        /// Bytes that the model needs.
        requested: u64,
        /// Bytes that are free.
        available: u64,
    },
    /// A kernel does not compile on this device.
    #[error("kernel {kernel} does not compile on this device:\n{log}")]
    KernelCompile {
        /// Name of the stage.
        kernel: &'static str,
        /// The compiler's messages.
        log: String,
    },
    /// The device went away while it worked.
    #[error("the {backend} device was lost: {reason}; start again from the last checkpoint")]
    DeviceLost {
        /// Name of the backend.
        backend: &'static str,
        /// What the driver said.
        reason: String,
    },
    /// A buffer of contacts is full and cannot grow.
    #[error("buffer {buffer} is full: {needed} entries needed, {capacity} possible")]
    Overflow {
        /// Name of the buffer.
        buffer: &'static str,
        /// Entries that the step needs.
        needed: u64,
        /// Entries that fit.
        capacity: u64,
    },
    /// Particles whose motion is prescribed would go through cloth that cannot make way.
    #[error(
        "cloth is pinched: particles {particles:?} at ({:.4}, {:.4}, {:.4}) m are held or moved so that cloth would have to go \
         through cloth; move the pins there together, more slowly, or release some of them", place[0], place[1], place[2]
    )]
    Pinched {
        /// The two features that would meet.
        particles: [u32; 4],
        /// Where \[m\].
        place: [f64; 3],
        /// The particles of all such features, and of those that push them, ascending.
        all: Vec<u32>,
    },
    /// A collider presses cloth against something that does not give way.
    #[error(
        "cloth is pinched by collider {collider:?} at ({:.4}, {:.4}, {:.4}) m, and cannot make way: let it come more slowly, or keep it \
         further from other bodies and from cloth that is held, or let it go through what it pinches with `pinch = \"ghost\"` in [contact]", place[0], place[1], place[2]
    )]
    PinchedByBody {
        /// Name of the collider.
        collider: String,
        /// Where \[m\].
        place: [f64; 3],
        /// The particles of all features that would meet, and of those that push them, ascending; nodes of bodies come after those of cloth.
        all: Vec<u32>,
    },
    /// A collider jumps over cloth.
    #[error(
        "collider {collider:?} goes {way:.3} m within one substep, more than it is long, and there is cloth in its way at \
         ({:.4}, {:.4}, {:.4}) m: give it places in between, or use a smaller time step", place[0], place[1], place[2]
    )]
    BodyJumps {
        /// Name of the collider.
        collider: String,
        /// The longest way of its vertices \[m\].
        way: f64,
        /// Where \[m\].
        place: [f64; 3],
    },
    /// A checkpoint that is whole, but cannot be gone on from.
    #[error("cannot continue from the checkpoint: {reason}; start again without it")]
    Checkpoint {
        /// What does not fit.
        reason: String,
    },
    /// The simulation left the range in which its numbers mean anything.
    #[error(transparent)]
    Diverged(#[from] Divergence),
    /// The model, state or control is not valid.
    #[error(transparent)]
    Invalid(#[from] ModelError),
}

/// Where and how a simulation diverged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "diverged at substep {step} (t = {time:.6} s): particle {particle} {cause}; {}", self.mend()
)]
pub struct Divergence {
    /// Substep, counted from the start of the simulation.
    pub step: u64,
    /// Simulated time at the end of that substep \[s\].
    pub time: f64,
    /// A particle at which it shows.
    pub particle: u32,
    /// What is wrong there.
    pub cause: DivergenceCause,
    /// Time step that was used \[s\].
    pub time_step: f64,
    /// Time step up to which the integrator is stable in any shape of the cloth \[s\]
    /// ([`Model::stable_time_step_of`](crate::Model::stable_time_step_of)); `None` if it is at any.
    pub stable_time_step: Option<f64>,
    /// What made it so, if the state before the frame tells: [`divergence_origin`](crate::divergence_origin).
    pub origin: DivergenceOrigin,
}

impl Divergence {
    fn mend(&self) -> String {
        let used = self.time_step;
        match &self.origin {
            DivergenceOrigin::Field { field, particle, acceleration } => {
                let name = field.map_or_else(
                    || "gravity with the uniform fields".to_owned(),
                    |number| format!("the procedural field {number} of the scene, counted from 0,"),
                );
                return format!(
                    "{name} accelerates particle {particle} by {acceleration:.3e} m/s^2, which is more than springs can follow in \
                     steps of {used:.3e} s: correct or weaken it, or use a smaller time step"
                );
            }
            DivergenceOrigin::Inside { particle, collider, depth } => {
                return format!(
                    "particle {particle} was {depth:.3e} m inside the collider {collider:?} before, which throws it out at once: \
                     move one of them, so that the cloth starts outside"
                );
            }
            DivergenceOrigin::Unknown => {}
        }
        match self.stable_time_step {
            Some(stable) if used > stable => format!(
                "the time step is {used:.3e} s, and stable in any shape of the cloth up to {stable:.3e} s, \
                 damping and contact included: use that, less damping or softer springs"
            ),
            Some(stable) => format!(
                "the time step of {used:.3e} s is no reason, as up to {stable:.3e} s is stable: look for \
                 what moves or presses the cloth too fast, or limit the strain"
            ),
            None => format!(
                "the time step used is {used:.3e} s: use a smaller or an adaptive one, or limit the strain"
            ),
        }
    }
}

/// What made a simulation diverge, beside time step and springs.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum DivergenceOrigin {
    /// Nothing of what is looked for.
    #[default]
    Unknown,
    /// A field that is too strong, or whose force is not a number.
    Field {
        /// Number of the procedural field; `None` for gravity and the uniform fields together.
        field: Option<usize>,
        /// The particle with the largest acceleration.
        particle: u32,
        /// Its acceleration \[m/s^2\].
        acceleration: f64,
    },
    /// A free particle was inside a collider.
    Inside {
        /// The particle that was deepest.
        particle: u32,
        /// Name of the collider.
        collider: String,
        /// How deep \[m\].
        depth: f64,
    },
}

/// What is wrong with a diverged state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DivergenceCause {
    /// A position or velocity is NaN or infinite.
    NonFinite,
    /// A spring is longer than the bound of [`SolverConfig::strain_bound`](crate::SolverConfig).
    Strain {
        /// Relative elongation of the spring, l/L - 1.
        strain: f64,
        /// The bound.
        bound: f64,
    },
    /// The linear system of an implicit step could not be solved: its numbers are not finite, or
    /// its matrix is not positive definite to rounding.
    LinearSolver,
}

impl fmt::Display for DivergenceCause {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NonFinite => formatter.write_str("is no longer a finite number"),
            Self::Strain { strain, bound } => {
                write!(formatter, "has a spring at strain {strain:.3}, above the bound {bound:.3}")
            }
            Self::LinearSolver => formatter.write_str(
                "and all others stay where they are, as the linear system of the step has no solution in this precision",
            ),
        }
    }
}

/// A model, state, control or setting that makes no sense. Indices are zero based and count within
/// the cloth that is named, before it is merged into the composite model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The model has no cloth.
    #[error("the model has no cloth: add at least one")]
    Empty,
    /// A fabric, or the rest shape of a cloth made of it, makes no sense.
    #[error(transparent)]
    Fabric(Box<FabricError>),
    /// Gas in a cloth that does not exist.
    #[error("gas is to inflate a cloth {cloth:?}, which does not exist: name one of the cloths")]
    InflationOfNothing {
        /// The name of no cloth.
        cloth: String,
    },
    /// A tear of a cloth that is not there, or not the one whose mesh was split.
    #[error(
        "cloth {cloth:?} is to tear, and is not the one whose mesh was split for that: give the model both parts of `TriangleMesh::split`"
    )]
    TearOfAnother {
        /// Name of the cloth.
        cloth: String,
    },
    /// A rule of contact for what does not exist.
    #[error(
        "rule {rule} of contact is about {object:?}, which does not exist: name a cloth or a collider"
    )]
    ContactOfNothing {
        /// Its number.
        rule: usize,
        /// The name of nothing.
        object: String,
    },
    /// Rules or maps of contact without contact of triangles.
    #[error(
        "rules and maps of contact need contact of triangles: give contact that response, or remove them"
    )]
    ContactRulesOfPoints,
    /// A rule of contact for no object or for more than two.
    #[error("rule {rule} of contact is between {objects} objects: name one or two")]
    ContactBetween {
        /// Its number.
        rule: usize,
        /// How many.
        objects: usize,
    },
    /// A map of contact for a cloth that does not exist.
    #[error(
        "a map of contact is that of cloth {cloth:?}, which does not exist: name one of the cloths"
    )]
    ContactMapOfNothing {
        /// The name of no cloth.
        cloth: String,
    },
    /// A map of contact that is not that of its cloth.
    #[error("{what} has {found} values for {expected} vertices: give one for each")]
    ContactMapLength {
        /// The map.
        what: String,
        /// Vertices of the cloth.
        expected: usize,
        /// Values that are there.
        found: usize,
    },
    /// A seam makes no sense.
    #[error(transparent)]
    Seam(Box<SeamError>),
    /// Springs one by one have no triangles to be made of fabric.
    #[error(
        "cloth {cloth:?} is a network of springs and has no triangles: give it springs, or a grid or mesh of fabric"
    )]
    FabricWithoutSurface {
        /// Name of the cloth.
        cloth: String,
    },
    /// Contact of triangles needs triangles.
    #[error(
        "cloth {cloth:?} is a network of springs and has no triangles that could touch: give contact the response impulse or \
         penalty, or make the cloth a grid or mesh"
    )]
    ContactWithoutSurface {
        /// Name of the cloth.
        cloth: String,
    },
    /// A collider of triangles makes no sense.
    #[error("the surface of collider {collider:?} {problem}")]
    BodySurface {
        /// Name of the collider.
        collider: String,
        /// What is wrong, and the mend.
        problem: Box<str>,
    },
    /// A surface without an inside acts in contact of triangles alone.
    #[error(
        "collider {collider:?} is a surface of triangles, which particles would pass: give contact the response triangles, or the \
         collider another shape"
    )]
    BodyWithoutContact {
        /// Name of the collider.
        collider: String,
    },
    /// A cloth is to have the shape of its pattern, and has none.
    #[error(
        "the mesh of cloth {cloth:?} has no texture coordinates that could be its pattern: give it some, or let its shape at the \
         start be that at rest"
    )]
    PatternMissing {
        /// Name of the cloth.
        cloth: String,
    },
    /// Only conjugate gradients estimate the error in the norm of the energy.
    #[error(
        "the linear solver {method} does not know the energy of its error: use the linear solver cg, or stop by residual"
    )]
    StopWithoutEstimate {
        /// The linear solver.
        method: LinearMethod,
    },
    /// A number that must be finite is not.
    #[error("{what} is {value}: give a finite number")]
    NonFinite {
        /// The quantity, with its owner and index.
        what: String,
        /// Its value.
        value: f64,
    },
    /// A number that must be above zero is not.
    #[error("{what} is {value}: it must be greater than zero")]
    NotPositive {
        /// The quantity, with its owner and index.
        what: String,
        /// Its value.
        value: f64,
    },
    /// A number that must be zero or above is not.
    #[error("{what} is {value}: it must not be negative")]
    Negative {
        /// The quantity, with its owner and index.
        what: String,
        /// Its value.
        value: f64,
    },
    /// A number outside its range.
    #[error("{what} is {value}: it must lie between {min} and {max}")]
    OutOfRange {
        /// The quantity, with its owner and index.
        what: String,
        /// Its value.
        value: f64,
        /// Smallest value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// A mesh without vertices or without triangles.
    #[error(
        "cloth {cloth:?}: the mesh has {vertices} vertices and {triangles} triangles: a cloth needs at least one triangle"
    )]
    MeshEmpty {
        /// Name of the cloth.
        cloth: String,
        /// Vertices it has.
        vertices: usize,
        /// Triangles it has.
        triangles: usize,
    },
    /// A patch with fewer than two rows or columns.
    #[error(
        "cloth {cloth:?}: a grid of {columns} x {rows} particles is no patch: use at least 2 x 2"
    )]
    GridTooSmall {
        /// Name of the cloth.
        cloth: String,
        /// Particles along the first side.
        columns: u32,
        /// Particles along the second side.
        rows: u32,
    },
    /// More particles or springs than 32-bit indices can name.
    #[error(
        "the model has {count} {what}, at most {max} can be indexed: use fewer or coarser cloths"
    )]
    TooMany {
        /// What there is too much of.
        what: &'static str,
        /// How many.
        count: u64,
        /// How many can be named.
        max: u64,
    },
    /// A triangle names a vertex that does not exist.
    #[error(
        "cloth {cloth:?}: triangle {triangle} names vertex {vertex}, but there are {vertices}: correct the face"
    )]
    TriangleOutOfRange {
        /// Name of the cloth.
        cloth: String,
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Vertices there are.
        vertices: usize,
    },
    /// A triangle names a vertex twice.
    #[error("cloth {cloth:?}: triangle {triangle} uses vertex {vertex} twice: remove the face")]
    TriangleRepeatsVertex {
        /// Name of the cloth.
        cloth: String,
        /// Index of the triangle.
        triangle: usize,
        /// The vertex.
        vertex: u32,
    },
    /// A triangle without area.
    #[error(
        "cloth {cloth:?}: triangle {triangle} has no area: remove it or move its vertices apart"
    )]
    TriangleDegenerate {
        /// Name of the cloth.
        cloth: String,
        /// Index of the triangle.
        triangle: usize,
    },
    /// Two triangles with the same three vertices.
    #[error("cloth {cloth:?}: triangles {first} and {second} have the same vertices: remove one")]
    TriangleDuplicate {
        /// Name of the cloth.
        cloth: String,
        /// The earlier triangle.
        first: usize,
        /// The later triangle.
        second: usize,
    },
    /// An edge with more than two triangles.
    #[error(
        "cloth {cloth:?}: edge {}-{} belongs to {} triangles ({}): a cloth has at most two at an edge, split the mesh there",
        edge[0], edge[1], triangles.len(), list(triangles)
    )]
    EdgeNonManifold {
        /// Name of the cloth.
        cloth: String,
        /// Vertices of the edge.
        edge: [u32; 2],
        /// All its triangles.
        triangles: Vec<u32>,
    },
    /// Two triangles run along an edge in the same direction.
    #[error(
        "cloth {cloth:?}: triangles {} and {} wind edge {}-{} the same way: flip one of them",
        triangles[0], triangles[1], edge[0], edge[1]
    )]
    EdgeInconsistent {
        /// Name of the cloth.
        cloth: String,
        /// Vertices of the edge.
        edge: [u32; 2],
        /// The two triangles.
        triangles: [u32; 2],
    },
    /// A vertex that no triangle uses has no area and so no mass.
    #[error(
        "cloth {cloth:?}: vertex {vertex} belongs to no triangle and would have no mass: remove it"
    )]
    VertexIsolated {
        /// Name of the cloth.
        cloth: String,
        /// The vertex.
        vertex: u32,
    },
    /// Two particles of one spring are at the same place, so that the spring has no rest length.
    #[error("cloth {cloth:?}: vertices {} and {} are at the same place: merge them", vertices[0], vertices[1])]
    SpringWithoutLength {
        /// Name of the cloth.
        cloth: String,
        /// The two vertices.
        vertices: [u32; 2],
    },
    /// A spring of a network names a particle that does not exist.
    #[error(
        "cloth {cloth:?}: a spring ends at particle {particle}, but there are {particles}: correct the index"
    )]
    SpringOutOfRange {
        /// Name of the cloth.
        cloth: String,
        /// The index given.
        particle: u32,
        /// Particles there are.
        particles: usize,
    },
    /// A particle so far from the origin that the numbers of single precision are too coarse for its springs.
    #[error(
        "cloth {cloth:?}: a particle has a coordinate of {distance:.1} m, where numbers of single precision are too coarse for springs \
         of {rest_length:.4} m: at most {largest:.1} m works; move the scene to the origin, or use precision f64"
    )]
    TooFar {
        /// Name of the cloth.
        cloth: String,
        /// Largest coordinate of its particles \[m\].
        distance: f64,
        /// Mean rest length of its springs \[m\].
        rest_length: f64,
        /// Largest coordinate that is possible with these \[m\].
        largest: f64,
    },
    /// A pin names a particle that does not exist.
    #[error(
        "{owner}: pin {pin} does not exist, there are {particles} particles: correct the index"
    )]
    PinOutOfRange {
        /// Whose pin it is.
        owner: String,
        /// The index given.
        pin: u32,
        /// Particles there are.
        particles: usize,
    },
    /// A force acts on a particle that does not exist.
    #[error(
        "control: a force on particle {particle}, but there are {particles}: correct the index"
    )]
    ForceOutOfRange {
        /// The index given.
        particle: u32,
        /// Particles there are.
        particles: usize,
    },
    /// A state names a particle as pinched that does not exist.
    #[error("state: particle {particle} is pinched, but there are {particles}: correct the index")]
    GhostOutOfRange {
        /// The index given.
        particle: u32,
        /// Particles there are.
        particles: usize,
    },
    /// Two things have the same name.
    #[error("two {what}s are called {name:?}: rename one")]
    NameTaken {
        /// Kind of thing.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// An array has the wrong length for this model.
    #[error(
        "{what} has {found} entries, the model needs {expected}: use a state of the same model"
    )]
    LengthMismatch {
        /// The array.
        what: &'static str,
        /// Entries it has.
        found: usize,
        /// Entries it needs.
        expected: usize,
    },
}

fn list(triangles: &[u32]) -> String {
    let names: Vec<String> = triangles.iter().map(u32::to_string).collect();
    names.join(", ")
}

/// `value` if it is finite, else an error that names `what`.
pub(crate) fn finite(what: impl FnOnce() -> String, value: f64) -> Result<f64, ModelError> {
    if value.is_finite() { Ok(value) } else { Err(ModelError::NonFinite { what: what(), value }) }
}

/// All of `values` finite, else an error that names `what`.
pub(crate) fn finite_all(what: impl Fn() -> String, values: &[f64]) -> Result<(), ModelError> {
    values.iter().try_for_each(|&value| finite(&what, value).map(|_| ()))
}

/// `value` if it is finite and above zero, else an error that names `what`.
pub(crate) fn positive(what: impl Fn() -> String, value: f64) -> Result<f64, ModelError> {
    finite(&what, value)?;
    if value > 0.0 { Ok(value) } else { Err(ModelError::NotPositive { what: what(), value }) }
}

/// `value` if it is finite and not below zero, else an error that names `what`.
pub(crate) fn not_negative(what: impl Fn() -> String, value: f64) -> Result<f64, ModelError> {
    finite(&what, value)?;
    if value >= 0.0 { Ok(value) } else { Err(ModelError::Negative { what: what(), value }) }
}

/// `value` if it lies in `[min, max]`, else an error that names `what`.
pub(crate) fn in_range(
    what: impl Fn() -> String,
    value: f64,
    [min, max]: [f64; 2],
) -> Result<f64, ModelError> {
    finite(&what, value)?;
    if (min..=max).contains(&value) {
        Ok(value)
    } else {
        Err(ModelError::OutOfRange { what: what(), value, min, max })
    }
}

impl From<FabricError> for ModelError {
    fn from(error: FabricError) -> Self {
        match error {
            FabricError::Model(error) => error,
            other => Self::Fabric(Box::new(other)),
        }
    }
}
