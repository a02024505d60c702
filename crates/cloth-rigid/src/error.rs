//! What can be wrong with a body.

/// A body or a mesh that cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RigidError {
    /// A face names a vertex that does not exist.
    #[error(
        "face {face} of {name:?} names vertex {vertex}, but there are {vertices}: correct the face"
    )]
    FaceOutOfRange {
        /// The body.
        name: String,
        /// Index of the face.
        face: usize,
        /// The vertex it names.
        vertex: u32,
        /// Vertices there are.
        vertices: usize,
    },
    /// The surface has a hole, or faces that wind differently.
    #[error(
        "the mesh of {name:?} is not closed at the edge from vertex {} to {}: a solid has two faces at each edge, which run along it in opposite directions",
        edge[0], edge[1]
    )]
    Open {
        /// The body.
        name: String,
        /// Vertices of the edge.
        edge: [u32; 2],
    },
    /// A solid without volume, or too thin to be sampled.
    #[error("the shape of {name:?} has no volume: give it some thickness")]
    Flat {
        /// The body.
        name: String,
    },
    /// The meshes of an animation do not have the same faces.
    #[error(
        "the faces of mesh {frame} of {name:?} are not those of the first one: an animation moves the vertices of one mesh"
    )]
    FacesDiffer {
        /// The body.
        name: String,
        /// Number of the mesh, from 0.
        frame: usize,
    },
    /// An animation that would need too much memory.
    #[error(
        "{name:?} has {sets} meshes, each with {count} samples of its distance, which is too much: give fewer cells or meshes"
    )]
    TooManySamples {
        /// The body.
        name: String,
        /// Meshes.
        sets: usize,
        /// Samples of each.
        count: usize,
    },
    /// A joint that makes no sense.
    #[error("joint {joint} cannot be made: {problem}")]
    Joint {
        /// Number of the joint, from 0.
        joint: usize,
        /// What is wrong.
        problem: &'static str,
    },
    /// A collider that changes its shape, among rigid bodies.
    #[error(
        "{name:?} changes its shape, which rigid bodies do not feel: leave out the bodies, or give it one shape"
    )]
    Changes {
        /// The collider.
        name: String,
    },
    /// A skin is thicker than the grid of its solid is long.
    #[error(
        "the skin of {name:?} is {skin} m thick, and all of its grid {most} m long: give a thinner one"
    )]
    ThickSkin {
        /// The solid.
        name: String,
        /// Thickness \[m\].
        skin: f64,
        /// The largest that is taken \[m\].
        most: f64,
    },
    /// A number that must be finite, or above zero, is not.
    #[error("{what} of {name:?} is {value}: give a finite number{}", if *positive { " above zero" } else { "" })]
    Number {
        /// The body.
        name: String,
        /// The quantity.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Whether it must be above zero.
        positive: bool,
    },
    /// A body or collider that is larger, or farther away, than rigid bodies are computed with.
    #[error(
        "{name:?} reaches {value:.3e} m from the origin or its own: rigid bodies are computed up to {limit:.0e} m; is a unit wrong?"
    )]
    TooLarge {
        /// The body or collider.
        name: String,
        /// The coordinate.
        value: f64,
        /// The largest that is possible.
        limit: f64,
    },
    /// A body that starts faster than the solver lets it be.
    #[error(
        "{what} of {name:?} is {value}: the rigid solver moves bodies with at most {limit:.0} (m/s or rad/s); use less"
    )]
    TooFast {
        /// The body.
        name: String,
        /// The quantity.
        what: &'static str,
        /// Its size \[m/s or rad/s\].
        value: f64,
        /// The largest one.
        limit: f64,
    },
    /// What was put down of the bodies cannot be gone on from.
    #[error("the rigid bodies cannot go on: {problem}")]
    Snapshot {
        /// What is wrong.
        problem: &'static str,
    },
    /// The library refused the shape.
    #[error("the mesh of {name:?} cannot be used ({problem}): simplify it")]
    Shape {
        /// The body.
        name: String,
        /// What the library said.
        problem: String,
    },
}
