//! CUDA gives the bits of the CPU, stage by stage and in whole runs, in both precisions.

use cloth_core::{ContactResponse, Integrator, SelfContact};
use harness::{
    backends::{Candidate, candidates},
    bits::first_difference,
};

use crate::{
    rig::{contact, integrators, run},
    scenes::layers,
};

/// CUDA in each precision, and the CPU in the same; nothing on a machine without an NVIDIA GPU.
pub(crate) fn pairs() -> impl Iterator<Item = [&'static Candidate; 2]> {
    let cuda = candidates().iter().filter(|candidate| candidate.label.starts_with("cuda"));
    cuda.map(|cuda| {
        let is_cpu =
            |one: &&Candidate| one.label.starts_with("cpu") && one.precision == cuda.precision;
        [cuda, candidates().iter().find(is_cpu).expect("it has both precisions")]
    })
}

#[test]
fn cuda_has_the_bits_of_the_cpu() {
    for [cuda, cpu] in pairs() {
        let builder = || layers(contact(2e-3, 0.3));
        let model = builder().build().expect("it is valid");
        // The semi-implicit one solves its system in another order.
        let is_exact = |integrator: &Integrator| !matches!(integrator, Integrator::SemiImplicit(_));
        for way in integrators(&model).into_iter().filter(|way| is_exact(&way.0)) {
            let what = format!("{} {:?}", cuda.label, way.0);
            let (_, expected) = run(cpu, builder(), way.clone(), 8);
            let (_, found) = run(cuda, builder(), way, 8);
            assert_eq!(first_difference(&expected.state, &found.state), None, "{what}");
            assert_eq!(expected.state.slips, found.state.slips, "{what}");
            let counts = |outcome: &crate::rig::Outcome| {
                (outcome.truncated, outcome.contacts, outcome.exempt, outcome.intersecting)
            };
            assert_eq!(counts(&expected), counts(&found), "{what}");
            assert!(found.contacts > 0, "{what}: they have not met");
        }
        // Contact of points gives others: what is compared has contact of triangles in it.
        let response = ContactResponse::Impulse { restitution: 0.0, friction: 0.3 };
        let points = SelfContact { distance: 2e-3, response };
        let way = integrators(&model)[0].clone();
        let (_, expected) = run(cpu, layers(points), way.clone(), 8);
        let (_, found) = run(cuda, builder(), way, 8);
        assert!(first_difference(&expected.state, &found.state).is_some());
    }
}
