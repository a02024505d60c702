//! How a scene is to be solved, in place of what it says itself.

use clap::Args;
use cloth::{
    LinearMethod, LinearStop, Preconditioner,
    scene::{Scene, SceneAdaptive, SceneSolver},
};

use crate::failure::Failure;

#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Solver, in place of the scene's")]
pub(crate) struct SolverArguments {
    /// How the state is advanced: explicit, implicit, semi-implicit or midpoint.
    #[arg(long)]
    pub(crate) solver: Option<SceneSolver>,
    /// Method for the linear systems of the implicit solver: cg, jacobi or direct.
    #[arg(long, value_name = "METHOD")]
    pub(crate) linear: Option<LinearMethod>,
    /// Preconditioner of the method cg: diagonal, block, incomplete-cholesky, schwarz or auto.
    #[arg(long)]
    pub(crate) preconditioner: Option<Preconditioner>,
    /// What cg measures to know when to stop: residual, or energy for the error in the norm of the energy.
    #[arg(long)]
    pub(crate) stop: Option<LinearStop>,
    /// Relative residual, or what --stop says, at which cg and jacobi stop, 0 to 1; 0 runs all iterations.
    #[arg(long, value_parser = share)]
    pub(crate) tolerance: Option<f64>,
    /// Iterations of cg and jacobi for each system at most.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) iterations: Option<u32>,
    /// Iterations of Newton's method in each substep of the implicit solver.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) newton: Option<u32>,
    /// Length of a substep [s].
    #[arg(long, value_name = "SECONDS", value_parser = length)]
    pub(crate) time_step: Option<f64>,
    /// Do substeps that go wrong again with shorter ones.
    #[arg(long)]
    pub(crate) adaptive: bool,
}

impl SolverArguments {
    /// Puts what is given into the scene.
    pub(crate) fn apply(&self, scene: &mut Scene) -> Result<(), Failure> {
        let simulation = &mut scene.simulation;
        if self.solver.is_some() {
            simulation.solver = self.solver;
        }
        let implicit = &mut simulation.implicit;
        set(&mut implicit.linear, self.linear);
        set(&mut implicit.preconditioner, self.preconditioner);
        set(&mut implicit.stop, self.stop);
        set(&mut implicit.tolerance, self.tolerance);
        set(&mut implicit.iterations, self.iterations);
        set(&mut implicit.newton_iterations, self.newton);
        let linear = implicit.linear;
        if let Some(time_step) = self.time_step {
            simulation.time_step_set(time_step);
        }
        if self.adaptive {
            simulation.adaptive.get_or_insert_with(SceneAdaptive::default);
        }
        self.check(simulation.solver_given(), linear)
    }

    /// Refuses what the solver and the method in use have no use for.
    fn check(&self, solver: Option<SceneSolver>, linear: LinearMethod) -> Result<(), Failure> {
        let given = [
            ("--linear", self.linear.is_some()),
            ("--preconditioner", self.preconditioner.is_some()),
            ("--stop", self.stop.is_some()),
            ("--tolerance", self.tolerance.is_some()),
            ("--iterations", self.iterations.is_some()),
            ("--newton", self.newton.is_some()),
        ];
        let first = |names: &[&str]| {
            given.iter().find(|(name, given)| *given && names.contains(name)).map(|(name, _)| *name)
        };
        // The midpoint solver solves its systems as the implicit one does, one in each substep.
        let unused = match solver {
            Some(SceneSolver::Implicit) => None,
            Some(SceneSolver::Midpoint) => first(&["--newton"]),
            _ => given.iter().find(|(_, given)| *given).map(|(name, _)| *name),
        };
        if let Some(name) = unused {
            let used = match solver {
                Some(solver) => format!("the {} one is in use", solver.name()),
                None => "the scene leaves the solver to the model".into(),
            };
            return Err(Failure::Usage(format!(
                "{name} belongs to the implicit solver, but {used}; add --solver implicit or leave \
                 {name} out"
            )));
        }
        if linear != LinearMethod::ConjugateGradient
            && let Some(name) = first(&["--preconditioner", "--stop"])
        {
            return Err(Failure::Usage(format!(
                "{name} belongs to the method cg, but {linear} is in use; add --linear cg or leave \
                 {name} out"
            )));
        }
        if linear == LinearMethod::Direct
            && let Some(name) = first(&["--tolerance", "--iterations"])
        {
            return Err(Failure::Usage(format!(
                "{name} belongs to methods that iterate, but {linear} is in use; add --linear cg or \
                 leave {name} out"
            )));
        }
        Ok(())
    }
}

fn set<T>(place: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *place = value;
    }
}

fn share(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value| (0.0..=1.0).contains(value));
    value.ok_or_else(|| "give a number from 0 to 1".into())
}

fn length(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value: &f64| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "give a number of seconds above zero".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn usage(arguments: &SolverArguments, scene: &mut Scene) -> String {
        match arguments.apply(scene) {
            Err(Failure::Usage(message)) => message,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn settings_go_to_the_solver_in_use() {
        let mut scene = Scene::new("test");
        let arguments = SolverArguments {
            solver: Some(SceneSolver::Implicit),
            linear: Some(LinearMethod::Jacobi),
            tolerance: Some(0.25),
            newton: Some(3),
            time_step: Some(0.02),
            adaptive: true,
            ..SolverArguments::default()
        };
        arguments.apply(&mut scene).unwrap();
        let explicit = Scene::new("test").simulation.time_step;
        assert_eq!(scene.simulation.time_step, explicit, "that of another solver");
        assert_eq!(scene.simulation.implicit.time_step, Some(0.02));
        assert_eq!(scene.simulation.implicit.linear, LinearMethod::Jacobi);
        assert_eq!(scene.simulation.implicit.tolerance, 0.25);
        assert_eq!(scene.simulation.implicit.newton_iterations, 3);
        assert_eq!(scene.simulation.adaptive, Some(SceneAdaptive::default()));
        // The scene now says implicit itself.
        let again = SolverArguments { iterations: Some(9), ..SolverArguments::default() };
        again.apply(&mut scene).unwrap();
        assert_eq!(scene.simulation.implicit.iterations, 9);
    }

    #[test]
    fn settings_without_use_are_refused() {
        let linear = |linear| SolverArguments { linear: Some(linear), ..Default::default() };
        let message = usage(&linear(LinearMethod::Jacobi), &mut Scene::new("test"));
        assert!(message.contains("--linear belongs to the implicit solver"), "{message}");
        assert!(message.contains("the scene leaves the solver to the model"), "{message}");
        let mut explicit = Scene::new("test");
        explicit.simulation.time_step = Some(1e-3);
        let message = usage(&linear(LinearMethod::Jacobi), &mut explicit);
        assert!(message.contains("the explicit one is in use"), "{message}");
        let arguments = SolverArguments {
            solver: Some(SceneSolver::Implicit),
            preconditioner: Some(Preconditioner::Diagonal),
            ..linear(LinearMethod::Jacobi)
        };
        let message = usage(&arguments, &mut Scene::new("test"));
        assert!(message.contains("--preconditioner belongs to the method cg"), "{message}");
        let arguments = SolverArguments {
            solver: Some(SceneSolver::Implicit),
            tolerance: Some(0.1),
            ..linear(LinearMethod::Direct)
        };
        let message = usage(&arguments, &mut Scene::new("test"));
        assert!(message.contains("--tolerance belongs to methods that iterate"), "{message}");
    }

    #[test]
    fn numbers_have_their_bounds() {
        for wrong in ["-0.1", "1.5", "nan", "inf", "x", ""] {
            assert!(share(wrong).is_err(), "{wrong}");
        }
        for wrong in ["0", "-1", "nan", "inf", "1e999", "x"] {
            assert!(length(wrong).is_err(), "{wrong}");
        }
        assert_eq!((share("0"), share("1"), length("1e-3")), (Ok(0.0), Ok(1.0), Ok(1e-3)));
    }
}
