//! Simulations with contact, of which no trajectory can be compared.

use cloth_core::{ContactResponse, ImplicitSettings, Integrator};
use harness::{
    backends::candidates,
    checks::{Scenario, invariants},
    feature::Feature,
};

#[test]
fn penetration_momentum_energy_and_strain_stay_within_bounds() {
    let impulse = ContactResponse::Impulse { restitution: 0.1, friction: 0.3 };
    let penalty = ContactResponse::Penalty { stiffness: 30.0, damping: 0.01 };
    for candidate in candidates() {
        let _turn = candidate.turn();
        for response in [impulse, penalty] {
            for (integrator, substeps) in [
                (Integrator::Explicit, 600),
                (Integrator::Implicit(ImplicitSettings::default()), 120),
            ] {
                let precision = candidate.precision;
                let implicit = matches!(integrator, Integrator::Implicit(_));
                if implicit && !candidate.offers(Feature::Implicit) {
                    continue;
                }
                // Plain loops look at all pairs, and a processor that stands for a GPU at each of its threads.
                let is_fast = candidate.case_divisor == 1 && candidate.label.starts_with('c');
                let scenario = Scenario {
                    side: if is_fast { 24 } else { 12 },
                    response,
                    precision,
                    substeps,
                    integrator,
                    strain_limit: true,
                };
                if let Err(failure) = invariants(candidate, &scenario) {
                    panic!("{scenario:?}: {failure}");
                }
            }
        }
    }
}
