//! Coulomb's law between cloth and bodies, and between cloths.

use std::sync::Arc;

use cloth_core::{
    Aerodynamics, Backend, Cloth, Collider, ColliderShape, FabricMaterial, Geometry,
    ImplicitSettings, Integrator, LinearSettings, Model, ModelBuilder, NewtonSettings, Pose,
    Precision, RestSource, TextureMap, TriangleMesh,
    fabric::{BendingRigidity, Fabric, InternalFriction, TensileCurve, USUAL_DAMPING},
};

use crate::rig::{
    DISTANCE, Run, body, build, explicit, implicit, mesh, processor, reference, sheet, triangles,
};

const GRAVITY: f64 = 9.81;
const RATE: f64 = 60.0;
/// Tangent of the slope.
const SLOPE: f64 = 0.5;

/// A patch on a slope of two triangles, which slopes towards x.
fn slope(friction: f64) -> Arc<Model> {
    let angle = SLOPE.atan();
    let (sin, cos) = angle.sin_cos();
    let square = mesh(
        vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]],
        vec![[0, 1, 2], [0, 2, 3]],
    );
    let pose = Pose {
        translation: [0.1, 0.0, 0.2],
        rotation: [0.0, (0.5 * angle).sin(), 0.0, (0.5 * angle).cos()],
    };
    let square = Collider { pose, friction, ..body("slope", square, [0.0; 3]) };
    let mut cloth = sheet("patch", 5, 0.02, [0.0; 3]);
    let cloth_core::Geometry::Grid(patch) = &mut cloth.geometry else { unreachable!() };
    patch.column_axis = [cos, 0.0, -sin];
    patch.row_axis = [0.0, 1.0, 0.0];
    // Half the contact distance above, but for what its weight presses it down; off the diagonal.
    let height = 0.5 * DISTANCE - 5e-6;
    let [along, across] = [-0.2, 0.1];
    patch.origin = [0.1 + cos * along + sin * height, across, 0.2 - sin * along + cos * height];
    build(ModelBuilder::new().cloth(cloth).collider(square).self_contact(triangles(0.9)))
}

/// How far the middle of the patch is down the slope \[m\], and how fast it goes there \[m/s\].
fn down(run: &Run) -> [f64; 2] {
    let (sin, cos) = SLOPE.atan().sin_cos();
    let mean = |all: &[[f64; 3]]| {
        all.iter().map(|x| cos * x[0] - sin * x[2]).sum::<f64>() / all.len() as f64
    };
    [mean(&run.state.positions), mean(&run.state.velocities)]
}

fn backends() -> [(&'static str, Box<dyn Backend>); 2] {
    [("cpu", Box::new(processor(2))), ("reference", Box::new(reference()))]
}

/// Two seconds, after half a second to settle; a minute if all is to be tested.
#[test]
fn what_friction_holds_stays_where_it_is() {
    let is_full = std::env::var_os("CLOTH_TEST_FULL").is_some();
    let frames = if is_full { 3600 } else { 120 };
    for (name, backend) in backends() {
        let model = slope(0.51);
        for way in [implicit(), explicit(&model)] {
            // Plain loops over small steps take their time.
            if name == "reference" && matches!(way.0, cloth_core::Integrator::Explicit) {
                continue;
            }
            let mut run = Run::new(&*backend, &model, way.clone(), Precision::F64);
            for _ in 0..30 {
                run.frame(RATE, &[]).unwrap();
            }
            let [start, _] = down(&run);
            for _ in 0..frames {
                run.frame(RATE, &[]).unwrap();
            }
            let drift = down(&run)[0] - start;
            println!("{name} {:?}: {drift:e} m", way.0);
            assert!(drift.abs() < 1e-5, "{name} {:?}: {drift} m", way.0);
        }
    }
}

#[test]
fn what_friction_does_not_hold_slides_as_coulomb_says() {
    let (sin, cos) = SLOPE.atan().sin_cos();
    let expected = GRAVITY * (sin - 0.49 * cos);
    for (name, backend) in backends() {
        let model = slope(0.49);
        for way in [implicit(), explicit(&model)] {
            if name == "reference" && matches!(way.0, cloth_core::Integrator::Explicit) {
                continue;
            }
            let mut run = Run::new(&*backend, &model, way.clone(), Precision::F64);
            for _ in 0..30 {
                run.frame(RATE, &[]).unwrap();
            }
            let [_, start] = down(&run);
            for _ in 0..60 {
                run.frame(RATE, &[]).unwrap();
            }
            let found = down(&run)[1] - start;
            println!("{name} {:?}: {found} of {expected} m/s^2", way.0);
            let error = (found / expected - 1.0).abs();
            assert!(error < 0.02, "{name} {:?}: {found} of {expected} m/s^2", way.0);
        }
    }
}

/// A patch that slides on a sheet which is held, until it stops.
#[test]
fn a_sheet_on_a_sheet_stops_after_the_way_of_coulomb() {
    let (friction, speed) = (0.3, 0.5);
    let ideal = speed * speed / (2.0 * friction * GRAVITY);
    let mut below = sheet("below", 12, 0.021, [0.0; 3]);
    below.pins = (0..144).collect();
    let mut above = sheet("above", 5, 0.0177, [-0.05, 0.003, DISTANCE - 5e-6]);
    above.velocity = [speed, 0.0, 0.0];
    let builder = ModelBuilder::new().cloth(below).cloth(above);
    let model = build(builder.self_contact(triangles(friction)));
    for way in [implicit(), explicit(&model)] {
        let mut run = Run::new(&processor(2), &model, way.clone(), Precision::F64);
        let middle =
            |run: &Run| run.state.positions[144..].iter().map(|x| x[0]).sum::<f64>() / 25.0;
        let start = middle(&run);
        for _ in 0..18 {
            run.frame(RATE, &[]).unwrap();
        }
        let found = middle(&run) - start;
        let left = run.state.velocities[144..].iter().map(|v| v[0]).sum::<f64>() / 25.0;
        // Steps that go on with the velocity at their end leave out the half of one that brakes.
        let expected = ideal - 0.5 * speed * way.1;
        println!("{:?}: {found} of {expected} m, {left} m/s left", way.0);
        assert!((found / expected - 1.0).abs() < 0.01, "{:?}: {found} of {expected} m", way.0);
        assert!(left.abs() < 1e-3, "{:?}: {left} m/s", way.0);
    }
}

/// Implicit steps whose equations are solved to rounding.
fn solved() -> (Integrator, f64) {
    let linear = LinearSettings { tolerance: 1e-13, iterations_max: 1000, ..Default::default() };
    let newton = NewtonSettings { iterations_max: 60, tolerance: 1e-12 };
    let settings = ImplicitSettings { linear, newton, ..ImplicitSettings::default() };
    (Integrator::Implicit(settings), implicit().1)
}

/// Two free sheets that meet: what one gets the other gives.
#[test]
fn cloths_that_meet_keep_their_momentum() {
    let mut low = sheet("low", 6, 0.02, [0.0; 3]);
    low.velocity = [0.02, 0.0, 0.1];
    let high = sheet("high", 5, 0.0177, [0.004, 0.003, 1.3 * DISTANCE]);
    let model = build(
        ModelBuilder::new().gravity([0.0; 3]).cloth(low).cloth(high).self_contact(triangles(0.3)),
    );
    let momentum = |run: &Run| {
        let all = run.state.velocities.iter().zip(model.masses());
        all.fold([0.0; 3], |sum, (v, m)| std::array::from_fn(|k: usize| sum[k] + m * v[k]))
    };
    for (way, bound) in [(explicit(&model), 1e-13), (solved(), 1e-9)] {
        let mut run = Run::new(&processor(2), &model, way.clone(), Precision::F64);
        let start = momentum(&run);
        let high_start = run.state.velocities[36..].iter().map(|v| v[2]).sum::<f64>();
        for _ in 0..12 {
            run.frame(RATE, &[]).unwrap();
        }
        assert_eq!(run.truncated, 0);
        let high_end = run.state.velocities[36..].iter().map(|v| v[2]).sum::<f64>();
        assert!(high_end > high_start + 0.2, "they have not met");
        let end = momentum(&run);
        let size = start[2];
        println!("{:?}: {start:?} {end:?}", way.0);
        for k in 0..3 {
            assert!((end[k] - start[k]).abs() < bound * size, "{:?}: {start:?} {end:?}", way.0);
        }
    }
}

/// What a body gives to cloth the cloth has got, pushed or stopped: a patch that is shot at a box.
#[test]
fn the_sum_of_impulses_is_the_momentum_of_cloth() {
    for speed in [0.3, 8.0] {
        let mut patch = sheet("patch", 5, 0.02, [0.004, 0.003, 0.02 + 2.5 * DISTANCE]);
        patch.velocity = [0.1 * speed, 0.0, -speed];
        let solid = ColliderShape::Box { half_extents: [0.05, 0.05, 0.02] };
        let model = build(
            ModelBuilder::new()
                .gravity([0.0; 3])
                .cloth(patch)
                .collider(body("body", solid, [0.0; 3]))
                .collider_impulses(true)
                .self_contact(triangles(0.3)),
        );
        for (way, bound) in [(explicit(&model), 1e-9), (solved(), 1e-6)] {
            for (name, backend) in backends() {
                let mut run = Run::new(&*backend, &model, way.clone(), Precision::F64);
                let momentum = |run: &Run| {
                    let all = run.state.velocities.iter().zip(model.masses());
                    all.fold([0.0; 3], |sum, (v, m)| {
                        std::array::from_fn(|k: usize| sum[k] + m * v[k])
                    })
                };
                let start = momentum(&run);
                let mut sum = [0.0; 3];
                let mut impulses = vec![];
                for _ in 0..3 {
                    run.frame(RATE, &[]).unwrap();
                    run.solver.collider_impulses(&mut impulses).unwrap();
                    sum = std::array::from_fn(|k| sum[k] + impulses[0].linear[k]);
                }
                let change: [f64; 3] = std::array::from_fn(|k| momentum(&run)[k] - start[k]);
                println!("{name} {speed} {}: {change:?} {sum:?} {}", way.1, run.truncated);
                let is_explicit = matches!(way.0, Integrator::Explicit);
                assert!(change[2] > 0.0 && (speed < 1.0 || !is_explicit || run.truncated > 0));
                for k in 0..3 {
                    let error = (sum[k] - change[k]).abs();
                    assert!(error < bound * change[2], "{name} {:?}: {change:?} {sum:?}", way.0);
                }
            }
        }
    }
}

/// Radius of the bar \[m\].
const BAR: f64 = 0.04;
/// Length of an edge of the strip \[m\].
const EDGE: f64 = 0.005;
const CAPSTAN: f64 = 0.3;

/// A strip over a round bar, with so many edges that hang on either side.
fn over_a_bar(hanging: [u32; 2]) -> Arc<Model> {
    let radius = BAR + 0.5 * DISTANCE;
    let around = (std::f64::consts::PI * radius / EDGE).round();
    let step = std::f64::consts::PI / around;
    let place = |k: i64| -> [f64; 2] {
        let angle = step * k as f64;
        if k < 0 {
            [-radius, EDGE * k as f64]
        } else if k as f64 > around {
            [radius, EDGE * (around - k as f64)]
        } else {
            [-radius * angle.cos(), radius * angle.sin()]
        }
    };
    let [left, right] = hanging.map(i64::from);
    let rows: Vec<[f64; 2]> = (-left..=around as i64 + right).map(place).collect();
    let (mut positions, mut uv, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for (row, [x, z]) in rows.iter().enumerate() {
        for column in 0..3 {
            let y = EDGE * f64::from(column);
            positions.push([*x, y, *z]);
            uv.push([EDGE * row as f64, y]);
        }
    }
    for row in 0..rows.len() as u32 - 1 {
        for a in [3 * row, 3 * row + 1] {
            faces.extend([[a, a + 3, a + 4], [a, a + 4, a + 1]]);
        }
    }
    let curve = TensileCurve::linear(2e3);
    let fabric = Fabric {
        area_density: 0.3,
        thickness: DISTANCE,
        warp: curve,
        weft: curve,
        coupling: 0.0,
        shear: 500.0,
        bending: BendingRigidity::isotropic(1e-8),
        friction: InternalFriction::default(),
        damping: USUAL_DAMPING,
        stretch_limit: f64::INFINITY,
    };
    let texture = Some(TextureMap { coordinates: uv, triangles: faces.clone() });
    let mesh = TriangleMesh { positions, triangles: faces, texture, ..TriangleMesh::default() };
    let rest = RestSource::Pattern { scale: 1.0 };
    let material =
        FabricMaterial { fabric, rest, aerodynamics: Aerodynamics::default(), imperfection: 0.0 };
    let cloth = Cloth {
        name: "strip".into(),
        geometry: Geometry::Mesh(mesh),
        material: material.into(),
        pins: vec![],
        velocity: [0.0; 3],
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let pose = Pose { translation: [0.0, EDGE, 0.0], rotation: [half, 0.0, 0.0, half] };
    let bar = ColliderShape::Capsule { half_length: 0.05, radius: BAR };
    let bar = Collider { pose, friction: CAPSTAN, ..body("bar", bar, [0.0; 3]) };
    build(ModelBuilder::new().cloth(cloth).collider(bar).self_contact(triangles(0.9)))
}

/// How long the side that falls hangs \[m\] when the strip is about to slip, for that of the other. With its weight per length 1, along the bar
/// dT / da = mu (T + R sin a) + R cos a (Euler 1769, of ropes without weight).
fn hanging_at_slip(other: f64) -> f64 {
    let radius = BAR + 0.5 * DISTANCE;
    let steps = 100_000;
    let step = std::f64::consts::PI / f64::from(steps);
    (0..steps).fold(other, |tension, k| {
        let (sin, cos) = (step * (f64::from(k) + 0.5)).sin_cos();
        tension + step * (CAPSTAN * (tension + radius * sin) + radius * cos)
    })
}

/// A strip over a bar slips where one side hangs e^(mu pi) times as long as the other, its weight on the bar counted.
#[test]
fn a_strip_over_a_bar_slips_as_a_rope_on_a_capstan() {
    let backend = processor(2);
    let short = 40;
    let least = hanging_at_slip(f64::from(short) * EDGE) / EDGE;
    for (share, slips) in [(0.96, false), (1.04, true)] {
        let long = (share * least).round() as u32;
        let model = over_a_bar([short, long]);
        let mut run = Run::new(&backend, &model, implicit(), Precision::F64);
        let height = |run: &Run| run.state.positions.last().map_or(0.0, |x| x[2]);
        for _ in 0..30 {
            run.frame(RATE, &[]).unwrap();
        }
        let start = height(&run);
        for _ in 0..60 {
            run.frame(RATE, &[]).unwrap();
        }
        let fallen = start - height(&run);
        println!("{long} of {least:.1} edges: {fallen:e} m");
        assert_eq!(fallen > 1e-3, slips, "{long} of {least:.1} edges: {fallen} m");
    }
}
