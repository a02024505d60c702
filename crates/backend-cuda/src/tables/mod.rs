//! What a model is made of, as kernels read it: computed once on the host, never changed.

mod fabric;
mod springs;
mod strain_limit;
mod triangles;

pub(crate) use fabric::FabricTables;
pub(crate) use springs::{SpringTables, spring_kinds};
pub(crate) use strain_limit::StrainTables;
pub(crate) use triangles::TriangleTables;
