//! Whole runs: nothing passes, and cloth comes to lie where it does on the processor.

use cloth_core::{ContactResponse, ImplicitSettings, Integrator, ModelBuilder, SelfContact};

use crate::{
    pairs::seven_layers,
    rig::{contact, integrators, others, processor, run, sheet},
};

const SPACING: f64 = 0.01;
const DISTANCE: f64 = 2e-3;

/// Three sheets that fall on a pinned one, turned against each other.
pub(crate) fn layers(contact: SelfContact) -> ModelBuilder {
    let heights = [0.0, 0.012, 0.016, 0.02];
    let builder = ModelBuilder::new().self_contact(contact);
    heights.into_iter().enumerate().fold(builder, |builder, (k, height)| {
        let turn = 0.3 * k as f64;
        let mut cloth =
            sheet(&format!("{k}"), 9, SPACING, [1e-3 * turn, 2e-3 * turn, height], turn);
        if k == 0 {
            cloth.pins = (0..81).collect();
        }
        builder.cloth(cloth)
    })
}

#[test]
fn layers_fall_and_do_not_pass() {
    let model = layers(contact(DISTANCE, 0.3)).build().expect("it is valid");
    for candidate in others() {
        let _turn = candidate.turn();
        let mut truncated = 0;
        for way in integrators(&model) {
            let (model, expected) =
                run(processor(), layers(contact(DISTANCE, 0.3)), way.clone(), 8);
            let (_, found) = run(candidate, layers(contact(DISTANCE, 0.3)), way.clone(), 8);
            let what = format!("{} {:?}", candidate.label, way.0);
            assert_eq!(found.intersecting, 0, "{what}");
            assert_eq!(found.exempt, 0, "{what}");
            assert!(found.contacts > 0, "{what}: they have not met");
            truncated += found.truncated;
            for cloth in 0..4 {
                let heights = [&expected, &found].map(|o| o.centre(&model, cloth)[2]);
                let apart = (heights[0] - heights[1]).abs();
                assert!(apart < 0.2 * DISTANCE, "{what}: layer {cloth} {heights:?}");
            }
        }
        assert!(truncated > 0, "no way was shortened");
    }
}

/// Seven layers that fall on a floor, in more groups than a workgroup has threads. Linearised implicit steps of these are looked at one by
/// one where lists of pairs are.
#[test]
fn seven_layers_on_a_floor_do_not_pass() {
    let model = seven_layers().build().expect("it is valid");
    for candidate in others() {
        let _turn = candidate.turn();
        let [newton, explicit, _, _] = integrators(&model);
        for way in [newton, explicit] {
            let (_, found) = run(candidate, seven_layers(), way.clone(), 3);
            let what = format!("{} {:?}", candidate.label, way.0);
            println!("{what}: {} shortened", found.truncated);
            assert_eq!((found.intersecting, found.exempt), (0, 0), "{what}");
            assert!(found.contacts > 0, "{what}: they have not met");
        }
    }
}

/// The same scene with contact of points: the audit sees what passes.
#[test]
fn without_it_layers_pass() {
    let response = ContactResponse::Impulse { restitution: 0.0, friction: 0.3 };
    let points = SelfContact { distance: DISTANCE, response };
    let implicit = Integrator::Implicit(ImplicitSettings::default());
    for candidate in others() {
        let _turn = candidate.turn();
        let (_, found) = run(candidate, layers(points), (implicit.clone(), 1.0 / 120.0), 8);
        assert!(found.intersecting > 0, "the audit sees nothing");
    }
}

/// A patch that is shot at a strip: ways are shortened by far if a step is explicit, and pins stay where they are.
#[test]
fn a_patch_that_is_shot_at_a_strip_does_not_pass() {
    let builder = || {
        let mut strip = sheet("strip", 12, SPACING, [0.0; 3], 0.0);
        strip.pins = (0..12).chain(11 * 12..12 * 12).collect();
        let mut patch = sheet("patch", 5, SPACING, [0.003, 0.001, 0.03], 0.3);
        patch.velocity = [0.0, 1.0, -20.0];
        ModelBuilder::new().cloth(strip).cloth(patch).self_contact(contact(DISTANCE, 0.3))
    };
    let model = builder().build().expect("it is valid");
    for candidate in others() {
        let _turn = candidate.turn();
        for way in integrators(&model) {
            let (_, found) = run(candidate, builder(), way.clone(), 4);
            let what = format!("{} {:?}", candidate.label, way.0);
            assert_eq!(found.intersecting, 0, "{what}");
            assert!(found.contacts > 0, "{what}: it has not met anything");
            let is_explicit = matches!(way.0, Integrator::Explicit);
            assert!(!is_explicit || found.truncated > 0, "{what}: no way was shortened");
        }
    }
}

/// A patch on a pinned sheet that slopes: friction holds it as it does on the processor, and without friction it slides.
#[test]
fn friction_holds_a_patch_on_a_slope() {
    let (sin, cos) = 0.2_f64.sin_cos();
    let builder = |friction: f64| {
        let mut below = sheet("below", 12, SPACING, [0.0; 3], 0.0);
        below.pins = (0..144).collect();
        let above = sheet("above", 5, SPACING, [0.003, 0.001, 0.9 * DISTANCE], 0.3);
        let field = [9.81 * sin, 0.0, -9.81 * cos];
        ModelBuilder::new()
            .gravity(field)
            .cloth(below)
            .cloth(above)
            .self_contact(contact(DISTANCE, friction))
    };
    let implicit = (Integrator::Implicit(ImplicitSettings::default()), 1.0 / 120.0);
    for candidate in others() {
        let _turn = candidate.turn();
        let drift = |candidate, friction| {
            let (model, outcome) = run(candidate, builder(friction), implicit.clone(), 20);
            assert_eq!(outcome.intersecting, 0);
            outcome.centre(&model, 1)[0] - 0.003
        };
        let (expected, found) = (drift(processor(), 0.5), drift(candidate, 0.5));
        assert!((expected - found).abs() < 2e-4, "{expected} {found}");
        assert!(drift(candidate, 0.0) > 10.0 * found.abs().max(1e-3), "{found}");
    }
}
