//! What a check answers.

use std::fmt;

use cloth_core::LinearOutcome;

use crate::{backends::Candidate, tracked::TrackedVector};

/// `Ok` if the candidate passed, or what it did wrong.
pub type Verdict = Result<(), Failure>;

/// What a candidate did wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    message: String,
    /// The feature that the backend says it does not have.
    unsupported: Option<String>,
}

impl Failure {
    /// The feature that the backend says it does not have, if that is what is wrong.
    #[must_use]
    pub fn unsupported(&self) -> Option<&str> {
        self.unsupported.as_deref()
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}

impl From<cloth_core::Error> for Failure {
    fn from(error: cloth_core::Error) -> Self {
        let message = error.to_string();
        let unsupported = match error {
            cloth_core::Error::Unsupported { feature, .. } => Some(feature),
            _ => None,
        };
        Self { message, unsupported }
    }
}

/// `Ok` if `condition` holds, else the failure that `describe` words.
///
/// # Errors
/// The failure.
pub fn ensure(condition: bool, describe: impl FnOnce() -> String) -> Verdict {
    if condition { Ok(()) } else { Err(Failure { message: describe(), unsupported: None }) }
}

/// Compares vectors, such as forces, with what the plain loops found; each component must be within
/// its own bound. Entries for which `uncertain` is set are left out: for them rounding decides on
/// which side of a threshold a particle is, and both answers are right.
///
/// # Errors
/// The first component that is outside.
pub fn compare(
    candidate: &Candidate,
    what: &str,
    expected: &[TrackedVector],
    found: &[[f64; 3]],
    uncertain: &[bool],
) -> Verdict {
    ensure(expected.len() == found.len(), || {
        format!("{}: {} {what}, expected {}", candidate.label, found.len(), expected.len())
    })?;
    for (i, (expected, found)) in expected.iter().zip(found).enumerate() {
        if uncertain.get(i) == Some(&true) {
            continue;
        }
        for (k, (expected, &found)) in expected.0.iter().zip(found).enumerate() {
            let bound = candidate.tolerance(*expected);
            // Written so that NaN fails.
            let within = (expected.value - found).abs() <= bound;
            ensure(within, || {
                format!(
                    "{}: {what} of particle {i}, component {k}: expected {:e}, found {found:e}, \
                     difference {:e}, bound {bound:e}",
                    candidate.label,
                    expected.value,
                    (expected.value - found).abs()
                )
            })?;
        }
    }
    Ok(())
}

/// Whether two solves went the same way. The estimate of the energy counts where both made one: kernels that solve
/// without the host make one only where it decides when to stop.
#[must_use]
pub fn same_solve(a: &LinearOutcome, b: &LinearOutcome) -> bool {
    let agrees = a.energy.zip(b.energy).is_none_or(|(a, b)| a.to_bits() == b.to_bits());
    agrees && LinearOutcome { energy: b.energy, ..*a } == *b
}
