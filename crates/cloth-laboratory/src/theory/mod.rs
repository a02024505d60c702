//! What experiments are held against: the answers of mechanics, computed without any code of the engine.

pub(crate) mod elastica;
pub(crate) mod membrane;
pub(crate) mod pushed;
