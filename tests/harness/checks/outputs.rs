//! Stages that compute figures of a state.

use crate::{
    Verdict,
    backends::Candidate,
    models::Description,
    stages,
    tracked::Tracked,
    verdict::{compare, ensure},
};
use cloth_core::fabric::membrane;

/// `vertex_normals` against NUMERICS §9.
///
/// # Errors
/// What is wrong.
pub fn vertex_normals(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut found = Vec::new();
    case.kernels(candidate)?.vertex_normals(&mut found)?;
    let mut particles = case.particles();
    let expected = stages::vertex_normals(&case.model, &mut particles);
    compare(candidate, "normal", &expected, &found, &particles.uncertain)
}

/// `measure` against NUMERICS §10.
///
/// # Errors
/// What is wrong.
pub fn measure(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let found = case.kernels(candidate)?.measure()?;
    ensure(found.non_finite_particle.is_none(), || "finite, but not found so".into())?;
    let last = case.plan.substeps.len() - 1;
    let colliders = case.plan.colliders_at(last);
    let expected = stages::measure(&case.model, &case.particles(), colliders);
    let close = |what: &str, expected: Tracked, found: f64| {
        let bound = candidate.tolerance(expected);
        ensure((expected.value - found).abs() <= bound, || {
            format!("{what}: expected {:e}, found {found:e}, bound {bound:e}", expected.value)
        })
    };
    close("strain_max", expected.strain_max, found.strain_max)?;
    close("strain_mean", expected.strain_mean, found.strain_mean)?;
    close("penetration_max", expected.penetration_max, found.penetration_max)?;
    close("energy_kinetic", expected.energy_kinetic, found.energy_kinetic)?;
    close("energy_elastic", expected.energy_elastic, found.energy_elastic)?;
    close("energy_potential", expected.energy_potential, found.energy_potential)?;
    close("momentum_drift", expected.momentum_drift, found.momentum_drift)?;
    for (k, expected) in expected.momentum.0.into_iter().enumerate() {
        close("momentum", expected, found.momentum[k])?;
    }
    strain_particle(&case, found.strain_particle, expected.strain_max, candidate)
}

/// The particle that is named has the measured spring with the largest strain.
fn strain_particle(
    case: &crate::models::Case,
    particle: u32,
    strain_max: Tracked,
    candidate: &Candidate,
) -> Verdict {
    let springs = case.model.springs();
    let strain = |spring: &cloth_core::Spring| {
        let [a, b] = spring.particles.map(|i| glam::DVec3::from(case.state.positions[i as usize]));
        a.distance(b) / springs.kinds()[spring.kind as usize].rest_length - 1.0
    };
    let measured = springs.strain_measured();
    let own = springs
        .iter()
        .filter(|spring| measured[spring.kind as usize] && spring.particles.contains(&particle));
    let stretch = |triangle: &&cloth_core::FabricTriangle| {
        let corners = triangle.particles.map(|i| case.state.positions[i as usize]);
        let strain = membrane::strain(membrane::deformation(corners, &triangle.rest));
        membrane::principal_stretches(strain)[0] - 1.0
    };
    let triangles = case.model.elements().triangles().iter();
    let stretches = triangles.filter(|t| t.particles.contains(&particle)).map(|t| stretch(&t));
    let largest =
        own.map(|spring| strain(&spring)).chain(stretches).fold(f64::NEG_INFINITY, f64::max);
    ensure(
        !(measured.contains(&true) || case.model.has_fabric())
            || largest >= strain_max.value - 2.0 * candidate.tolerance(strain_max),
        || {
            format!(
                "particle {particle} is named for its strain, which is {largest}, not {}",
                strain_max.value
            )
        },
    )
}
