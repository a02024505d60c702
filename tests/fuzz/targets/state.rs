//! What a run reads back of its own: checkpoints, stores of frames, poses of rigid bodies.

use std::{fs, path::PathBuf, sync::LazyLock};

use cloth::{
    Checkpoint, PoseLog, Simulation,
    io::{FrameStore, Topology},
    scene::{CompileOptions, CompiledScene, Scene},
    topology,
};
use fastrand::Rng;

use super::{FOLDER, backend};
use crate::mutate::{binary, text};

/// A scene with all that a checkpoint has: pins, a collider that moves, a rigid body, contact.
const SCENE: &str = r#"
name = "state"
simulation = { frames = 9, frames_per_second = 60, time_step = 4e-4 }
contact = { distance = 0.018, response.impulse.friction = 0.3 }
[[cloth]]
name = "patch"
model = "springs"
geometry.grid = { columns = 4, rows = 4, spacing = 0.02, centre = [0, 0, 0.2] }
material.preset = "jersey"
pins = ["bottom-left"]
[[collider]]
name = "ball"
shape.sphere.radius = 0.1
translation = [0, 0, 0.05]
motion = [{ time = 0.25, translation = [0.02, 0, 0.1] }]
[[rigid]]
name = "stone"
shape.sphere.radius = 0.02
translation = [0, 0, 0.25]
mass = 0.01
"#;

/// Bytes of the fixed parts of the files.
const CHECKPOINT_HEADER: usize = 96;
const STORE_HEADER: usize = 64;
/// Frames that are kept.
const FRAMES: u64 = 3;

/// A run, and its files.
struct Kept {
    scene: CompiledScene,
    topology: Topology,
    checkpoint: Vec<u8>,
    frames: Vec<u8>,
    poses: Vec<u8>,
}

static KEPT: LazyLock<Kept> = LazyLock::new(|| {
    kept().unwrap_or_else(|error| panic!("the run whose files are changed: {error}"))
});

fn kept() -> Result<Kept, Box<dyn std::error::Error>> {
    let scene = Scene::from_toml(SCENE, "state.toml")?.compile(&CompileOptions::default())?;
    let topology = topology(&scene);
    let [checkpoint, frames, poses] = ["checkpoint", "frames", "poses"].map(path);
    let mut simulation = Simulation::new(scene.clone(), backend())?;
    let mut store = FrameStore::create(&frames, &topology)?;
    let log = PoseLog::create(&poses, scene.model.colliders().len())?;
    for _ in 0..FRAMES {
        simulation.step()?;
        let state = simulation.state()?;
        store.append(state.time, &state.positions)?;
        log.push(&state.colliders)?;
    }
    simulation.checkpoint()?.write(&checkpoint)?;
    let [checkpoint, frames, poses] = [checkpoint, frames, poses].map(fs::read);
    Ok(Kept { scene, topology, checkpoint: checkpoint?, frames: frames?, poses: poses? })
}

fn path(name: &str) -> PathBuf {
    FOLDER.path().join(name)
}

/// The input as a file.
fn file(name: &str, input: &[u8]) -> PathBuf {
    let path = path(name);
    fs::write(&path, input).unwrap_or_else(|error| panic!("{name}: {error}"));
    path
}

pub(crate) fn checkpoint_make(rng: &mut Rng) -> Vec<u8> {
    let mut bytes = binary::changed(rng, &KEPT.checkpoint, CHECKPOINT_HEADER);
    // Otherwise the checksum would hide all that comes after it.
    if rng.u8(..8) > 0
        && let Some(end) = bytes.len().checked_sub(4)
    {
        let checksum = crc32fast::hash(&bytes[..end]);
        binary::put(&mut bytes, end, &checksum.to_le_bytes());
    }
    bytes
}

pub(crate) fn checkpoint_run(input: &[u8]) -> bool {
    let Kept { scene, .. } = &*KEPT;
    let path = file("checkpoint", input);
    let Ok(checkpoint) = Checkpoint::read(&path, &scene.model, scene.config.precision) else {
        return false;
    };
    let again = path.with_file_name("checkpoint-again");
    checkpoint.write(&again).unwrap_or_else(|error| panic!("{error}"));
    let read = Checkpoint::read(&again, &scene.model, scene.config.precision);
    // An earlier version knows less.
    if checkpoint.collider_fingerprint.is_some() {
        assert_eq!(read.ok().as_ref(), Some(&checkpoint), "another checkpoint comes back");
    }
    let Ok(mut simulation) = Simulation::resume(scene.clone(), backend(), &checkpoint) else {
        return false;
    };
    // Numbers that make no sense diverge, and say so.
    let _ = simulation.step();
    true
}

pub(crate) fn frames_make(rng: &mut Rng) -> Vec<u8> {
    let mut bytes = binary::changed(rng, &KEPT.frames, STORE_HEADER);
    if rng.u8(..8) == 0 {
        return bytes;
    }
    // Checksums that are right again: of the header, and of each record and its time.
    if let Some(header) = bytes.get(..STORE_HEADER - 4) {
        let checksum = crc32fast::hash(header);
        binary::put(&mut bytes, STORE_HEADER - 4, &checksum.to_le_bytes());
    }
    let record = 8 + 4 + 12 * KEPT.topology.particle_count + 4;
    if let Some(records) = bytes.get_mut(STORE_HEADER..) {
        for (index, record) in records.chunks_exact_mut(record).enumerate() {
            let mut hasher = crc32fast::Hasher::new();
            hasher.update(&(index as u64).to_le_bytes());
            hasher.update(&record[..8]);
            let head = hasher.clone().finalize();
            record[8..12].copy_from_slice(&head.to_le_bytes());
            let end = record.len() - 4;
            hasher.update(&record[12..end]);
            record[end..].copy_from_slice(&hasher.finalize().to_le_bytes());
        }
    }
    bytes
}

pub(crate) fn frames_run(input: &[u8]) -> bool {
    let topology = &KEPT.topology;
    let path = file("frames", input);
    let Ok(store) = FrameStore::open_read_only(&path, topology) else { return false };
    let mut is_accepted = true;
    for index in 0..store.len() {
        match store.frame(index) {
            Ok(frame) => {
                assert_eq!(frame.positions.len(), topology.particle_count);
                assert!(frame.positions.iter().flatten().all(|x| x.is_finite()), "no number");
                assert!(frame.time.is_finite(), "no time");
                assert_eq!(store.time(index).ok(), Some(frame.time));
            }
            Err(_) => is_accepted = false,
        }
    }
    let length = store.len();
    drop(store);
    if let Ok(mut store) = FrameStore::open(&path, topology) {
        let positions = vec![[0.5; 3]; topology.particle_count];
        store.append(1.0, &positions).unwrap_or_else(|error| panic!("appending: {error}"));
        let frame = store.frame(length).unwrap_or_else(|error| panic!("what was written: {error}"));
        assert_eq!(frame.positions_f64(), positions);
    }
    is_accepted
}

pub(crate) fn poses_make(rng: &mut Rng) -> Vec<u8> {
    let text = String::from_utf8_lossy(&KEPT.poses).into_owned();
    if rng.bool() {
        return binary::changed(rng, text.as_bytes(), 0);
    }
    let changed = text::mutated(rng, &[text], &["nan", "inf", " ", "\n", "1e0"]);
    text::bytes(rng, changed)
}

pub(crate) fn poses_run(input: &[u8]) -> bool {
    let poses: Vec<_> = KEPT.scene.model.colliders().iter().map(|c| c.pose).collect();
    let path = file("poses", input);
    let Ok(log) = PoseLog::read(&path, poses.len()) else { return false };
    for frame in 0..=log.len().min(100) {
        let poses = log.at(frame as usize);
        assert!(poses.iter().flat_map(|pose| pose.translation).all(f64::is_finite), "no number");
    }
    drop(log);
    let log = PoseLog::resume(&path, &poses, 2);
    let log = log.unwrap_or_else(|error| panic!("read and not resumed: {error}"));
    log.push(&poses).unwrap_or_else(|error| panic!("appending: {error}"));
    assert_eq!((log.len(), log.at(2)), (3, poses));
    true
}
