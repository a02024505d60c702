//! Distances of solids, bodies among themselves, and bodies with cloth.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::sync::Arc;

use cloth_backend_cpu::CpuBackend;
use cloth_core::{
    Backend, Cloth, Collider, ColliderControl, ColliderShape, Control, Frame, Geometry, GridPatch,
    MaterialPreset, ModelBuilder, Pose, Precision, SolverConfig, State, TriangleMesh,
};
use cloth_rigid::{
    DistanceGridPlan, RigidBody, RigidError, RigidJoint, RigidJointKind, RigidShape, RigidWorld,
    distance_grid, distance_grid_sequence,
};

/// A box with faces across the axes.
fn cuboid([x, y, z]: [f64; 3]) -> TriangleMesh {
    let corner = |i: usize| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        [x * sign(0), y * sign(1), z * sign(2)]
    };
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    TriangleMesh {
        positions: (0..8).map(corner).collect(),
        triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..TriangleMesh::default()
    }
}

/// A ball, as rings of vertices between two poles.
fn ball(radius: f64, rings: u32, sectors: u32) -> TriangleMesh {
    let mut positions = vec![[0.0, 0.0, radius]];
    for ring in 1..rings {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        for sector in 0..sectors {
            let turn = std::f64::consts::TAU * f64::from(sector) / f64::from(sectors);
            let [sine, cosine] = [polar.sin(), polar.cos()];
            positions.push([
                radius * sine * turn.cos(),
                radius * sine * turn.sin(),
                radius * cosine,
            ]);
        }
    }
    positions.push([0.0, 0.0, -radius]);
    let last = positions.len() as u32 - 1;
    let at = |ring: u32, sector: u32| 1 + (ring - 1) * sectors + sector % sectors;
    let mut triangles = Vec::new();
    for sector in 0..sectors {
        triangles.push([0, at(1, sector), at(1, sector + 1)]);
        triangles.push([last, at(rings - 1, sector + 1), at(rings - 1, sector)]);
        for ring in 1..rings - 1 {
            let [a, b] = [at(ring, sector), at(ring, sector + 1)];
            let [c, d] = [at(ring + 1, sector), at(ring + 1, sector + 1)];
            triangles.push([a, c, d]);
            triangles.push([a, d, b]);
        }
    }
    TriangleMesh { positions, triangles, ..TriangleMesh::default() }
}

#[test]
fn samples_are_the_distances_of_the_solid() {
    let grid = distance_grid("box", &cuboid([0.5, 0.25, 0.125]), 40, 0.1).unwrap();
    let mut inside = 0;
    for (index, &distance) in grid.distances.iter().enumerate() {
        let [width, height] = [grid.size[0] as usize, grid.size[1] as usize];
        let cell = [index % width, index / width % height, index / (width * height)];
        let at: [f64; 3] =
            std::array::from_fn(|axis| grid.origin[axis] + grid.spacing * cell[axis] as f64);
        let beyond = [at[0].abs() - 0.5, at[1].abs() - 0.25, at[2].abs() - 0.125];
        let outside = beyond.map(|b| b.max(0.0)).iter().map(|b| b * b).sum::<f64>().sqrt();
        let wanted = outside + beyond.into_iter().fold(f64::NEG_INFINITY, f64::max).min(0.0);
        assert!((f64::from(distance) - wanted).abs() < 1e-6, "{at:?}: {distance}, not {wanted}");
        inside += usize::from(distance < 0.0);
    }
    assert!(inside > 5000);
    assert!((grid.spacing - 0.025).abs() < 1e-12);
}

#[test]
fn solids_must_be_closed() {
    let mut mesh = cuboid([1.0; 3]);
    mesh.triangles.pop();
    let open = distance_grid("lid", &mesh, 16, 0.1).unwrap_err();
    assert!(matches!(&open, RigidError::Open { name, .. } if name == "lid"), "{open}");
    let mut mesh = cuboid([1.0; 3]);
    mesh.triangles[3] = [0, 1, 99];
    let error = distance_grid("box", &mesh, 16, 0.1).unwrap_err();
    assert!(matches!(error, RigidError::FaceOutOfRange { face: 3, vertex: 99, .. }));
    let empty = distance_grid("nothing", &TriangleMesh::default(), 16, 0.1).unwrap_err();
    assert!(matches!(empty, RigidError::Flat { .. }));
    let mut mesh = cuboid([1.0; 3]);
    mesh.positions[0][0] = f64::NAN;
    assert!(matches!(distance_grid("x", &mesh, 16, 0.1), Err(RigidError::Number { .. })));
    let mut inside_out = cuboid([1.0; 3]);
    inside_out.triangles.iter_mut().for_each(|face| face.swap(0, 1));
    let grid = distance_grid("box", &inside_out, 16, 0.1).unwrap();
    assert_eq!(
        grid,
        distance_grid("box", &cuboid([1.0; 3]), 16, 0.1)
            .map(|mut other| {
                other.surface.triangles.clone_from(&grid.surface.triangles);
                other
            })
            .unwrap()
    );
}

fn patch(height: f64) -> Cloth {
    Cloth {
        name: "patch".into(),
        geometry: Geometry::Grid(GridPatch::horizontal(21, 0.03, height)),
        material: MaterialPreset::ALL[0].material(0.03).into(),
        pins: vec![],
        velocity: [0.0; 3],
    }
}

fn config(precision: Precision) -> SolverConfig {
    SolverConfig { precision, time_step: 2e-4, ..SolverConfig::default() }
}

/// A cloth that falls on a ball of triangles lies as it does on the sphere: apart by the facets and
/// the grid, which are both known.
#[test]
fn cloth_lies_on_a_sampled_ball_as_on_a_sphere() {
    let radius = 0.2;
    let grid = distance_grid("ball", &ball(radius, 48, 96), 64, 0.02).unwrap();
    let highest = |shape: ColliderShape| {
        let solid = Collider {
            name: "ball".into(),
            shape,
            pose: Pose::IDENTITY,
            friction: 0.5,
            restitution: 0.0,
        };
        let model = ModelBuilder::new().cloth(patch(0.24)).collider(solid).build().unwrap();
        let backend = CpuBackend::new(None).unwrap();
        let mut solver = backend.create_solver(Arc::new(model), &config(Precision::F32)).unwrap();
        for _ in 0..15 {
            solver.advance(Frame { duration: 1.0 / 30.0 }).unwrap();
            let measures = solver.synchronize().unwrap().measures;
            assert!(measures.penetration_max < 1e-4, "{}", measures.penetration_max);
        }
        let mut state = State::default();
        solver.download(&mut state).unwrap();
        let distance = |x: &[f64; 3]| x.iter().map(|c| c * c).sum::<f64>().sqrt();
        let nearest = state.positions.iter().map(distance).fold(f64::INFINITY, f64::min);
        (nearest, state.positions[220][2])
    };
    let (sphere, sphere_top) = highest(ColliderShape::Sphere { radius });
    let (sampled, sampled_top) = highest(ColliderShape::Grid(Arc::new(grid)));
    // Facets: 1 - cos(pi / 96) of the radius; interpolation: spacing^2 / (8 radius).
    assert!((sphere - sampled).abs() < 4e-4, "{sphere} {sampled}");
    assert!((sphere_top - sampled_top).abs() < 2e-3, "{sphere_top} {sampled_top}");
}

/// A slab whose top rises by a decimetre in half a second, then rests: cloth on it rises with it.
#[test]
fn cloth_follows_a_solid_that_changes_its_shape() {
    let slabs = [0.1, 0.2].map(|height| cuboid([0.5, 0.5, height]));
    let grid = distance_grid_sequence("slab", &slabs, 2.0, (40, 0.05)).unwrap();
    assert_eq!(grid.set_count(), 2);
    assert!((grid.positions_at(0.25)[7][2] - 0.15).abs() < 1e-12);
    let solid = Collider {
        name: "slab".into(),
        shape: ColliderShape::Grid(Arc::new(grid)),
        pose: Pose::IDENTITY,
        friction: 0.5,
        restitution: 0.0,
    };
    let model = ModelBuilder::new().cloth(patch(0.102)).collider(solid).build().unwrap();
    let half = 0.5 * model.cloths()[0].thickness;
    for precision in [Precision::F32, Precision::F64] {
        let backend = CpuBackend::new(None).unwrap();
        let model = Arc::new(model.clone());
        let mut solver = backend.create_solver(model, &config(precision)).unwrap();
        let mut state = State::default();
        for frame in 1..=24 {
            solver.advance(Frame { duration: 1.0 / 30.0 }).unwrap();
            solver.synchronize().unwrap();
            solver.download(&mut state).unwrap();
            let time: f64 = f64::from(frame) / 30.0;
            if time < 0.2 || (time - 0.5).abs() < 0.1 {
                // It has to arrive first, and is thrown a little when the slab stops.
                continue;
            }
            let (top, speed) = if time < 0.5 { (0.1 + 0.2 * time, 0.2) } else { (0.2, 0.0) };
            for (x, v) in state.positions.iter().zip(&state.velocities) {
                assert!((x[2] - top - half).abs() < 2e-4, "{time} s: {} m, top {top} m", x[2]);
                assert!((v[2] - speed).abs() < 0.02, "{time} s: {} m/s, not {speed}", v[2]);
            }
        }
    }
}

#[test]
fn holes_of_an_animation_are_closed() {
    let whole = cuboid([0.5, 0.25, 0.125]);
    let mut open = whole.clone();
    // Without its top, and with a triangle of its bottom missing.
    open.triangles.drain(2..4);
    open.triangles.remove(0);
    let wanted = distance_grid("box", &whole, 20, 0.1).unwrap();
    let found = distance_grid_sequence("box", &[open], 1.0, (20, 0.1)).unwrap();
    assert_eq!(wanted.size, found.size);
    for (wanted, found) in wanted.distances.iter().zip(&found.distances) {
        assert!((wanted - found).abs() < 1e-6, "{wanted} {found}");
    }
}

#[test]
fn bodies_refuse_colliders_that_they_would_not_feel() {
    let slabs = [0.1, 0.2].map(|height| cuboid([0.5, 0.5, height]));
    let grid = distance_grid_sequence("slab", &slabs, 2.0, (16, 0.05)).unwrap();
    let slab = Collider {
        name: "slab".into(),
        shape: ColliderShape::Grid(Arc::new(grid)),
        pose: Pose::IDENTITY,
        friction: 0.5,
        restitution: 0.0,
    };
    let error = RigidWorld::new(&[], &[slab], [0.0; 3]).err();
    assert_eq!(error, Some(RigidError::Changes { name: "slab".into() }));
}

#[test]
fn an_animation_keeps_its_faces() {
    let box_mesh = cuboid([1.0; 3]);
    let mut other = box_mesh.clone();
    other.triangles.swap(0, 1);
    let error = distance_grid_sequence("b", &[box_mesh, other], 1.0, (16, 0.1)).unwrap_err();
    assert_eq!(error, RigidError::FacesDiffer { name: "b".into(), frame: 1 });
    let error = distance_grid_sequence("b", &[], 1.0, (16, 0.1)).unwrap_err();
    assert!(matches!(error, RigidError::Flat { .. }));
    let many = vec![cuboid([1.0; 3]); 40];
    let error = distance_grid_sequence("b", &many, 1.0, (400, 0.1)).unwrap_err();
    assert!(matches!(error, RigidError::TooManySamples { sets: 40, .. }), "{error}");
    let plan = DistanceGridPlan::new("b", &cuboid([1.0; 3]), (16, 0.1)).unwrap();
    let error = plan.with_skin(1e12).unwrap_err();
    assert!(matches!(error, RigidError::ThickSkin { .. }), "{error}");
}

fn brick(shape: RigidShape, place: [f64; 3], velocity: [f64; 3]) -> RigidBody {
    RigidBody {
        name: "brick".into(),
        shape,
        pose: Pose::from_translation(place),
        mass: 0.3,
        centre_of_mass: None,
        velocity,
        angular_velocity: [0.3, -0.2, 0.5],
        force: [0.0; 3],
        torque: [0.0; 3],
        friction: 0.4,
        restitution: 0.5,
    }
}

fn difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
}

/// Meshes, one of them not convex, and a box meet in free space.
#[test]
fn bodies_collide_and_keep_their_momentum() {
    let wedge = TriangleMesh {
        positions: vec![[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.3]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..TriangleMesh::default()
    };
    let bodies = [
        brick(RigidShape::Mesh(Box::new(wedge)), [-1.0, 0.02, 0.0], [2.0, 0.0, 0.1]),
        brick(RigidShape::Mesh(Box::new(cuboid([0.2, 0.1, 0.15]))), [0.0, 0.0, 0.05], [0.0; 3]),
        brick(RigidShape::Box { half_extents: [0.1; 3] }, [1.0, -0.02, 0.0], [-2.0, 0.1, 0.0]),
    ];
    let mut world = RigidWorld::new(&bodies, &[], [0.0; 3]).unwrap();
    let (linear, angular) = world.momentum();
    for _ in 0..60 {
        world.advance(1.0 / 60.0, &[]);
    }
    let (linear_after, angular_after) = world.momentum();
    assert!(difference(linear, linear_after) < 1e-12, "{linear:?} {linear_after:?}");
    // Rotations are integrated by the library to first order.
    assert!(difference(angular, angular_after) < 0.02, "{angular:?} {angular_after:?}");
    assert!(world.poses()[1].translation[0].abs() > 1e-3, "they have met");
    let mut again = RigidWorld::new(&bodies, &[], [0.0; 3]).unwrap();
    for _ in 0..60 {
        again.advance(1.0 / 60.0, &[]);
    }
    assert_eq!(world.poses(), again.poses(), "the same bits");
}

#[test]
fn bodies_rest_on_colliders_and_fall_freely_without() {
    let floor = Collider {
        name: "floor".into(),
        shape: ColliderShape::Plane,
        pose: Pose::IDENTITY,
        friction: 0.5,
        restitution: 0.0,
    };
    let mut body = brick(RigidShape::Sphere { radius: 0.1 }, [0.0, 0.0, 0.5], [0.0; 3]);
    body.angular_velocity = [0.0; 3];
    body.restitution = 0.0;
    let gravity = [0.0, 0.0, -9.81];
    let mut world = RigidWorld::new(&[body.clone()], &[floor], gravity).unwrap();
    for _ in 0..120 {
        world.advance(1.0 / 60.0, &[None]);
    }
    let height = world.poses()[0].translation[2];
    assert!((height - 0.1).abs() < 2e-3, "{height}");
    let mut free = RigidWorld::new(&[body], &[], gravity).unwrap();
    free.advance(0.2, &[]);
    let fallen = 0.5 - free.poses()[0].translation[2];
    assert!((fallen - 0.5 * 9.81 * 0.04).abs() < 5e-3, "{fallen}");
    assert!((free.momentum().0[2] + 0.3 * 9.81 * 0.2).abs() < 1e-9);
}

/// A capsule on its end falls over, and then lies on its side: as heavy and as hard to turn as one that is evenly filled.
#[test]
fn a_capsule_falls_over_and_rolls() {
    let floor = Collider {
        name: "floor".into(),
        shape: ColliderShape::Plane,
        pose: Pose::IDENTITY,
        friction: 0.8,
        restitution: 0.0,
    };
    let shape = RigidShape::Capsule { half_length: 0.2, radius: 0.05 };
    let mut body = brick(shape, [0.0, 0.0, 0.25], [0.0; 3]);
    (body.angular_velocity, body.restitution) = ([0.5, 0.0, 0.0], 0.0);
    let mut world = RigidWorld::new(&[body.clone()], &[floor], [0.0, 0.0, -9.81]).unwrap();
    for _ in 0..240 {
        world.advance(1.0 / 60.0, &[None]);
    }
    let height = world.poses()[0].translation[2];
    assert!((height - 0.05).abs() < 2e-3, "{height}");
    let free = RigidWorld::new(&[body], &[], [0.0; 3]).unwrap();
    // Of a cylinder and two half balls of the same density about the axis across.
    let (h, r) = (0.2_f64, 0.05_f64);
    let (tube, ends) = (2.0 * h * r * r, 4.0 / 3.0 * r * r * r);
    let (tube, ends) = (tube / (tube + ends), ends / (tube + ends));
    let across = tube * (h * h / 3.0 + r * r / 4.0) + ends * (0.4 * r * r + h * h + 0.75 * h * r);
    let [x, ..] = free.momentum().1;
    assert!((x - 0.3 * across * 0.5).abs() < 1e-9, "{x}");
}

/// What the driver does: bodies move, cloth feels them, bodies get the reaction. Nothing but the two of
/// them is there, so that their momentum together cannot change.
fn coupled(precision: Precision, shape: RigidShape, solid: ColliderShape) -> (f64, f64, f64) {
    let mut body = brick(shape, [0.02, 0.01, 0.5], [0.0, 0.0, -3.0]);
    body.angular_velocity = [0.0, 2.0, 0.0];
    let collider = Collider {
        name: "brick".into(),
        shape: solid,
        pose: body.pose,
        friction: 0.4,
        restitution: 0.0,
    };
    let model = ModelBuilder::new()
        .gravity([0.0; 3])
        .cloth(patch(0.2))
        .collider(collider)
        .collider_impulses(true)
        .build()
        .unwrap();
    let model = Arc::new(model);
    let backend = CpuBackend::new(None).unwrap();
    let mut solver = backend.create_solver(Arc::clone(&model), &config(precision)).unwrap();
    let mut world = RigidWorld::new(&[body], &[], [0.0; 3]).unwrap();
    let mut state = State::default();
    let total = |state: &State, world: &RigidWorld| {
        let (mut linear, mut angular) = world.momentum();
        for (i, (x, v)) in state.positions.iter().zip(&state.velocities).enumerate() {
            let p = v.map(|component| model.masses()[i] * component);
            for k in 0..3 {
                let (a, b) = ((k + 1) % 3, (k + 2) % 3);
                linear[k] += p[k];
                angular[k] += x[a] * p[b] - x[b] * p[a];
            }
        }
        (linear, angular)
    };
    solver.download(&mut state).unwrap();
    let before = total(&state, &world);
    let mut impulses = Vec::new();
    let mut exchanged = 0.0_f64;
    for _ in 0..20 {
        let duration = 1.0 / 60.0;
        world.advance(duration, &[]);
        let pose = world.poses()[0];
        let control = Control {
            colliders: vec![ColliderControl { collider: 0, pose }],
            ..Control::default()
        };
        solver.set_control(&control).unwrap();
        solver.advance(Frame { duration }).unwrap();
        solver.synchronize().unwrap();
        solver.collider_impulses(&mut impulses).unwrap();
        world.apply(0, &impulses[0]);
        exchanged += impulses[0].linear[2].abs();
    }
    solver.download(&mut state).unwrap();
    let after = total(&state, &world);
    (difference(before.0, after.0), difference(before.1, after.1), exchanged)
}

#[test]
fn cloth_and_bodies_together_keep_their_momentum() {
    let half_extents = [0.12, 0.08, 0.05];
    let cuboid_shape = || RigidShape::Box { half_extents };
    let (linear, angular, exchanged) =
        coupled(Precision::F64, cuboid_shape(), ColliderShape::Box { half_extents });
    assert!(exchanged > 0.05, "they have met: {exchanged} N s");
    assert!(linear < 1e-12, "{linear}");
    // The body turns by steps of the library, and particles are pushed out of it, which moves them
    // without an impulse: both change angular momentum a little.
    assert!(angular < 0.02 * exchanged, "{angular} of {exchanged}");
    let (linear, _, exchanged) =
        coupled(Precision::F32, cuboid_shape(), ColliderShape::Box { half_extents });
    assert!(exchanged > 0.05 && linear < 1e-6, "{linear}");
    let mesh = cuboid(half_extents);
    let grid = distance_grid("brick", &mesh, 48, 0.02).unwrap();
    let solid = ColliderShape::Grid(Arc::new(grid));
    let (linear, _, exchanged) = coupled(Precision::F64, RigidShape::Mesh(Box::new(mesh)), solid);
    assert!(exchanged > 0.05 && linear < 1e-12, "{linear}");
}

#[test]
fn the_reaction_of_a_heavy_cloth_moves_a_light_body() {
    let (_, _, exchanged) = coupled(
        Precision::F64,
        RigidShape::Sphere { radius: 0.1 },
        ColliderShape::Sphere { radius: 0.1 },
    );
    assert!(exchanged > 0.02);
}

#[test]
fn numbers_that_make_no_sense_are_refused() {
    for change in [
        |body: &mut RigidBody| body.mass = 0.0,
        |body: &mut RigidBody| body.mass = f64::INFINITY,
        |body: &mut RigidBody| body.velocity[1] = f64::NAN,
        |body: &mut RigidBody| body.shape = RigidShape::Sphere { radius: -1.0 },
        |body: &mut RigidBody| {
            body.shape = RigidShape::Capsule { half_length: f64::NAN, radius: 1.0 };
        },
        |body: &mut RigidBody| body.centre_of_mass = Some([0.0, f64::NAN, 0.0]),
    ] {
        let mut body = brick(RigidShape::Sphere { radius: 0.1 }, [0.0; 3], [0.0; 3]);
        change(&mut body);
        let error = RigidWorld::new(&[body], &[], [0.0; 3]).map(|_| ()).unwrap_err();
        assert!(matches!(&error, RigidError::Number { name, .. } if name == "brick"), "{error}");
    }
}

/// The places of a brick on a joint a tenth of a metre above its centre, for two seconds.
fn hung(kind: RigidJointKind, velocity: [f64; 3]) -> Vec<[f64; 3]> {
    let shape = RigidShape::Box { half_extents: [0.02; 3] };
    let bodies = [brick(shape, [0.0, 0.0, 1.0], velocity)];
    let joint = RigidJoint { kind, from: 0, to: None, anchor: [0.0, 0.0, 1.1] };
    let mut world = RigidWorld::new(&bodies, &[], [0.0, 0.0, -9.81]).unwrap();
    world.join(&bodies, &[joint]).unwrap();
    let mut places = Vec::new();
    for _ in 0..60 {
        world.advance(1.0 / 30.0, &[]);
        places.push(world.poses()[0].translation);
    }
    places
}

#[test]
fn joints_leave_free_what_they_are_to() {
    for [x, y, z] in hung(RigidJointKind::Fixed, [1.0, 0.5, 0.0]) {
        assert!(x.abs() < 5e-3 && y.abs() < 5e-3 && (z - 1.0).abs() < 5e-3, "{x} {y} {z}");
    }
    let hinge = |limits| RigidJointKind::Hinge { axis: [0.0, 3.0, 0.0], limits };
    for kind in [RigidJointKind::Ball, hinge(None)] {
        let places = hung(kind, [0.6, 0.0, 0.0]);
        for [x, y, z] in &places {
            let distance = (x * x + y * y + (z - 1.1) * (z - 1.1)).sqrt();
            assert!((distance - 0.1).abs() < 2e-3, "{distance}");
        }
        assert!(places.iter().any(|[x, ..]| *x > 0.03) && places.iter().any(|[x, ..]| *x < -0.03));
    }
    // A positive angle about y takes what hangs to negative x.
    let places = hung(hinge(Some([0.0, 0.25])), [-1.0, 0.0, 0.0]);
    let least = places.iter().map(|[x, ..]| *x).fold(0.0, f64::min);
    assert!((least + 0.1 * 0.25_f64.sin()).abs() < 5e-3, "{least}");
    assert!(places.iter().all(|[x, ..]| *x < 5e-3), "{places:?}");
    let slider = RigidJointKind::Slider { axis: [1.0, 0.0, 0.0], limits: Some([-0.5, 0.25]) };
    let places = hung(slider, [1.0, 0.5, 0.0]);
    let most = places.iter().map(|[x, ..]| *x).fold(0.0, f64::max);
    assert!((most - 0.25).abs() < 0.01, "{most}");
    for [_, y, z] in places {
        assert!(y.abs() < 5e-3 && (z - 1.0).abs() < 5e-3, "{y} {z}");
    }
}

#[test]
fn joints_that_make_no_sense_are_refused() {
    let shape = || RigidShape::Box { half_extents: [0.1; 3] };
    let bodies = [brick(shape(), [0.0; 3], [0.0; 3]), brick(shape(), [1.0; 3], [0.0; 3])];
    let good = RigidJoint { kind: RigidJointKind::Ball, from: 0, to: Some(1), anchor: [0.5; 3] };
    let hinge = |axis, limits| RigidJointKind::Hinge { axis, limits };
    for joint in [
        RigidJoint { from: 2, ..good.clone() },
        RigidJoint { to: Some(0), ..good.clone() },
        RigidJoint { anchor: [f64::NAN; 3], ..good.clone() },
        RigidJoint { kind: hinge([0.0; 3], None), ..good.clone() },
        RigidJoint { kind: hinge([1.0; 3], Some([1.0, -1.0])), ..good.clone() },
    ] {
        let mut world = RigidWorld::new(&bodies, &[], [0.0; 3]).unwrap();
        let error = world.join(&bodies, &[good.clone(), joint]).unwrap_err();
        assert!(matches!(error, RigidError::Joint { joint: 1, .. }), "{error}");
    }
}

/// The library moves nothing faster than 400 m/s, and said nothing of it.
#[test]
fn speed_limits_of_the_rigid_solver_are_said() {
    let mut body = brick(RigidShape::Sphere { radius: 0.1 }, [0.0; 3], [500.0, 0.0, 0.0]);
    let message = RigidWorld::new(&[body.clone()], &[], [0.0; 3]).err().unwrap().to_string();
    assert!(message.contains("400") && message.contains("500"), "{message}");
    body.velocity = [0.0; 3];
    body.angular_velocity = [0.0, 0.0, 300.0];
    let message = RigidWorld::new(&[body.clone()], &[], [0.0; 3]).err().unwrap().to_string();
    assert!(message.contains("188"), "{message}");

    body.angular_velocity = [0.0; 3];
    body.velocity = [390.0, 0.0, 0.0];
    let mut world = RigidWorld::new(&[body], &[], [100.0, 0.0, 0.0]).unwrap();
    world.advance(0.05, &[]);
    assert_eq!(world.at_speed_limit(), 0);
    world.advance(0.1, &[]);
    assert_eq!(world.at_speed_limit(), 1);
}

/// A box with a half extent of 1e159 m made parry panic in the first step.
#[test]
fn bodies_and_colliders_beyond_all_reach_are_refused() {
    let half_extents = [1.8e159, 0.5, 0.5];
    let large = brick(RigidShape::Box { half_extents }, [0.0; 3], [0.0; 3]);
    let far = brick(RigidShape::Sphere { radius: 0.5 }, [1e300, 0.0, 0.0], [0.0; 3]);
    let near = brick(RigidShape::Sphere { radius: 0.5 }, [0.0, 0.0, 1.0], [0.0; 3]);
    for body in [large, far] {
        let error = RigidWorld::new(&[body], &[], [0.0, 0.0, -9.81]).err();
        assert!(matches!(error, Some(RigidError::TooLarge { .. })), "{error:?}");
    }
    let mut wall = Collider {
        name: "wall".into(),
        shape: ColliderShape::Box { half_extents: [1.0, 1e9, 1.0] },
        pose: Pose::IDENTITY,
        friction: 0.3,
        restitution: 0.0,
    };
    let error = RigidWorld::new(std::slice::from_ref(&near), &[wall.clone()], [0.0; 3]).err();
    assert!(matches!(error, Some(RigidError::TooLarge { .. })), "{error:?}");
    wall.shape = ColliderShape::Plane;
    assert!(RigidWorld::new(&[near], &[wall], [0.0; 3]).is_ok(), "a half space has no end");
}
