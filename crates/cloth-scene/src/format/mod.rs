//! Files of scenes. Each format converts to and from [`Scene`](crate::Scene).

mod lines;
mod toml;
mod toml_places;
