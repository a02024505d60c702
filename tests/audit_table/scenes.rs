//! Scenes in which cloth is driven through cloth, small enough to be run often. What contact does is given from outside.

use std::{f64::consts::TAU, sync::Arc};

use cloth_core::{
    Cloth, Collider, ColliderControl, ColliderShape, Control, GridPatch, MaterialPreset, Model,
    ModelBuilder, PinAction, PinControl, Pose, SelfContact, TriangleMesh,
};
use harness::random::Random;

/// Distance of particles \[m\].
pub(crate) const SPACING: f64 = 0.01;
/// Contact distance \[m\].
pub(crate) const DISTANCE: f64 = 0.8 * SPACING;

/// A scene.
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    /// Frames until all is over.
    pub(crate) frames: u32,
    /// Frames per second, enough to see cloth on its way through cloth.
    pub(crate) rate: f64,
    model: fn(Jitter, ModelBuilder) -> ModelBuilder,
    control: fn(&Model, f64) -> Control,
}

impl Scene {
    /// The model, with this contact, and all particles a little elsewhere by a seed other than 0.
    pub(crate) fn model(&self, contact: SelfContact, seed: u64) -> Arc<Model> {
        let jitter = Jitter { seed, size: 0.02 * SPACING };
        let builder = ModelBuilder::new().self_contact(contact);
        Arc::new((self.model)(jitter, builder).build().expect("the scenes are valid"))
    }

    /// What comes from outside until `time` \[s\], the end of the next frame.
    pub(crate) fn control(&self, model: &Model, time: f64) -> Control {
        (self.control)(model, time)
    }
}

/// All scenes.
pub(crate) const SCENES: [Scene; 6] = [
    Scene {
        name: "ten layers fall",
        frames: 30,
        rate: 60.0,
        model: layers,
        control: |_, _| Control::default(),
    },
    Scene {
        name: "cylinder twisted",
        frames: 60,
        rate: 60.0,
        model: cylinder,
        control: cylinder_control,
    },
    Scene {
        name: "pulled through a ring",
        frames: 60,
        rate: 60.0,
        model: funnel,
        control: funnel_control,
    },
    Scene {
        name: "shot at a strip and a tip",
        frames: 24,
        rate: 480.0,
        model: shot,
        control: |_, _| Control::default(),
    },
    Scene {
        name: "box shrinks",
        frames: 50,
        rate: 60.0,
        model: shrinking,
        control: shrinking_control,
    },
    Scene {
        name: "two plates close",
        frames: 50,
        rate: 60.0,
        model: plates,
        control: plates_control,
    },
];

/// Moves particles a little: the same scene from another start.
#[derive(Clone, Copy)]
struct Jitter {
    seed: u64,
    /// \[m\].
    size: f64,
}

impl Jitter {
    /// The patch as a mesh, so that its particles can be anywhere.
    fn patch(self, patch: GridPatch, at: impl Fn([f64; 3]) -> [f64; 3]) -> TriangleMesh {
        let (columns, rows) = (patch.columns, patch.rows);
        let all = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
        let positions = all.map(|(i, j)| at(patch.position(i, j))).collect();
        let squares = (0..rows - 1).flat_map(|j| (0..columns - 1).map(move |i| (i, j)));
        let triangles = squares.flat_map(|(i, j)| {
            let corner = |x: u32, y: u32| patch.particle(i + x, j + y);
            [[corner(0, 0), corner(1, 0), corner(0, 1)], [corner(1, 0), corner(1, 1), corner(0, 1)]]
        });
        self.mesh(TriangleMesh {
            positions,
            triangles: triangles.collect(),
            ..TriangleMesh::default()
        })
    }

    fn mesh(self, mut mesh: TriangleMesh) -> TriangleMesh {
        if self.seed > 0 {
            let mut random = Random::new(self.seed);
            for position in &mut mesh.positions {
                let by = random.vector(self.size);
                *position = std::array::from_fn(|k| position[k] + by[k]);
            }
        }
        mesh
    }
}

fn cloth(name: &str, mesh: TriangleMesh) -> Cloth {
    Cloth::mesh(name, mesh, &MaterialPreset::JERSEY)
}

fn collider(name: &str, shape: ColliderShape, pose: Pose) -> Collider {
    Collider { name: name.into(), shape, pose, friction: 0.3, restitution: 0.0 }
}

/// Ten squares that fall by 50 mm onto each other and a floor.
fn layers(jitter: Jitter, builder: ModelBuilder) -> ModelBuilder {
    let floor = collider("floor", ColliderShape::Plane, Pose::IDENTITY);
    (0..10_u32).fold(builder.collider(floor), |builder, number| {
        let height = 0.05 + 0.05 * f64::from(number);
        let shift = f64::from(number) * SPACING;
        let patch = GridPatch::new([13, 13], SPACING);
        let patch = patch.with_centre([0.31 * shift, 0.17 * shift, height]);
        builder.cloth(cloth(&format!("layer {number}"), jitter.patch(patch, |x| x)))
    })
}

const AROUND: u32 = 40;
const ALONG: u32 = 31;

/// An upright tube, held at both ends.
fn cylinder(jitter: Jitter, builder: ModelBuilder) -> ModelBuilder {
    let mut mesh = TriangleMesh::default();
    for j in 0..ALONG {
        let around = (0..AROUND).map(|i| cylinder_at(i, j, 0.0));
        mesh.positions.extend(around);
    }
    for j in 0..ALONG - 1 {
        for i in 0..AROUND {
            let corner = |x: u32, y: u32| (j + y) * AROUND + (i + x) % AROUND;
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let ends = (0..AROUND).chain((ALONG - 1) * AROUND..ALONG * AROUND);
    builder.gravity([0.0; 3]).cloth(cloth("tube", jitter.mesh(mesh)).with_pins(ends))
}

/// A particle of the tube, turned by an angle.
fn cylinder_at(i: u32, j: u32, turn: f64) -> [f64; 3] {
    let radius = SPACING * f64::from(AROUND) / TAU;
    let angle = TAU * f64::from(i) / f64::from(AROUND) + turn;
    [radius * angle.cos(), radius * angle.sin(), SPACING * f64::from(j)]
}

/// Two turns a second, half of them at each end.
fn cylinder_control(_: &Model, time: f64) -> Control {
    let ends = [(0, 1.0), (ALONG - 1, -1.0)];
    let pins = ends.into_iter().flat_map(|(j, sense)| {
        (0..AROUND).map(move |i| PinControl {
            particle: j * AROUND + i,
            action: PinAction::MoveTo(cylinder_at(i, j, sense * TAU * time)),
        })
    });
    Control { pins: pins.collect(), ..Control::default() }
}

const FUNNEL_SIDE: u32 = 41;

/// A square over a ring of capsules, with a particle in the middle that is held.
fn funnel(jitter: Jitter, builder: ModelBuilder) -> ModelBuilder {
    let patch = GridPatch::new([FUNNEL_SIDE; 2], SPACING).with_centre([0.0, 0.0, 0.03]);
    let middle = patch.particle(FUNNEL_SIDE / 2, FUNNEL_SIDE / 2);
    let sheet = cloth("sheet", jitter.patch(patch, |x| x)).with_pins([middle]);
    let sides = 12_u32;
    (0..sides).fold(builder.cloth(sheet), |builder, number| {
        let angle = TAU * f64::from(number) / f64::from(sides);
        let (radius, along) = (0.07, [-angle.sin(), angle.cos(), 0.0]);
        let place = [radius * angle.cos(), radius * angle.sin(), 0.0];
        // As long as the side of the polygon through the middles of its capsules.
        let half_length = radius * (0.5 * TAU / f64::from(sides)).tan();
        let shape = ColliderShape::Capsule { half_length, radius: 0.02 };
        builder.collider(collider(&format!("rim {number}"), shape, Pose::from_z_axis(place, along)))
    })
}

/// Down at half a metre a second, as far as the cloth can follow.
fn funnel_control(model: &Model, time: f64) -> Control {
    let particle = model.pins()[0];
    let action = PinAction::MoveTo([0.0, 0.0, 0.03 - (0.5 * time).min(0.25)]);
    Control { pins: vec![PinControl { particle, action }], ..Control::default() }
}

/// A patch at 20 m/s on its way to a strip that is held at both ends, with a tip, which is held, behind it.
fn shot(jitter: Jitter, builder: ModelBuilder) -> ModelBuilder {
    let along_z = |centre: [f64; 3], counts: [u32; 2]| {
        let patch = GridPatch::new(counts, SPACING).with_centre(centre);
        patch.with_axes([0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    };
    // Aslant, so that it takes some frames to get past.
    let patch = GridPatch::new([21, 21], SPACING).with_centre([-0.3, 0.003, 0.002]);
    let patch = jitter.patch(patch.with_axes([0.0, 1.0, 0.0], [0.6, 0.0, 0.8]), |x| x);
    let strip = along_z([0.0, 0.0, 0.0], [3, 31]);
    let held: Vec<u32> =
        (0..3).flat_map(|i| [strip.particle(i, 0), strip.particle(i, 30)]).collect();
    let strip = jitter.patch(strip, |x| x);
    // A long triangle, the tip ahead.
    let tip = TriangleMesh {
        positions: vec![[-0.1, 0.051, 0.043], [0.3, 0.046, 0.04], [0.3, 0.056, 0.046]],
        triangles: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    };
    builder
        .gravity([0.0; 3])
        .cloth(cloth("strip", strip).with_pins(held))
        .cloth(cloth("tip", tip).with_pins([0, 1, 2]))
        .cloth(cloth("patch", patch).with_velocity([20.0, 0.0, 0.0]))
}

/// Half of the side of the box at a time \[m\].
fn box_half(time: f64) -> f64 {
    (0.17 - 0.16 * time).max(0.06)
}

/// The planes of a box around the origin.
fn walls(half: f64) -> [Pose; 6] {
    let sides = [0, 1, 2].into_iter().flat_map(|axis| [(axis, -1.0), (axis, 1.0)]);
    let mut poses = [Pose::IDENTITY; 6];
    for (pose, (axis, side)) in poses.iter_mut().zip(sides) {
        let (mut place, mut normal) = ([0.0; 3], [0.0; 3]);
        (place[axis], normal[axis]) = (side * half, -side);
        *pose = Pose::from_z_axis(place, normal);
    }
    poses
}

/// A sheet across a box, a little wavy.
fn shrinking(jitter: Jitter, builder: ModelBuilder) -> ModelBuilder {
    let patch = GridPatch::new([31, 31], SPACING);
    let wave = |[x, y, _]: [f64; 3]| [x, y, 0.004 * (31.0 * x).sin() * (23.0 * y + 1.0).cos()];
    let builder = builder.gravity([0.0; 3]).cloth(cloth("sheet", jitter.patch(patch, wave)));
    walls(box_half(0.0)).into_iter().enumerate().fold(builder, |builder, (number, pose)| {
        builder.collider(collider(&format!("wall {number}"), ColliderShape::Plane, pose))
    })
}

fn shrinking_control(_: &Model, time: f64) -> Control {
    let poses = (0..).zip(walls(box_half(time)));
    let colliders = poses.map(|(collider, pose)| ColliderControl { collider, pose });
    Control { colliders: colliders.collect(), ..Control::default() }
}

/// Where the plates are \[m\].
fn plate_poses(time: f64) -> [Pose; 2] {
    let half = (0.06 - 0.08 * time).max(0.002);
    [-half, half].map(|z| Pose::from_z_axis([0.0, 0.0, z], [0.0, 0.0, -z]))
}

/// Radius of the folds \[m\], and the length between them.
const FOLD: [f64; 2] = [0.02, 0.1];

/// A place on a line that is folded twice, by its length from the middle \[m\]: three layers.
fn folded(along: f64) -> [f64; 2] {
    let [radius, straight] = FOLD;
    let beyond = along.abs() - 0.5 * straight;
    let angle = beyond.max(0.0) / radius;
    let place = if beyond <= 0.0 {
        [along.abs(), 0.0]
    } else if angle <= 0.5 * TAU {
        [0.5 * straight + radius * angle.sin(), radius * (1.0 - angle.cos())]
    } else {
        [0.5 * straight - (beyond - 0.5 * TAU * radius), 2.0 * radius]
    };
    place.map(|x| x * along.signum())
}

/// A sheet, folded into three layers, between two plates.
fn plates(jitter: Jitter, builder: ModelBuilder) -> ModelBuilder {
    let patch = GridPatch::new([43, 21], SPACING);
    let fold = |[x, y, _]: [f64; 3]| {
        let [along, height] = folded(x);
        [along, y + 0.1 * height, height]
    };
    let builder = builder.gravity([0.0; 3]).cloth(cloth("sheet", jitter.patch(patch, fold)));
    plate_poses(0.0).into_iter().enumerate().fold(builder, |builder, (number, pose)| {
        builder.collider(collider(&format!("plate {number}"), ColliderShape::Plane, pose))
    })
}

fn plates_control(_: &Model, time: f64) -> Control {
    let poses = (0..).zip(plate_poses(time));
    let colliders = poses.map(|(collider, pose)| ColliderControl { collider, pose });
    Control { colliders: colliders.collect(), ..Control::default() }
}
