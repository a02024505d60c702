//! What diverges says so on every backend, and why.

use cloth::{Divergence, DivergenceOrigin, Error, Precision};
use harness::backends::{Candidate, candidates};

use crate::report::simulation;

fn patch(more: &str) -> String {
    format!(
        r#"
name = "patch"
simulation = {{ frames = 8, frames_per_second = 30, time_step = 5e-4, strain_bound = 2 }}

[[cloth]]
name = "patch"
model = "springs"
geometry.grid = {{ columns = 5, rows = 5, spacing = 0.02 }}
material = {{ preset = "jersey" }}
pins = ["left"]

{more}
"#
    )
}

/// Particles that no spring joins.
fn loose(more: &str) -> String {
    format!(
        r#"
name = "loose"
simulation = {{ frames = 8, frames_per_second = 30, time_step = 5e-4, strain_bound = 2 }}

[[cloth]]
name = "loose"
material = {{ mass.per_particle = 1e-3, thickness = 1e-3, stretch.stiffness = 1, shear.stiffness = 1, bend.stiffness = 1 }}

[cloth.geometry.network]
width = 3
positions = [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]]

{more}
"#
    )
}

/// With all that looks at distances beside springs.
const BUSY: [&str; 2] = [
    "[contact]\ndistance = 0.018\nresponse.penalty = { stiffness = 5, damping = 0.001 }\n[[collider]]\nname = \"ball\"\nshape.sphere.radius = 0.05\ntranslation = [0, 0, -0.3]\n",
    "[contact]\ndistance = 0.018\nresponse.impulse.friction = 0.3\n[[collider]]\nname = \"box\"\nshape.box.half_extents = [0.1, 0.1, 0.1]\ntranslation = [0, 0, -0.3]\n",
];

fn field(expression: &str) -> String {
    format!("[[field]]\nexpression = {expression:?}\n")
}

fn in_single() -> impl Iterator<Item = &'static Candidate> {
    candidates().iter().filter(|candidate| candidate.precision == Precision::F32)
}

/// How a run ends within its frames.
fn divergence(candidate: &Candidate, text: &str) -> Option<Divergence> {
    let _turn = candidate.turn();
    let mut simulation = simulation(candidate, text);
    while !simulation.is_finished() {
        simulation.state().unwrap();
        match simulation.step() {
            Ok(_) => {}
            Err(Error::Diverged(divergence)) => return Some(divergence),
            Err(error) => panic!("{}: {error}", candidate.label),
        }
    }
    None
}

/// Numbers that are not finite: at once and later, in one particle and in all, with springs and without.
#[test]
fn every_backend_reports_what_is_not_finite() {
    for expression in [
        "vec3(0, 0, 1 / (x.x - x.x))",
        "vec3(0, (t - t) / (x.x - x.x), 0)",
        "vec3(0, 0, sqrt(-1 - t))",
        "vec3(0, 0, log(-1 - t))",
        "select(id < 1, vec3(0, 0, (t - t) / (x.x - x.x)), vec3(0, 0, 0))",
        "select(t > 0.05, vec3(1 / (t - t), 0, 0), vec3(0, 0, 0))",
        "vec3(0, 0, 1e38 * m * exp(100 + t))",
        "m * exp(t * 2000) * vec3(0, 0, 1)",
        "1e9 * m * v + vec3(0, 0, m)",
        "1e38 * m * (100 + t) * vec3(1, 1, 1)",
        "1e37 * m * vec3(x.x, 1, 1) * select(t > 0.1, 300, 0)",
        "1e19 * m * vec3(x.x, x.y, 1) / (t - 0.1 + x.x - x.x)",
    ] {
        let busy = BUSY.map(|more| patch(&(field(expression) + more)));
        for text in [patch(&field(expression)), loose(&field(expression))].iter().chain(&busy) {
            // In double precision some of these are still numbers after all frames.
            for candidate in in_single() {
                let found = divergence(candidate, text);
                assert!(found.is_some(), "{}: {expression}: {text}", candidate.label);
            }
        }
    }
}

#[test]
fn every_backend_reports_what_is_not_finite_in_large_steps() {
    for solver in ["implicit", "semi-implicit"] {
        for expression in [
            "vec3(0, (t - t) / (x.x - x.x), 0)",
            "select(t > 0.05, vec3(1e38 * exp(9 + t), 0, 0), vec3(0, 0, 0))",
        ] {
            let text = patch(&field(expression));
            let text = text.replace("frames = 8,", &format!("frames = 8, solver = {solver:?},"));
            for candidate in in_single() {
                let found = divergence(candidate, &text);
                assert!(found.is_some(), "{} {solver}: {expression}", candidate.label);
            }
        }
    }
}

/// Not by fields alone: whatever number of a scene is out of all proportion, all backends end where the CPU does, or none.
#[test]
fn every_backend_ends_where_the_cpu_ends() {
    let plain = patch("");
    let busy = BUSY.map(patch);
    let air = "[wind]\nvelocity = [3, 0, 1]\ndensity = 1.2\n";
    let ball =
        "[[collider]]\nname = \"ball\"\nshape.sphere.radius = 0.05\ntranslation = [0, 0, -0.02]\n";
    let (windy, near) = (patch(air), patch(ball));
    let stiff = |k: &str| format!("preset = \"jersey\", stretch.stiffness = {k}");
    let damped = |d: &str| format!("preset = \"jersey\", stretch.damping = {d}");
    let moving = |v: &str| format!("pins = [\"left\"]\nvelocity = [{v}, 0, 0]");
    let mut diverged = 0;
    let mut went_on = 0;
    for text in [&plain, &busy[0], &busy[1], &windy, &near] {
        let mut changed = Vec::new();
        for number in ["1e3", "1e6", "1e12", "1e19", "1e30", "3e38"] {
            changed.push(text.replace("preset = \"jersey\"", &stiff(number)));
            changed.push(text.replace("preset = \"jersey\"", &damped(number)));
            changed.push(text.replace("pins = [\"left\"]", &moving(number)));
            let gravity = format!("gravity = [0, 0, -{number}]\nsimulation");
            changed.push(text.replacen("simulation", &gravity, 1));
            changed.push(
                text.replace("velocity = [3, 0, 1]", &format!("velocity = [{number}, 0, 1]")),
            );
        }
        for text in &changed {
            // Some of these steps are too long for the explicit solver, which would not be chosen for them.
            let text = &text.replace("frames = 8,", "frames = 8, solver = \"explicit\",");
            let mut candidates = in_single();
            let cpu = candidates.next().unwrap();
            assert!(cpu.label.starts_with("cpu"));
            let Ok(scene) = cloth::scene::Scene::from_toml(text, "changed.toml") else {
                panic!("{text}")
            };
            if scene.compile(&cloth::scene::CompileOptions::default()).is_err() {
                continue;
            }
            let expected = divergence(cpu, text).is_some();
            if expected {
                diverged += 1
            } else {
                went_on += 1
            }
            for candidate in candidates {
                let found = divergence(candidate, text).is_some();
                assert_eq!(found, expected, "{}: {text}", candidate.label);
            }
        }
    }
    assert!(diverged > 50 && went_on > 10, "{diverged} diverged, {went_on} went on");
}

#[test]
fn a_divergence_that_a_field_made_says_so() {
    let strong = patch(&field("1e7 * m * vec3(0, 0, x.x)"));
    let undefined = patch(&field("select(id < 8, vec3(0, 0, 0), vec3(0, 0, log(x.z - 1)))"));
    let heavy = patch("").replacen("simulation", "gravity = [0, 0, -1e9]\nsimulation", 1);
    for candidate in candidates() {
        for (text, number) in [(&strong, Some(0)), (&undefined, Some(0)), (&heavy, None)] {
            let found = divergence(candidate, text).unwrap();
            let DivergenceOrigin::Field { field, .. } = found.origin else {
                panic!("{}: {found}", candidate.label)
            };
            assert_eq!(field, number);
            assert!(found.to_string().contains("accelerates particle"), "{found}");
        }
    }
}

#[test]
fn a_divergence_of_cloth_that_starts_inside_a_solid_says_so() {
    let inside = patch(
        "[[collider]]\nname = \"stone\"\nshape.box.half_extents = [0.3, 0.3, 0.3]\ntranslation = [0.03, 0.01, 0.0]\n",
    );
    let inside = inside.replace("strain_bound = 2", "strain_bound = 0.5");
    for candidate in candidates() {
        let found = divergence(candidate, &inside).unwrap();
        let DivergenceOrigin::Inside { collider, depth, .. } = &found.origin else {
            panic!("{}: {found}", candidate.label)
        };
        assert!(collider == "stone" && (0.2..0.31).contains(depth), "{found}");
        assert!(found.to_string().contains("\"stone\""), "{found}");
    }
}
