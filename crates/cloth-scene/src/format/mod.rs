//! Files of scenes. Each format converts to and from [`Scene`](crate::Scene).

pub(crate) mod fysl;
mod lines;
mod names;
mod toml;
mod toml_arity;
mod toml_places;
