//! The frame store: what is written is read back, and damage is found.

mod common;

use std::fs::OpenOptions;

use cloth_io::{FrameError, FrameStore};
use common::{positions, store, topology};

#[test]
fn frames_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    let written = store(&path, 3);
    assert_eq!(written.len(), 3);
    let frame = written.frame(2).unwrap();
    assert_eq!(frame.time, 2.0 / 25.0);
    assert_eq!(frame.positions_f64(), positions(2));
    drop(written);

    let mut read = FrameStore::open(&path, &topology()).unwrap();
    assert_eq!(read.len(), 3);
    assert_eq!(read.frame(2).unwrap(), frame);
    assert_eq!(read.time(1).unwrap(), 1.0 / 25.0);
    read.append(9.0, &positions(5)).unwrap();
    read.sync().unwrap();
    assert_eq!(read.frame(3).unwrap().positions_f64(), positions(5));
    assert_eq!(read.frame(0).unwrap().positions_f64(), positions(0));
    assert!(matches!(read.frame(4), Err(FrameError::FrameIndex { index: 4, count: 4 })));
}

#[test]
fn truncated_frames_are_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    let mut store = store(&path, 4);
    store.truncate(9).unwrap();
    assert_eq!(store.len(), 4);
    store.truncate(2).unwrap();
    assert_eq!(store.len(), 2);
    store.append(7.0, &positions(7)).unwrap();
    drop(store);
    let store = FrameStore::open_read_only(&path, &topology()).unwrap();
    assert_eq!(store.len(), 3);
    assert_eq!(store.frame(2).unwrap().positions_f64(), positions(7));
}

#[test]
fn a_partial_record_is_dropped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    drop(store(&path, 2));
    let size = std::fs::metadata(&path).unwrap().len();
    for missing in [1, 8 + 12 * 8 - 1] {
        OpenOptions::new().write(true).open(&path).unwrap().set_len(size - missing).unwrap();
        assert_eq!(FrameStore::open_read_only(&path, &topology()).unwrap().len(), 1);
    }
    let mut store = FrameStore::open(&path, &topology()).unwrap();
    store.append(1.0, &positions(3)).unwrap();
    assert_eq!(store.frame(1).unwrap().positions_f64(), positions(3));
    assert_eq!(std::fs::metadata(&path).unwrap().len(), size);
}

#[test]
fn other_files_and_other_runs_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    let open = |topology| FrameStore::open_read_only(&path, &topology);
    assert!(matches!(open(topology()), Err(FrameError::Read { .. })));
    drop(store(&path, 1));

    let mut other = topology();
    other.triangles[0] = [1, 2, 3];
    assert!(matches!(open(other), Err(FrameError::StoreTopology { found: 8, expected: 8, .. })));
    let mut other = topology();
    other.frames_per_second = 30.0;
    assert!(matches!(open(other), Err(FrameError::StoreRate { .. })));

    let mut bytes = std::fs::read(&path).unwrap();
    bytes[8] = 2;
    std::fs::write(&path, &bytes).unwrap();
    let problem = open(topology()).unwrap_err();
    assert!(matches!(problem, FrameError::StoreVersion { found: 2, expected: 1, .. }));
    bytes[0] = b'X';
    std::fs::write(&path, &bytes).unwrap();
    assert!(matches!(open(topology()), Err(FrameError::StoreMagic { .. })));
    std::fs::write(&path, &bytes[..63]).unwrap();
    assert!(matches!(open(topology()), Err(FrameError::StoreMagic { .. })));
}

#[test]
fn only_one_run_appends() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    let first = store(&path, 1);
    assert!(matches!(FrameStore::open(&path, &topology()), Err(FrameError::StoreLocked { .. })));
    let second = FrameStore::create(&path, &topology());
    assert!(matches!(second, Err(FrameError::StoreLocked { .. })));
    assert_eq!(first.frame(0).unwrap().positions_f64(), positions(0), "the store is untouched");
    let mut reader = FrameStore::open_read_only(&path, &topology()).unwrap();
    let refused = reader.append(0.0, &positions(0));
    assert!(matches!(refused, Err(FrameError::StoreReadOnly { .. })));
    assert!(matches!(reader.truncate(0), Err(FrameError::StoreReadOnly { .. })));
}

#[test]
fn bad_frames_are_refused_and_leave_the_store_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = store(&folder.path().join("frames.cloth"), 1);
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let mut broken = positions(0);
        broken[5][2] = bad;
        let refused = store.append(0.0, &broken);
        assert!(matches!(refused, Err(FrameError::Position { particle: 5 })));
    }
    let refused = store.append(0.0, &positions(0)[1..]);
    assert!(matches!(refused, Err(FrameError::ParticleCount { found: 7, expected: 8 })));
    assert_eq!(store.len(), 1);
}

#[test]
fn inconsistent_topologies_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    type Change = fn(&mut cloth_io::Topology);
    let changes: [Change; 6] = [
        |t| t.triangles[3] = [4, 6, 8],
        |t| t.triangles[3] = [3, 6, 7],
        |t| t.cloths[1].particles.end = 9,
        |t| t.cloths.truncate(1),
        |t| t.frames_per_second = f64::NAN,
        |t| t.texture.as_mut().unwrap().triangles[0] = [0, 1, 5],
    ];
    for change in changes {
        let mut broken = topology();
        change(&mut broken);
        let refused = FrameStore::create(&path, &broken);
        assert!(matches!(refused, Err(FrameError::Topology { .. })), "{broken:?}");
    }
}

/// The hash is part of the file format.
#[test]
fn the_topology_hash_does_not_change() {
    assert_eq!(topology().hash(), 0xd182_943b_2385_40d7);
}
