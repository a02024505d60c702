//! Scenes as FYSL. The language is described in `FYSL.md`, which is part of the documentation.

mod feedback;
mod read;
mod schema;
mod value;
mod write;
mod xsd;

pub use feedback::{FyslFeedback, FyslFrame, FyslTransform, FyslVertices};
pub use xsd::fysl_xsd;
