//! Checkpoints: a run continues with the same bits, and what does not fit is refused.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::path::{Path, PathBuf};

use cloth::{
    Checkpoint, CheckpointError, Precision, Simulation, State, backend_create,
    contact::{ContactKey, ContactKind, ContactSlip, Ghost, GhostAnchor},
    scene::{CompileOptions, CompiledScene, Scene},
};
use tempfile::TempDir;

/// Everything that a state can hold: pins that move and let go, a collider that moves, contact.
const SCENE: &str = r#"
name = "checkpoint"

[simulation]
frames = 20
frames_per_second = 60
time_step = 4e-4

[[cloth]]
name = "patch"
geometry.grid = { columns = 12, rows = 12, spacing = 0.02, centre = [0, 0, 0.4] }
material.preset = "jersey"
pins = ["bottom-left", "top-right"]
[cloth.material.stretch]
stiffness = 10
[cloth.material.shear]
stiffness = 5

[[collider]]
name = "ball"
shape.sphere.radius = 0.1
translation = [0, 0, 0.27]
motion = [{ time = 0.25, translation = [0.02, 0, 0.32] }]

[contact]
distance = 0.018
response.impulse.friction = 0.3

[[event]]
time = 0.05
cloth = "patch"
pins = ["top-right"]
action.move = { offset = [-0.05, 0, 0], duration = 0.2 }

[[event]]
time = 0.25
cloth = "patch"
pins = ["bottom-left"]
action = "release"
"#;

fn scene(precision: Precision, change: impl FnOnce(String) -> String) -> CompiledScene {
    let mut scene = Scene::from_toml(&change(SCENE.to_owned()), "checkpoint.toml").unwrap();
    scene.simulation.precision = match precision {
        Precision::F32 => cloth::scene::ScenePrecision::F32,
        Precision::F64 => cloth::scene::ScenePrecision::F64,
    };
    scene.compile(&CompileOptions::default()).unwrap()
}

fn advance(simulation: &mut Simulation, frames: u64) -> State {
    for _ in 0..frames {
        simulation.step().unwrap();
    }
    simulation.state().unwrap().clone()
}

fn bits(state: &State) -> Vec<u64> {
    let numbers = state.positions.iter().chain(&state.velocities).flatten();
    numbers.map(|number| number.to_bits()).collect()
}

#[test]
fn a_resumed_run_has_the_bits_of_an_uninterrupted_one() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("checkpoint");
    for precision in [Precision::F32, Precision::F64] {
        let scene = scene(precision, |text| text);
        let backend = backend_create("cpu", None).unwrap();
        let mut whole = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
        let wanted = advance(&mut whole, 20);

        let mut first = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
        let half = advance(&mut first, 10);
        first.checkpoint().unwrap().write(&path).unwrap();
        let checkpoint = Checkpoint::read(&path, &scene.model, precision).unwrap();
        assert_eq!(checkpoint, first.checkpoint().unwrap());
        let mut second = Simulation::resume(scene, backend.as_ref(), &checkpoint).unwrap();
        assert_eq!(second.frame(), 10);
        let found = advance(&mut second, 10);

        assert_ne!(bits(&half), bits(&wanted), "the second half does nothing");
        assert_eq!(bits(&found), bits(&wanted), "{precision}");
        assert_eq!(found, wanted);
    }
}

/// A brick that falls on a sheet, turning, and two balls one above the other, the lower one on the floor.
const BODIES: &str = r#"

[[collider]]
name = "floor"
shape.plane = {}

[[rigid]]
name = "brick"
shape.box.half_extents = [0.04, 0.03, 0.02]
translation = [0.01, 0, 0.45]
mass = 0.02
velocity = [0, 0, -0.5]
angular_velocity = [1, 2, 0.5]

[[rigid]]
name = "pebble"
shape.sphere.radius = 0.02
translation = [0.5, 0, 0.02]
mass = 0.01

[[rigid]]
name = "stone"
shape.sphere.radius = 0.03
translation = [0.503, 0, 0.09]
mass = 0.03
"#;

fn scene_with_bodies() -> CompiledScene {
    scene(Precision::F64, |text| text + BODIES)
}

fn resumed(scene: &CompiledScene, checkpoint: &Checkpoint) -> Result<Simulation, cloth::Error> {
    Simulation::resume(scene.clone(), backend_create("cpu", None).unwrap().as_ref(), checkpoint)
}

#[test]
fn rigid_bodies_in_contact_go_on_with_the_same_bits() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("checkpoint");
    let scene = scene_with_bodies();
    let backend = backend_create("cpu", None).unwrap();
    let mut whole = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
    advance(&mut whole, 9);
    whole.checkpoint().unwrap().write(&path).unwrap();
    let checkpoint = Checkpoint::read(&path, &scene.model, Precision::F64).unwrap();
    assert_eq!(checkpoint, whole.checkpoint().unwrap());
    let mut second = resumed(&scene, &checkpoint).unwrap();
    for frame in 10..20 {
        assert_eq!(advance(&mut second, 1), advance(&mut whole, 1), "frame {frame}");
    }
    assert_eq!(second.checkpoint().unwrap(), whole.checkpoint().unwrap());
}

#[test]
fn rigid_bodies_of_a_damaged_or_foreign_checkpoint_are_refused() {
    let scene = scene_with_bodies();
    let backend = backend_create("cpu", None).unwrap();
    let mut simulation = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
    advance(&mut simulation, 3);
    let checkpoint = simulation.checkpoint().unwrap();
    let refused = |scene: &CompiledScene, rigid: Vec<u8>| {
        let error = resumed(scene, &Checkpoint { rigid, ..checkpoint.clone() }).err().unwrap();
        assert!(matches!(error, cloth::Error::Checkpoint { .. }), "{error}");
        error.to_string()
    };
    let size = checkpoint.rigid.len();
    for length in [1, 3, 4, 19, 20, 35, 36, 37, size / 2, size - 1] {
        refused(&scene, checkpoint.rigid[..length].to_vec());
    }
    // With a sum over the file that is right again: only what the bodies keep themselves tells.
    for place in (0..size).step_by(size / 97) {
        let mut bytes = checkpoint.rigid.clone();
        bytes[place] ^= 1 << (place % 8);
        refused(&scene, bytes);
    }
    let message = refused(&scene, Vec::new());
    assert!(message.contains("3 rigid bodies"), "{message}");
    let heavier =
        self::scene(Precision::F64, |text| text + &BODIES.replace("mass = 0.03", "mass = 0.04"));
    let message = refused(&heavier, checkpoint.rigid.clone());
    assert!(message.contains("not those that were put down"), "{message}");
}

/// A checkpoint of the scene after two frames, and the scene.
struct Written {
    folder: TempDir,
    scene: CompiledScene,
}

impl Written {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let scene = scene(Precision::F32, |text| text);
        let backend = backend_create("cpu", None).unwrap();
        let mut simulation = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
        advance(&mut simulation, 2);
        simulation.checkpoint().unwrap().write(&folder.path().join("checkpoint")).unwrap();
        Self { folder, scene }
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("checkpoint")
    }

    /// The error of reading the file after `change` to its bytes.
    fn error(&self, change: impl FnOnce(&mut Vec<u8>)) -> CheckpointError {
        let mut bytes = std::fs::read(self.path()).unwrap();
        change(&mut bytes);
        let path = self.folder.path().join("changed");
        std::fs::write(&path, bytes).unwrap();
        read_error(&path, &self.scene)
    }
}

fn read_error(path: &Path, scene: &CompiledScene) -> CheckpointError {
    let error = Checkpoint::read(path, &scene.model, scene.config.precision).unwrap_err();
    assert!(error.to_string().contains(&path.display().to_string()), "{error}");
    error
}

/// Makes the checksum right again.
fn reseal(bytes: &mut [u8]) {
    let (content, end) = bytes.split_at_mut(bytes.len() - 4);
    end.copy_from_slice(&crc32fast::hash(content).to_le_bytes());
}

#[test]
fn every_length_but_the_right_one_is_refused() {
    let written = Written::new();
    let size = std::fs::metadata(written.path()).unwrap().len() as usize;
    for length in [
        1,
        7,
        8,
        11,
        63,
        64,
        67,
        68,
        71,
        72,
        75,
        76,
        79,
        80,
        83,
        84,
        87,
        88,
        91,
        95,
        96,
        99,
        103,
        104,
        107,
        111,
        112,
        115,
        size / 2,
        size - 1,
    ] {
        let error = written.error(|bytes| bytes.truncate(length));
        assert!(matches!(error, CheckpointError::Truncated { .. }), "{length}: {error}");
    }
    let error = written.error(|bytes| bytes.push(0));
    assert!(matches!(error, CheckpointError::Truncated { .. }), "{error}");
    assert!(matches!(written.error(Vec::clear), CheckpointError::Magic { .. }));
}

#[test]
fn another_file_is_refused() {
    let written = Written::new();
    let error = written.error(|bytes| bytes[0] = b'X');
    assert!(matches!(error, CheckpointError::Magic { .. }), "{error}");
    let error = read_error(&written.folder.path().join("missing"), &written.scene);
    assert!(matches!(error, CheckpointError::Read { .. }), "{error}");
}

#[test]
fn another_version_is_refused() {
    let error = Written::new().error(|bytes| bytes[8] = 99);
    assert!(matches!(error, CheckpointError::Version { found: 99, .. }), "{error}");
}

#[test]
fn earlier_versions_are_read_and_version_1_has_a_whole_time_step() {
    let written = Written::new();
    let now = Checkpoint::read(&written.path(), &written.scene.model, Precision::F32).unwrap();
    let mut bytes = std::fs::read(written.path()).unwrap();
    bytes[64..72].copy_from_slice(&[3, 0, 0, 0, 2, 0, 0, 0]);
    reseal(&mut bytes);
    let path = written.folder.path().join("changed");
    std::fs::write(&path, &bytes).unwrap();
    let halved = Checkpoint::read(&path, &written.scene.model, Precision::F32).unwrap();
    assert_eq!((halved.state.time_step_halvings, halved.state.time_step_good), (3, 2));
    assert!(halved.collider_fingerprint.is_some());
    bytes.drain(104..112);
    bytes[8] = 6;
    reseal(&mut bytes);
    std::fs::write(&path, &bytes).unwrap();
    let sixth = Checkpoint::read(&path, &written.scene.model, Precision::F32).unwrap();
    assert_eq!(sixth, halved, "version 6 knows nothing of broken stitches");
    bytes.drain(96..104);
    bytes[8] = 5;
    reseal(&mut bytes);
    std::fs::write(&path, &bytes).unwrap();
    let fifth = Checkpoint::read(&path, &written.scene.model, Precision::F32).unwrap();
    assert_eq!(fifth, halved, "version 5 knows nothing of ghosts");
    bytes.drain(88..96);
    bytes[8] = 4;
    reseal(&mut bytes);
    std::fs::write(&path, &bytes).unwrap();
    let fourth = Checkpoint::read(&path, &written.scene.model, Precision::F32).unwrap();
    assert_eq!(fourth, halved, "version 4 knows nothing of slips");
    let halved = Checkpoint { collider_fingerprint: None, ..halved };
    bytes.drain(80..88);
    bytes[8] = 3;
    reseal(&mut bytes);
    std::fs::write(&path, &bytes).unwrap();
    let third = Checkpoint::read(&path, &written.scene.model, Precision::F32).unwrap();
    assert_eq!(third, halved, "version 3 knows nothing of colliders");
    // A body of version 3, which is passed over.
    let mut with_body = bytes.clone();
    with_body[72] = 1;
    with_body.splice(with_body.len() - 4..with_body.len() - 4, [0; 104]);
    reseal(&mut with_body);
    std::fs::write(&path, &with_body).unwrap();
    let earlier = Checkpoint::read(&path, &written.scene.model, Precision::F32).unwrap();
    assert_eq!(earlier, halved, "version 3 has no contacts between bodies");
    bytes.drain(72..80);
    bytes[8] = 2;
    reseal(&mut bytes);
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(
        Checkpoint::read(&path, &written.scene.model, Precision::F32).unwrap(),
        halved,
        "version 2 has no bodies"
    );
    bytes.drain(64..72);
    bytes[8] = 1;
    reseal(&mut bytes);
    std::fs::write(&path, &bytes).unwrap();
    let old = Checkpoint::read(&path, &written.scene.model, Precision::F32).unwrap();
    assert_eq!(old, Checkpoint { collider_fingerprint: None, ..now });
    assert_eq!((old.state.time_step_halvings, old.state.time_step_good), (0, 0));
}

#[test]
fn every_changed_bit_is_noticed() {
    let written = Written::new();
    let size = std::fs::metadata(written.path()).unwrap().len() as usize;
    for place in [20, 30, 40, 118, size / 2, size - 2] {
        let error = written.error(|bytes| bytes[place] ^= 1);
        assert!(
            matches!(error, CheckpointError::Checksum { .. }),
            "byte {place} of {size}: {error}"
        );
    }
}

/// What friction remembers comes back, and nothing else is taken for it.
#[test]
fn slips_of_contacts_come_back() {
    let written = Written::new();
    let model = &written.scene.model;
    let mut kept = Checkpoint::read(&written.path(), model, Precision::F32).unwrap();
    let slip = |kind, first, slip| ContactSlip { key: ContactKey { kind, first, second: 9 }, slip };
    kept.state.slips = vec![
        slip(ContactKind::VertexFace, 3, [1e-5, -2e-6, 0.5]),
        slip(ContactKind::EdgeEdge, 7, [0.0, f64::MIN_POSITIVE, -0.0]),
    ];
    let path = written.folder.path().join("slips");
    kept.write(&path).unwrap();
    assert_eq!(Checkpoint::read(&path, model, Precision::F32).unwrap(), kept);
    // A kind of contact that does not exist.
    let mut bytes = std::fs::read(&path).unwrap();
    let place = bytes.len() - 4 - kept.rigid.len() - 2 * 36;
    bytes[place] = ContactKind::ALL.len() as u8;
    reseal(&mut bytes);
    std::fs::write(&path, &bytes).unwrap();
    let error = read_error(&path, &written.scene);
    assert!(matches!(error, CheckpointError::Read { .. }), "{error}");
    kept.state.slips[0].slip[1] = f64::NAN;
    kept.write(&path).unwrap();
    let error = read_error(&path, &written.scene);
    assert!(matches!(error, CheckpointError::State { .. }), "{error}");
}

/// What bodies have pinched comes back.
#[test]
fn ghosts_come_back() {
    let written = Written::new();
    let model = &written.scene.model;
    let mut kept = Checkpoint::read(&written.path(), model, Precision::F32).unwrap();
    let anchor =
        |node: u32| GhostAnchor { nodes: [node, 1, 2], weights: [0.5, 0.75, -0.25], height: -1e-4 };
    let ghost = |particle, anchors| Ghost { particle, is_guided: particle > 3, anchors };
    kept.state.ghosts =
        vec![ghost(2, vec![]), ghost(3, vec![anchor(7)]), ghost(9, vec![anchor(0), anchor(5)])];
    let path = written.folder.path().join("ghosts");
    kept.write(&path).unwrap();
    assert_eq!(Checkpoint::read(&path, model, Precision::F32).unwrap(), kept);
    kept.state.ghosts[2].particle = 144;
    kept.write(&path).unwrap();
    let error = read_error(&path, &written.scene);
    assert!(matches!(error, CheckpointError::State { .. }), "{error}");
    kept.state.ghosts = vec![ghost(2, vec![]); 145];
    kept.write(&path).unwrap();
    let error = read_error(&path, &written.scene);
    assert!(matches!(error, CheckpointError::Count { what: "ghosts", .. }), "{error}");
}

#[test]
fn a_number_that_is_not_finite_is_refused() {
    let written = Written::new();
    let error = written.error(|bytes| {
        bytes[112 + 24 * 5..][..8].copy_from_slice(&f64::NAN.to_le_bytes());
        reseal(bytes);
    });
    let CheckpointError::State { source, .. } = &error else { panic!("{error}") };
    assert!(source.to_string().contains("particle 5"), "{source}");
}

#[test]
fn another_model_is_refused() {
    let written = Written::new();
    let other = |from: &str, to: &str| {
        let changed = scene(Precision::F32, |text| text.replacen(from, to, 1));
        read_error(&written.path(), &changed)
    };
    let error = other("columns = 12", "columns = 13");
    assert!(matches!(error, CheckpointError::Count { found: 144, expected: 156, .. }), "{error}");
    let error = other("stiffness = 10", "stiffness = 11");
    assert!(matches!(error, CheckpointError::Model { .. }), "{error}");
}

#[test]
fn other_colliders_are_refused() {
    let written = Written::new();
    for (from, to) in [
        ("radius = 0.1", "radius = 0.11"),
        ("sphere.radius = 0.1", "box.half_extents = [0.1, 0.1, 0.1]"),
        ("translation = [0, 0, 0.27]", "translation = [0, 0.001, 0.27]"),
        ("translation = [0, 0, 0.27]", "translation = [0, 0, 0.27]\nfriction = 0.31"),
        ("translation = [0, 0, 0.27]", "translation = [0, 0, 0.27]\nrestitution = 0.5"),
    ] {
        let changed = scene(Precision::F32, |text| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        });
        let error = read_error(&written.path(), &changed);
        assert!(matches!(error, CheckpointError::Colliders { .. }), "{to}: {error}");
    }
    let error = read_error(
        &written.path(),
        &scene(Precision::F32, |text| {
            text.replacen("radius = 0.1", "radius = 0.1 # the same", 1)
                + "\n[[collider]]\nname = \"floor\"\nshape.plane = {}\n"
        }),
    );
    assert!(matches!(error, CheckpointError::Count { what: "colliders", .. }), "{error}");
}

#[test]
fn another_precision_is_refused() {
    let written = Written::new();
    let error = read_error(&written.path(), &scene(Precision::F64, |text| text));
    assert!(matches!(error, CheckpointError::Precision { .. }), "{error}");
    assert!(error.to_string().contains("continue with precision f32"), "{error}");
}

#[test]
fn a_run_that_is_longer_than_any_is_refused() {
    let written = Written::new();
    for (place, words) in [(24, "frames"), (32, "substeps")] {
        let error = written.error(|bytes| {
            bytes[place..place + 8].copy_from_slice(&(u64::MAX - 1).to_le_bytes());
            reseal(bytes);
        });
        let CheckpointError::Progress { what, found, .. } = error else { panic!("{error}") };
        assert_eq!((what, found), (words, u64::MAX - 1));
    }
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_no_checkpoints() {
    let folder = TempDir::new().unwrap();
    let scene = scene(Precision::F32, |text| text);
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let device = folder.path().join("zero");
    std::os::unix::fs::symlink("/dev/zero", &device).unwrap();
    for path in [&pipe, &device] {
        let error = read_error(path, &scene);
        assert!(matches!(error, CheckpointError::Read { .. }), "{error}");
        assert!(error.to_string().contains("not a regular file"), "{error}");
    }
}

/// A file without blocks on the disk, as long as its header says: neither its memory is taken nor its checksum waited for.
#[cfg(unix)]
#[test]
fn a_checkpoint_longer_than_any_is_refused_before_it_is_read() {
    let written = Written::new();
    let mut bytes = std::fs::read(written.path()).unwrap();
    let size = bytes.len() as u64;
    let path = written.folder.path().join("long");
    let refused = |bytes: &[u8], more: u64| {
        std::fs::write(&path, bytes).unwrap();
        std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(size + more).unwrap();
        let start = std::time::Instant::now();
        let error = read_error(&path, &written.scene);
        assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
        let CheckpointError::Count { what, .. } = error else { panic!("{error}") };
        what
    };
    let particles = u64::from_le_bytes(bytes[48..56].try_into().unwrap());
    let more = 1_u64 << 30;
    let mut longer = bytes.clone();
    longer[48..56].copy_from_slice(&(particles + more).to_le_bytes());
    assert_eq!(refused(&longer, 49 * more), "particles");
    let more = 1_u64 << 40;
    bytes[72..80].copy_from_slice(&more.to_le_bytes());
    assert_eq!(refused(&bytes, more), "bytes of rigid bodies");
}
