//! Tens of substeps without contact.

use harness::{
    checks,
    models::{Contact, Deformation, Description, description},
    runner::for_all,
};
use proptest::strategy::Strategy;

/// Cases of which a trajectory can be compared.
fn cases() -> impl Strategy<Value = Description> {
    description().prop_map(|mut description| {
        description.contact = Contact::Off;
        description.colliders = 0;
        // It turns an error of position into one of velocity, larger by 1/h, for every colour: after
        // a few substeps the bound would say nothing.
        description.strain_limit = false;
        // A spring of no length has no direction that an error could be bounded by.
        if matches!(description.deformation, Deformation::Coinciding) {
            description.deformation = Deformation::Jitter;
        }
        description
    })
}

#[test]
fn trajectories_stay_within_the_bound_of_their_rounding_errors() {
    for_all(24, &cases(), |candidate, case| checks::trajectory(candidate, case, 20));
}

#[test]
fn trajectories_under_forces_stay_within_the_bound_of_their_rounding_errors() {
    for_all(24, &cases(), |candidate, case| checks::control_forces_trajectory(candidate, case, 20));
}

#[test]
fn implicit_trajectories_stay_near_the_reference() {
    for_all(24, &cases(), |candidate, case| checks::implicit_trajectory(candidate, case, 8));
}
