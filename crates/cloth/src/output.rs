//! What writers of frames and pictures need to know of a scene.

use cloth_core::{ClothRange, ColliderShape, Model, Pose, SpringClass, StrainGauge, TextureMap};
use cloth_io::{
    Bounds, Camera, FrameSolids, PictureOverlays, PictureShape, PictureShapes, PictureSolid,
    PictureStyle, Topology, TopologyCloth,
};
use cloth_scene::{CompiledScene, SceneView};
use glam::DVec3;

use crate::{PoseLog, dust::picture_dust};

/// The connectivity of all cloths of `scene`, their textures and the frame rate.
#[must_use]
pub fn topology(scene: &CompiledScene) -> Topology {
    let range = |range: &std::ops::Range<u32>| range.start as usize..range.end as usize;
    let mut lines = Vec::new();
    let mut cloths = Vec::with_capacity(scene.model.cloths().len());
    for cloth in scene.model.cloths() {
        let first_line = lines.len();
        if cloth.triangles.is_empty() {
            lines.extend(cloth_lines(&scene.model, cloth));
        }
        cloths.push(TopologyCloth {
            name: cloth.name.clone(),
            particles: range(&cloth.particles),
            triangles: range(&cloth.triangles),
            lines: first_line..lines.len(),
        });
    }
    Topology {
        triangles: scene.model.triangles().to_vec(),
        lines,
        texture: texture(scene),
        particle_count: scene.model.particle_count(),
        cloths,
        frames_per_second: scene.frames_per_second,
        gauge: StrainGauge::new(&scene.model),
    }
}

/// What a rope or a net looks like: its stretch springs, or all its springs if it has none of these, as pairs of
/// particles of `model`.
#[must_use]
pub fn cloth_lines(model: &Model, cloth: &ClothRange) -> Vec<[u32; 2]> {
    let springs = model.springs();
    let all = |class: Option<SpringClass>| -> Vec<[u32; 2]> {
        let particles = cloth.particles.clone();
        let of_particle = |particle: u32| {
            let row = springs.row(particle as usize);
            row.map(move |spring| ([particle, springs.columns()[spring]], spring))
        };
        let wanted = |spring: usize| {
            let kind = springs.kind_indices()[spring] as usize;
            class.is_none_or(|class| springs.kinds()[kind].class == class)
        };
        let found = particles.flat_map(of_particle).filter(|&(_, spring)| wanted(spring));
        found.map(|(line, _)| line).collect()
    };
    let stretch = all(Some(SpringClass::Stretch));
    if stretch.is_empty() { all(None) } else { stretch }
}

/// One texture map for all cloths; the corners of a cloth that has none share one coordinate.
fn texture(scene: &CompiledScene) -> Option<TextureMap> {
    let mut merged = TextureMap::default();
    let mut any = false;
    for (index, cloth) in scene.model.cloths().iter().enumerate() {
        let start = merged.coordinates.len() as u32;
        match scene.texture(index) {
            Some(texture) => {
                any = true;
                merged.coordinates.extend_from_slice(&texture.coordinates);
                let corners = texture.triangles.iter();
                merged.triangles.extend(corners.map(|triangle| triangle.map(|i| start + i)));
            }
            None => {
                merged.coordinates.push([0.0; 2]);
                merged.triangles.extend(cloth.triangles.clone().map(|_| [start; 3]));
            }
        }
    }
    any.then_some(merged)
}

/// How pictures of `scene` look: its camera, the colours of its cloths and what is shown on them, its colliders as they move, its dust.
/// A scene without a camera is seen whole, as it is at the start, with room to fall and where its colliders go, so that
/// every picture of a run, resumed or not, has the same view.
#[must_use]
pub fn picture_style(scene: &CompiledScene) -> PictureStyle {
    let mut style = PictureStyle::default();
    let colours = scene.cloths.iter().enumerate().map(|(index, cloth)| {
        cloth.colour.map_or_else(|| cloth_io::picture_palette(index), |colour| colour.rgb)
    });
    style.cloth_colors = colours.collect();
    style.shapes = shapes(scene, Visible::of(scene));
    style.dust = picture_dust(scene);
    if let Some(view) = &scene.view {
        style.overlays = {
            let strain = view.strain.map(|scale| (view.strain_of.into(), scale));
            PictureOverlays::new(&scene.model, strain, view.threads)
        };
    }
    style.camera = Some(match &scene.view {
        Some(view) => camera(view),
        // What is hidden is where cloth may go, and so in the picture.
        None => Camera::fit(&bounds(scene, &shapes(scene, Visible::all(scene))), style.aspect()),
    });
    style
}

/// [`picture_style`] with the colliders where a simulation has them: rigid bodies are nowhere else.
#[must_use]
pub fn picture_style_moving(scene: &CompiledScene, poses: PoseLog) -> PictureStyle {
    let mut style = picture_style(scene);
    if !scene.rigids.is_empty() {
        let visible = Visible::of(scene);
        let rate = scene.frames_per_second;
        style.shapes = PictureShapes::moving(move |time| {
            visible.at(&poses.at((time * rate).round() as usize), time)
        });
    }
    style
}

/// The colliders of a scene that pictures show, where `poses` has them, at `time` \[s\].
#[must_use]
pub fn picture_shapes(scene: &CompiledScene, poses: &[Pose], time: f64) -> Vec<PictureSolid> {
    Visible::of(scene).at(poses, time)
}

/// The colliders that pictures show.
struct Visible(Vec<VisibleSolid>);

struct VisibleSolid {
    /// Number of the collider.
    index: usize,
    shape: ColliderShape,
    /// Whether cloth touches its triangles, rather than the shape itself.
    is_body: bool,
    color: Option<[u8; 3]>,
}

impl Visible {
    fn of(scene: &CompiledScene) -> Self {
        let all = Self::all(scene).0.into_iter();
        Self(all.filter(|solid| !scene.solids[solid.index].hidden).collect())
    }

    /// These and those that are hidden.
    fn all(scene: &CompiledScene) -> Self {
        let all = scene.model.colliders().iter().zip(&scene.solids).enumerate();
        let all = all.map(|(index, (collider, solid))| VisibleSolid {
            index,
            shape: collider.shape.clone(),
            is_body: scene.model.is_contact_body(index),
            color: solid.colour.map(|colour| colour.rgb),
        });
        Self(all.collect())
    }

    fn at(&self, poses: &[Pose], time: f64) -> Vec<PictureSolid> {
        let posed = self.0.iter().filter_map(|solid| {
            let shape = shape_at(solid, poses.get(solid.index)?, time);
            Some(PictureSolid { shape, color: solid.color })
        });
        posed.collect()
    }
}

fn camera(view: &SceneView) -> Camera {
    let along: [f64; 3] = std::array::from_fn(|k| view.target[k] - view.eye[k]);
    let sideways = along[0].hypot(along[1]);
    // Seen straight from above or below, z cannot be up in the picture.
    let up = if sideways > 1e-6 * along[2].abs() { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
    Camera {
        eye: view.eye,
        target: view.target,
        up,
        vertical_field_of_view: view.field_of_view.to_radians(),
    }
}

/// Moments at which it is looked where colliders and pins are.
const MOMENTS: u32 = 16;
/// How many times as large as the start all of their way may be to be seen whole.
const WAY_MAX: f64 = 4.0;

/// The start, below it room for the cloth to fall or swing down to the nearest thing that
/// stops it, and the ways of colliders and pins unless they lead far away.
fn bounds(scene: &CompiledScene, shapes: &PictureShapes) -> Bounds {
    let start = bounds_start(&scene.model, &shapes.at(0.0));
    let room = room_below(&Bounds::of(scene.model.positions()));
    let way = (1..=MOMENTS).fold(start, |bounds, moment| {
        let frame = u64::from(scene.frames) * u64::from(moment) / u64::from(MOMENTS);
        let shapes = shapes.at(frame as f64 / scene.frames_per_second);
        let bounds =
            shapes.iter().fold(bounds, |bounds, solid| bounds.union(&solid.shape.bounds()));
        let pins = scene.timeline.moved_pins(frame);
        pins.fold(bounds, |bounds, pin| {
            bounds.union(&Bounds { min: [pin[0], pin[1], pin[2] - room], max: pin })
        })
    });
    let size = |bounds: &Bounds| {
        (0..3).map(|axis| bounds.max[axis] - bounds.min[axis]).fold(0.0, f64::max)
    };
    if size(&way) <= WAY_MAX * size(&start) { way } else { start }
}

/// How far below a cloth it may hang.
fn room_below(cloth: &Bounds) -> f64 {
    0.5 * (0..2).map(|axis| cloth.max[axis] - cloth.min[axis]).fold(0.0, f64::max)
}

/// Held particles of a cloth that are looked at.
const HELD_MAX: usize = 64;

/// How low the corners of a cloth can hang from the nearest of the places that hold it.
fn hanging(cloth: &Bounds, held: &[DVec3]) -> f64 {
    let corners = (0..8).map(|corner| {
        let side = |axis: usize| if corner >> axis & 1 == 0 { cloth.min } else { cloth.max }[axis];
        DVec3::new(side(0), side(1), side(2))
    });
    let lowest = corners.filter_map(|corner| {
        let distances = held.iter().map(|place| (place.distance(corner), place.z));
        distances.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(distance, height)| height - distance)
    });
    lowest.fold(f64::INFINITY, f64::min)
}

fn bounds_start(model: &Model, shapes: &[PictureSolid]) -> Bounds {
    let cloth = Bounds::of(model.positions());
    let all = shapes.iter().fold(cloth, |bounds, solid| bounds.union(&solid.shape.bounds()));
    let floor = shapes.iter().find_map(|solid| match &solid.shape {
        PictureShape::Plane { normal, offset } if normal[2] > 0.5 => Some(offset / normal[2]),
        _ => None,
    });
    // A rope from wall to wall says nothing of how far a towel on it hangs down.
    let fallen = model.cloths().iter().map(|cloth| {
        let particles = cloth.particles.start as usize..cloth.particles.end as usize;
        let own = Bounds::of(&model.positions()[particles.clone()]);
        let held = model.pins().iter().map(|&pin| pin as usize);
        let held: Vec<_> = held.filter(|pin| particles.contains(pin)).collect();
        let step = (held.len() / HELD_MAX).max(1);
        let held = held.into_iter().step_by(step).map(|pin| DVec3::from(model.positions()[pin]));
        (own.min[2] - room_below(&own)).min(hanging(&own, &held.collect::<Vec<_>>()))
    });
    let lowest = floor.unwrap_or_else(|| fallen.fold(f64::INFINITY, f64::min)).min(all.min[2]);
    Bounds { min: [all.min[0], all.min[1], lowest], ..all }
}

/// The colliders of `scene` for files of frames, those of rigid bodies where `poses` has them: these are
/// nowhere else, and without it they stay where they began.
#[must_use]
pub fn frame_solids(scene: &CompiledScene, poses: Option<PoseLog>) -> FrameSolids {
    let (colliders, cloth) = (scene.model.colliders(), scene.model.positions());
    FrameSolids::new(colliders, cloth, collider_poses(scene, poses))
}

/// Where colliders of `scene` are at any time \[s\], those of rigid bodies as `poses` has them.
pub fn collider_poses(
    scene: &CompiledScene,
    poses: Option<PoseLog>,
) -> impl Fn(f64) -> Vec<Pose> + Send + Sync + 'static {
    let poses = poses.filter(|_| !scene.rigids.is_empty());
    let rate = scene.frames_per_second;
    let of_timeline = timeline_poses(scene);
    move |time| match &poses {
        Some(poses) => poses.at((time * rate).round() as usize),
        None => of_timeline(time),
    }
}

/// These colliders in every frame. Poses follow from the timeline, as the solver takes them from it.
fn shapes(scene: &CompiledScene, visible: Visible) -> PictureShapes {
    let poses = timeline_poses(scene);
    PictureShapes::moving(move |time| visible.at(&poses(time), time))
}

/// Where the timeline has the colliders at a time \[s\].
fn timeline_poses(scene: &CompiledScene) -> impl Fn(f64) -> Vec<Pose> + Send + Sync + 'static {
    let start: Vec<Pose> = scene.model.colliders().iter().map(|c| c.pose).collect();
    let timeline = scene.timeline.clone();
    let (rate, frames) = (scene.frames_per_second, u64::from(scene.frames));
    move |time| {
        let mut poses = start.clone();
        // Nothing is kept of other frames: a scene may ask for any number of them.
        let frame = ((time * rate).round() as u64).min(frames);
        if frame > 0 {
            for control in timeline.colliders(frame) {
                poses[control.collider as usize] = control.pose;
            }
        }
        poses
    }
}

/// A ball or a capsule that cloth touches is shown as the polyhedron that contact takes it for: the round shape, some tenths of a millimetre around it,
/// would show through cloth that is pressed against it.
fn shape_at(
    VisibleSolid { shape, is_body, .. }: &VisibleSolid,
    pose: &Pose,
    time: f64,
) -> PictureShape {
    let center = pose.translation;
    let rotation = pose.rotation_rows();
    let z_axis = rotation.map(|row| row[2]);
    let mesh = || PictureShape::Mesh {
        positions: shape
            .body_positions(shape.sets_at(time))
            .iter()
            .map(|at| {
                std::array::from_fn(|k| {
                    center[k] + (0..3).map(|j| rotation[k][j] * at[j]).sum::<f64>()
                })
            })
            .collect(),
        triangles: shape.body_triangles().unwrap_or_default().iter().copied().collect(),
    };
    match *shape {
        ColliderShape::Sphere { .. } | ColliderShape::Capsule { .. } if *is_body => mesh(),
        ColliderShape::Plane => PictureShape::Plane {
            normal: z_axis,
            offset: (0..3).map(|k| z_axis[k] * center[k]).sum(),
        },
        ColliderShape::Sphere { radius } => PictureShape::Sphere { center, radius },
        ColliderShape::Capsule { half_length, radius } => PictureShape::Capsule {
            a: std::array::from_fn(|k| center[k] - half_length * z_axis[k]),
            b: std::array::from_fn(|k| center[k] + half_length * z_axis[k]),
            radius,
        },
        ColliderShape::Box { half_extents } => {
            PictureShape::Cuboid { center, rotation, half_extents }
        }
        ColliderShape::Grid(_) | ColliderShape::Surface(_) => mesh(),
    }
}

#[cfg(test)]
mod tests {
    use cloth_scene::{CompileOptions, Scene, builtin_scenes};

    use super::*;

    #[test]
    fn every_built_in_scene_has_a_consistent_topology_and_a_camera() {
        for builtin in builtin_scenes() {
            let scene = Scene::builtin(builtin.name).unwrap();
            let scene = scene.compile(&CompileOptions::default()).unwrap();
            topology(&scene).check().unwrap();
            let style = picture_style(&scene);
            assert!(style.camera.is_some(), "{}", builtin.name);
            assert_eq!(style.shapes.at(0.0).len(), scene.model.colliders().len());
        }
    }

    /// Nothing of the frames is kept: the poses of so many would take terabytes.
    #[test]
    fn a_scene_of_any_length_has_pictures() {
        let text = MOVING.replace("frames = 4", "frames = 4294967295");
        let scene = Scene::from_toml(&text, "long.toml").unwrap();
        let scene = scene.compile(&CompileOptions::default()).unwrap();
        let shapes = picture_style(&scene).shapes;
        let center = [4.0, 0.0, -2.0];
        assert_eq!(
            shapes.at(1e9),
            [PictureSolid::from(PictureShape::Sphere { center, radius: 0.5 })]
        );
    }

    /// A sheet that hangs from two corners is as far below them as it is wide.
    #[test]
    fn pictures_have_room_for_what_hangs_from_pins() {
        let text = r#"
            [[cloth]]
            material.preset = "cotton"
            geometry.grid = { columns = 11, rows = 11, spacing = 0.1, centre = [0, 0, 2] }
            pins = [0, 10]
        "#;
        let scene = Scene::from_toml(text, "sheet.toml").unwrap();
        let scene = scene.compile(&CompileOptions::default()).unwrap();
        let lowest = bounds_start(&scene.model, &[]).min[2];
        assert!((lowest - 1.0).abs() < 1e-9, "{lowest}");
    }

    /// Cloth that is pressed against a ball lies between the polyhedron and the round surface.
    #[test]
    fn balls_are_shown_as_what_cloth_touches() {
        let shapes = |contact: &str| {
            let text = format!(
                r#"
                {contact}
                [[cloth]]
                material.preset = "cotton"
                geometry.grid = {{ columns = 3, rows = 3, spacing = 0.1, centre = [0, 0, 1] }}
                [[collider]]
                shape.sphere.radius = 0.25
                translation = [1, 0, 0]
                [[collider]]
                shape.capsule = {{ half_length = 0.2, radius = 0.1 }}
                "#
            );
            let scene = Scene::from_toml(&text, "ball.toml").unwrap();
            picture_style(&scene.compile(&CompileOptions::default()).unwrap()).shapes.at(0.0)
        };
        let [ball, capsule] = &shapes("")[..] else { panic!("two solids") };
        for solid in [ball, capsule] {
            assert!(matches!(solid.shape, PictureShape::Mesh { .. }), "{:?}", solid.shape);
        }
        let PictureShape::Mesh { positions, .. } = &ball.shape else { panic!("a mesh") };
        for [x, y, z] in positions.iter() {
            let distance = ((x - 1.0).powi(2) + y * y + z * z).sqrt();
            assert!((distance - 0.25).abs() < 1e-12, "{distance}");
        }
        let [ball, _] = &shapes(r#"contact.response = "none""#)[..] else { panic!("two solids") };
        assert!(matches!(ball.shape, PictureShape::Sphere { .. }));
    }

    const MOVING: &str = r#"
        name = "moving"
        contact.response = "none"
        simulation = { frames = 4, frames_per_second = 2 }
        [[cloth]]
        name = "patch"
        geometry.grid = { columns = 3, rows = 3, spacing = 0.1 }
        material.preset = "jersey"
        [[collider]]
        name = "ball"
        shape.sphere.radius = 0.5
        translation = [0, 0, -2]
        motion = [{ time = 1.0, translation = [4, 0, -2] }]
    "#;

    /// What is hidden is not shown, but the camera sees where it is; colours are those of the scene, of rigid bodies as well.
    #[test]
    fn colliders_are_hidden_and_coloured_as_the_scene_says() {
        let rest = "
            [[collider]]
            name = \"drum\"
            hidden = true
            shape.box.half_extents = [9, 9, 9]
            [[rigid]]
            name = \"marble\"
            mass = 1
            colour = \"#102030\"
            shape.sphere.radius = 0.1
            translation = [2, 0, 0]
        ";
        let text = MOVING.replace("translation = [0", "colour = \"#c0392b\"\ntranslation = [0");
        let scene = Scene::from_toml(&(text + rest), "hidden.toml").unwrap();
        let mut scene = scene.compile(&CompileOptions::default()).unwrap();
        let style = picture_style(&scene);
        let colors = |solids: Vec<PictureSolid>| -> Vec<_> {
            solids.into_iter().map(|solid| solid.color).collect()
        };
        let expected = [Some([0xc0, 0x39, 0x2b]), Some([0x10, 0x20, 0x30])];
        assert_eq!(colors(style.shapes.at(0.0)), expected);
        let poses: Vec<Pose> = scene.model.colliders().iter().map(|c| c.pose).collect();
        assert_eq!(colors(picture_shapes(&scene, &poses, 0.0)), expected);
        scene.solids[1].hidden = false;
        let shown = picture_style(&scene);
        assert_eq!(shown.camera, style.camera);
        assert_eq!(shown.shapes.at(0.0).len(), 3);
    }

    #[test]
    fn shapes_are_where_the_timeline_takes_the_colliders() {
        let scene = Scene::from_toml(MOVING, "moving.toml").unwrap();
        let scene = scene.compile(&CompileOptions::default()).unwrap();
        let shapes = picture_style(&scene).shapes;
        for (time, x) in [(0.0, 0.0), (0.5, 2.0), (1.0, 4.0), (1.5, 4.0), (9.0, 4.0)] {
            let center = [x, 0.0, -2.0];
            assert_eq!(
                shapes.at(time),
                [PictureSolid::from(PictureShape::Sphere { center, radius: 0.5 })],
                "{time}"
            );
        }
    }

    /// A picture has room for where colliders go, unless that is far away.
    #[test]
    fn colliders_stay_in_the_picture() {
        let camera = |motion: &str| {
            let text =
                MOVING.replace("motion = [{ time = 1.0, translation = [4, 0, -2] }]", motion);
            let scene = Scene::from_toml(&text, "moving.toml").unwrap();
            picture_style(&scene.compile(&CompileOptions::default()).unwrap()).camera.unwrap()
        };
        let still = camera("");
        assert!(
            camera("motion = [{ time = 1.0, translation = [4, 0, -2] }]").target[0]
                > still.target[0] + 1.0
        );
        assert_eq!(camera("motion = [{ time = 1.0, translation = [400, 0, -2] }]"), still);
        // So it has for pins that move.
        let event = r#"
            [[event]]
            cloth = "patch"
            pins = [0]
            time = 0.5
            action.move = { offset = [0, 3, 0], duration = 1 }
        "#;
        let pinned = MOVING.replace("material.preset", "pins = [0]\nmaterial.preset");
        let scene = Scene::from_toml(&format!("{pinned}{event}"), "moving.toml").unwrap();
        let camera = picture_style(&scene.compile(&CompileOptions::default()).unwrap()).camera;
        assert!(camera.unwrap().target[1] > still.target[1] + 1.0);
    }
}
