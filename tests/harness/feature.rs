//! What a backend may lack.

use std::{
    collections::HashSet,
    sync::{Mutex, PoisonError},
};

/// A part of the engine that a backend may leave out: it then answers `Unsupported`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Feature {
    /// The implicit integrator.
    Implicit,
    /// The semi-implicit integrator.
    SemiImplicit,
    /// The sparse direct solver of the implicit integrator.
    DirectSolver,
    /// The preconditioner of that name.
    IncompleteCholesky,
    /// The matrix as blocks.
    AssembledMatrix,
}

impl Feature {
    /// What the answer of a backend that lacks it contains.
    #[must_use]
    pub const fn wording(self) -> &'static str {
        match self {
            Self::Implicit => "the implicit integrator",
            Self::SemiImplicit => "the semi-implicit integrator",
            Self::DirectSolver => "the linear solver direct",
            Self::IncompleteCholesky => "the preconditioner incomplete-cholesky",
            Self::AssembledMatrix => "the matrix form assembled",
        }
    }
}

/// Says once that a candidate is left out, and why.
pub(crate) fn is_lacking_printed(label: &str, feature: Feature) {
    static PRINTED: Mutex<Option<HashSet<(String, Feature)>>> = Mutex::new(None);
    let mut printed = PRINTED.lock().unwrap_or_else(PoisonError::into_inner);
    if printed.get_or_insert_default().insert((label.to_owned(), feature)) {
        eprintln!("{label} is left out: it does not offer {}", feature.wording());
    }
}
