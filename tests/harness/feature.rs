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
    /// The direct solver of the implicit integrator.
    Direct,
    /// Its preconditioner by incomplete Cholesky factorisation.
    IncompleteCholesky,
    /// Its preconditioner in two levels.
    Schwarz,
    /// Its matrix in assembled form.
    Assembled,
    /// A factorisation of the constant matrix of the semi-implicit integrator, rather than iterations.
    Factorisation,
    /// The dense inverse of that matrix.
    DenseInverse,
}

impl Feature {
    /// What the answer of a backend that lacks it contains.
    #[must_use]
    pub const fn wording(self) -> &'static str {
        match self {
            Self::Implicit => "the implicit integrator",
            Self::SemiImplicit => "the semi-implicit integrator",
            Self::Direct => "the linear solver direct",
            Self::IncompleteCholesky => "the preconditioner incomplete-cholesky",
            Self::Schwarz => "the preconditioner schwarz",
            Self::Assembled => "the matrix form assembled",
            Self::Factorisation => "a factorisation of the constant matrix",
            Self::DenseInverse => "the dense-inverse of the semi-implicit integrator",
        }
    }
}

/// Says once that a candidate is left out, and why.
pub(crate) fn is_lacking_printed(label: &str, feature: Feature) {
    static PRINTED: Mutex<Option<HashSet<(String, Feature)>>> = Mutex::new(None);
    let mut printed = PRINTED.lock().unwrap_or_else(PoisonError::into_inner);
    if printed.get_or_insert_default().insert((label.to_owned(), feature)) {
        println!("not run here: {label}: it does not offer {}", feature.wording());
    }
}
