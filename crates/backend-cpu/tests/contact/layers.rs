//! Sheets on sheets.

use cloth_core::{
    ImplicitSettings, Integrator, ModelBuilder, Precision,
    contact::{Contact, Contacts},
};

use crate::rig::{Numbers, Run, contact, integrators, sheet};

const SPACING: f64 = 5e-3;
const SIDE: u32 = 10;
const LAYERS: usize = 10;
const DROP: f64 = 0.05;
const GAP: f64 = 1.5e-3;

/// A pinned sheet and others above it, turned and shifted at random.
fn layers(drop: f64) -> ModelBuilder {
    let mut numbers = Numbers(5);
    let mut builder = ModelBuilder::new().self_contact(contact(1e-3, 0.3));
    for layer in 0..LAYERS {
        let [x, y, turn] = std::array::from_fn(|_| numbers.next());
        let height = if layer == 0 { 0.0 } else { drop + GAP * layer as f64 };
        let centre = [SPACING * x, SPACING * y, height];
        let mut cloth = sheet(&format!("{layer}"), SIDE, SPACING, centre, turn);
        if layer == 0 {
            cloth.pins = (0..SIDE * SIDE).collect();
        }
        builder = builder.cloth(cloth);
    }
    builder
}

#[test]
fn ten_layers_fall_freely_and_do_not_pass() {
    for (integrator, time_step) in integrators(&layers(DROP).build().unwrap()) {
        for precision in [Precision::F32, Precision::F64] {
            let mut run = Run::new(layers(DROP), integrator.clone(), time_step, precision, 2);
            let steps = |time: f64| (time / time_step).round();
            for frame in 1..=10 {
                run.frame(1.0 / 60.0);
                assert_eq!(run.crossings(), 0, "frame {frame} {integrator:?} {precision:?}");
                assert_eq!(run.report.contact_exempt, 0);
                let time = f64::from(frame) / 60.0;
                // Symplectic steps: g h^2 n (n + 1) / 2.
                let n = steps(time);
                let free = 0.5 * 9.81 * time_step * time_step * n * (n + 1.0);
                let fallen = DROP + GAP * (LAYERS - 1) as f64 - run.height(LAYERS - 1);
                if frame <= 5 {
                    assert!((fallen - free).abs() < 3e-3 * free, "{fallen} {free} {integrator:?}");
                    assert_eq!(run.truncated, 0, "{integrator:?}");
                }
            }
            assert!(run.report.contacts > 0, "they have not met");
        }
    }
}

#[test]
fn a_stack_comes_to_rest() {
    let implicit = Integrator::Implicit(ImplicitSettings::default());
    let mut run = Run::new(layers(0.0), implicit, 1.0 / 120.0, Precision::F32, 2);
    for frame in 0..24 {
        run.frame(1.0 / 60.0);
        assert_eq!(run.crossings(), 0, "frame {frame}");
    }
    run.truncated = 0;
    (0..4).for_each(|_| run.frame(1.0 / 60.0));
    assert_eq!(run.truncated, 0, "the certificate acts on what rests");
    assert!(run.speed_max() < 1e-3, "{} m/s", run.speed_max());
    // Where all layers lie on each other: corners hang down beside those below.
    let heights: Vec<f64> = (0..LAYERS).map(|layer| run.height_within(layer, 0.012)).collect();
    for pair in heights.windows(2) {
        let gap = pair[1] - pair[0];
        assert!((0.95e-3..1.03e-3).contains(&gap), "{heights:?}");
    }
    let right = 1e-3 * (LAYERS - 1) as f64;
    assert!((heights[LAYERS - 1] / right - 1.0).abs() < 0.02, "{heights:?}");
    // What contacts carry upwards is the weight of all above: layer l hangs on l contacts with another.
    let mut contacts = Contacts::default();
    run.solver.contacts_read(&mut contacts).unwrap();
    let upwards = |c: &Contact| (c.force * c.normal[2] + c.friction[2]).abs();
    let cloth = |i: u32| i / (SIDE * SIDE);
    let between = |c: &&Contact| cloth(c.particles[0]) != cloth(c.particles[3]);
    let carried: f64 = contacts.contacts.iter().filter(between).map(upwards).sum();
    let masses = &run.model.masses()[(SIDE * SIDE) as usize..];
    let layer = 9.81 * masses.iter().sum::<f64>() / (LAYERS - 1) as f64;
    let weights = layer * ((LAYERS - 1) * LAYERS / 2) as f64;
    assert!((carried / weights - 1.0).abs() < 0.1, "{carried} N for {weights} N");
}

#[test]
fn a_sheet_does_not_bounce() {
    let builder = || {
        let mut below = sheet("below", 14, SPACING, [0.0; 3], 0.0);
        below.pins = (0..14 * 14).collect();
        let above = sheet("above", 8, SPACING, [0.002, 0.001, 0.06], 0.3);
        ModelBuilder::new().cloth(below).cloth(above).self_contact(contact(1e-3, 0.3))
    };
    let time_step = 1.5e-4_f64.min(0.9 * builder().build().unwrap().stable_time_step());
    let mut run = Run::new(builder(), Integrator::Explicit, time_step, Precision::F32, 2);
    let mut highest = 0.0_f64;
    for frame in 0..14 {
        run.frame(1.0 / 60.0);
        // It meets the other after 7 frames of 1/60 s.
        if frame >= 7 {
            highest = highest.max(run.height(1));
        }
    }
    assert!(highest > 0.0 && highest < 3e-3, "{highest} m after a fall of 60 mm");
}

#[test]
fn a_patch_lies_on_a_pinned_sheet() {
    let builder = || {
        let mut below = sheet("below", 30, SPACING, [0.0; 3], 0.0);
        below.pins = vec![0, 29, 870, 899];
        let above = sheet("above", 10, SPACING, [0.003, 0.001, 0.01], 0.3);
        ModelBuilder::new().cloth(below).cloth(above).self_contact(contact(1e-3, 0.3))
    };
    let implicit = Integrator::Implicit(ImplicitSettings::default());
    let mut run = Run::new(builder(), implicit, 1.0 / 60.0, Precision::F32, 2);
    for frame in 0..30 {
        run.frame(1.0 / 60.0);
        assert_eq!(run.crossings(), 0, "frame {frame}");
    }
    let above = &run.state.positions[900..];
    assert!(above.iter().all(|x| x[2] > -0.1), "it has fallen through");
}

#[test]
fn a_patch_that_is_shot_at_a_strip_does_not_pass() {
    let builder = || {
        let mut strip = sheet("strip", 24, SPACING, [0.0; 3], 0.0);
        strip.pins = (0..24).chain(23 * 24..24 * 24).collect();
        let mut patch = sheet("patch", 8, SPACING, [0.003, 0.001, 0.03], 0.3);
        patch.velocity = [0.0, 1.0, -20.0];
        ModelBuilder::new().cloth(strip).cloth(patch).self_contact(contact(1e-3, 0.3))
    };
    for (integrator, time_step) in integrators(&builder().build().unwrap()) {
        let mut run = Run::new(builder(), integrator.clone(), time_step, Precision::F32, 2);
        for frame in 0..6 {
            run.frame(1.0 / 60.0);
            assert_eq!(run.crossings(), 0, "frame {frame} {integrator:?}");
        }
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let implicit = Integrator::Implicit(ImplicitSettings::default());
    let states = [1, 2].map(|threads| {
        let mut run =
            Run::new(layers(2e-3), implicit.clone(), 1.0 / 120.0, Precision::F32, threads);
        (0..6).for_each(|_| run.frame(1.0 / 60.0));
        assert!(run.report.contacts > 0, "they have not met");
        run.state
    });
    assert_eq!(states[0], states[1]);
}

#[test]
fn without_the_response_the_same_layers_pass() {
    let bare = || {
        let response = cloth_core::ContactResponse::Impulse { restitution: 0.0, friction: 0.3 };
        layers(DROP).self_contact(cloth_core::SelfContact { distance: 1e-3, response })
    };
    let implicit = Integrator::Implicit(ImplicitSettings::default());
    let mut run = Run::new(bare(), implicit, 1.0 / 120.0, Precision::F32, 2);
    (0..10).for_each(|_| run.frame(1.0 / 60.0));
    assert!(run.crossings() > 0, "the count sees nothing");
}
