//! The modules that a model will most likely need, so that they are compiled side by side where it is run for the first time: one after the
//! other they take longer than the first seconds of a scene. One that is missing here is compiled when it is used.

use cloth_core::{Feature, FeatureSet, Integrator, LinearMethod, Preconditioner};

use crate::solver_form::SolverForm;

/// A module, and its option if it is of a solver of linear systems.
pub(crate) type Foreseen = (&'static str, Option<&'static str>);

/// Those of a model with these features and so many particles on a device with so many multiprocessors, first those that take longest.
pub(crate) fn foreseen(
    features: FeatureSet,
    integrator: &Integrator,
    (particles, multiprocessors): (usize, usize),
) -> Vec<Foreseen> {
    let mut all: Vec<Foreseen> = Vec::new();
    let triangles = features.has(Feature::TriangleContact);
    let linear = integrator.linear();
    if let Some(linear) = linear {
        let is_schwarz = linear.preconditioner == Preconditioner::Schwarz;
        let form = |touches| SolverForm::of(particles, multiprocessors, is_schwarz, touches);
        // Cloth falls before it touches.
        let mut forms = vec![form(false)];
        forms.extend(Some(form(triangles)).filter(|other| !forms.contains(other)));
        let module = match linear.method {
            LinearMethod::ConjugateGradient => Some("conjugate_gradient"),
            LinearMethod::Jacobi => Some("jacobi"),
            _ => None,
        };
        if let Some(module) = module {
            all.extend(forms.iter().map(|form| (module, form.option())));
        }
        all.extend(IMPLICIT.map(plain));
    }
    all.push(plain("measure"));
    if triangles {
        all.extend(TRIANGLES.map(plain));
    }
    if features.has(Feature::Fabric) && linear.is_some() {
        all.extend(["membrane_linearise", "bending_linearise", "bending_forces"].map(plain));
    }
    // All of these are parts of the kernel of frames otherwise.
    if triangles && *integrator == Integrator::Explicit {
        all.extend(EXPLICIT.map(plain));
        if features.has(Feature::Fabric) {
            all.extend(["membrane_forces", "bending_forces"].map(plain));
        }
    }
    if linear.is_some() || triangles {
        let of_features = [
            (Feature::Air, "aerodynamic_forces"),
            (Feature::ProceduralFields, "procedural_forces"),
            (Feature::Colliders, "collider_response"),
        ];
        let there = of_features.into_iter().filter(|&(feature, _)| features.has(feature));
        all.extend(there.map(|(_, module)| plain(module)));
    }
    if linear.is_some_and(|linear| linear.preconditioner == Preconditioner::Auto) {
        all.push(("conjugate_gradient", SolverForm::Schwarz.option()));
        all.push(plain("preconditioner_build_schwarz"));
    }
    all
}

const fn plain(module: &'static str) -> Foreseen {
    (module, None)
}

/// What every implicit step needs.
const IMPLICIT: [&str; 11] = [
    "implicit_assemble",
    "spring_linearise",
    "matrix_apply",
    "preconditioner_build",
    "implicit_motion",
    "vector_dot",
    "vector_combine",
    "vector_fill",
    "constraint_filter",
    "constraint_project",
    "field_forces",
];

/// What contact of triangles needs.
const TRIANGLES: [&str; 6] = [
    "contact_certify",
    "contact_pairs",
    "contact_geometry",
    "contact_forces",
    "contact_linearise",
    "vertex_normals",
];

/// What an explicit step needs whose stages are kernels of their own.
const EXPLICIT: [&str; 3] = ["spring_forces", "field_forces", "integrate_explicit"];

#[cfg(test)]
mod tests {
    use cloth_core::{ImplicitSettings, LinearSettings};
    use cloth_kernels::CudaModule;

    use super::*;

    #[test]
    fn all_that_is_foreseen_exists_once() {
        let features = FeatureSet::of(&Feature::ALL);
        let linear = |method, preconditioner| {
            let linear = LinearSettings { method, preconditioner, ..LinearSettings::default() };
            Integrator::Implicit(ImplicitSettings { linear, ..ImplicitSettings::default() })
        };
        let solves = [
            (Integrator::Explicit, 0),
            (linear(LinearMethod::Jacobi, Preconditioner::Block), 1),
            (linear(LinearMethod::ConjugateGradient, Preconditioner::Auto), 2),
        ];
        // With as many particles as this solves are of another form once triangles touch.
        for (particles, more) in [(10_000, 0), (20_000, 1)] {
            for (integrator, forms) in &solves {
                let all = foreseen(features, integrator, (particles, 132));
                for (at, (module, option)) in all.iter().enumerate() {
                    let found = CudaModule::find(module).unwrap_or_else(|| panic!("{module}"));
                    assert!(option.is_none_or(|option| found.options.contains(&option)));
                    assert!(!all[..at].contains(&(module, *option)), "{module} twice");
                }
                let found = all.iter().filter(|(name, _)| SolverForm::MODULES.contains(name));
                let expected = if *forms == 0 { 0 } else { forms + more };
                assert_eq!(found.count(), expected, "{integrator:?}");
            }
        }
    }
}
