//! What is refused before any memory is taken.

use cloth_core::{Integrator, Result, SolverConfig};

use super::{linear, semi_implicit};

/// Whether settings make sense, and ask for what this backend has: to be known before any memory is taken.
///
/// # Errors
/// `Invalid`; `Unsupported` with what it has not.
pub(super) fn check_config(config: &SolverConfig) -> Result<()> {
    config.validate()?;
    match &config.integrator {
        Integrator::Explicit => Ok(()),
        Integrator::Implicit(settings) => linear::check_settings(&settings.linear),
        Integrator::Midpoint(settings) => linear::check_settings(&settings.linear),
        Integrator::SemiImplicit(settings) => semi_implicit::check_solve(settings.solve),
        other => linear::unsupported(format!("the integrator {other:?}")),
    }
}

#[cfg(test)]
mod tests {
    use cloth_core::{
        Error, ImplicitSettings, LinearMethod, LinearStop, MatrixForm, Preconditioner,
        SemiImplicitSettings, SemiImplicitSolve,
    };

    use super::*;

    fn refused(integrator: Integrator) -> String {
        match check_config(&SolverConfig { integrator, ..SolverConfig::default() }) {
            Ok(()) => String::new(),
            Err(Error::Unsupported { backend, feature }) => {
                assert_eq!(backend, "cuda");
                feature
            }
            Err(error) => panic!("{error}"),
        }
    }

    #[test]
    fn what_is_not_offered_is_refused_by_name() {
        let implicit = |change: &dyn Fn(&mut ImplicitSettings)| {
            let mut settings = ImplicitSettings::default();
            settings.linear.method = LinearMethod::ConjugateGradient;
            settings.linear.preconditioner = Preconditioner::Block;
            settings.linear.matrix = MatrixForm::MatrixFree;
            change(&mut settings);
            refused(Integrator::Implicit(settings))
        };
        let semi_implicit =
            |solve| refused(Integrator::SemiImplicit(SemiImplicitSettings { solve }));
        assert_eq!(refused(Integrator::Explicit), "");
        assert_eq!(implicit(&|_| ()), "");
        assert_eq!(implicit(&|settings| settings.linear.method = LinearMethod::Jacobi), "");
        assert_eq!(semi_implicit(SemiImplicitSolve::Factorisation), "");
        let direct = implicit(&|settings| settings.linear.method = LinearMethod::Direct);
        assert_eq!(direct, "the linear solver direct");
        let assembled = implicit(&|settings| settings.linear.matrix = MatrixForm::Assembled);
        assert_eq!(assembled, "the matrix form assembled");
        let incomplete = Preconditioner::IncompleteCholesky;
        let incomplete = implicit(&|settings| settings.linear.preconditioner = incomplete);
        assert_eq!(incomplete, "the preconditioner incomplete-cholesky");
        let schwarz = Preconditioner::Schwarz;
        assert_eq!(implicit(&|settings| settings.linear.preconditioner = schwarz), "");
        assert_eq!(implicit(&|settings| settings.linear.stop = LinearStop::Energy), "");
        let dense = semi_implicit(SemiImplicitSolve::DenseInverse);
        assert!(dense.contains("dense-inverse"), "{dense}");
        let negative = SolverConfig { time_step: -1.0, ..SolverConfig::default() };
        assert!(matches!(check_config(&negative), Err(Error::Invalid(_))));
    }
}
