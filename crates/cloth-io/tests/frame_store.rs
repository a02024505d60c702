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
    for missing in [1, 8 + 4 + 12 * 8 + 4 - 1] {
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
    bytes[8] = 3;
    std::fs::write(&path, &bytes).unwrap();
    let problem = open(topology()).unwrap_err();
    assert!(matches!(problem, FrameError::StoreVersion { found: 3, expected: 2, .. }));
    bytes[0] = b'X';
    std::fs::write(&path, &bytes).unwrap();
    assert!(matches!(open(topology()), Err(FrameError::StoreMagic { .. })));
    std::fs::write(&path, &bytes[..63]).unwrap();
    assert!(matches!(open(topology()), Err(FrameError::StoreMagic { .. })));
}

/// Of 60 flipped bits 48 once gave wrong frames and no error.
#[test]
fn a_flipped_bit_in_any_byte_of_a_store_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    drop(store(&path, 2));
    let bytes = std::fs::read(&path).unwrap();
    let expected: Vec<_> = (0..2).map(positions).collect();
    for bit in (0..bytes.len()).map(|byte| 8 * byte + byte % 8) {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        std::fs::write(&path, &damaged).unwrap();
        let Ok(store) = FrameStore::open_read_only(&path, &topology()) else {
            assert!(bit < 8 * 64, "bit {bit} is none of the header");
            continue;
        };
        assert!(bit >= 8 * 64, "bit {bit} of the header");
        let hit = (bit / 8 - 64) / (16 + 12 * 8);
        for (index, expected) in expected.iter().enumerate() {
            match store.frame(index) {
                Ok(frame) => {
                    assert_ne!(index, hit, "bit {bit}");
                    assert_eq!(&frame.positions_f64(), expected);
                }
                Err(FrameError::StoreDamaged { index: found, .. }) => {
                    assert_eq!((index, found), (hit, hit), "bit {bit}");
                }
                Err(other) => panic!("{other}"),
            }
            // The time has a checksum of its own.
            let in_time = (bit / 8 - 64) % (16 + 12 * 8) < 12;
            assert_eq!(store.time(index).is_err(), index == hit && in_time, "bit {bit}");
        }
    }
}

#[test]
fn frames_that_changed_places_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    drop(store(&path, 2));
    let bytes = std::fs::read(&path).unwrap();
    let (header, records) = bytes.split_at(64);
    let (first, second) = records.split_at(records.len() / 2);
    std::fs::write(&path, [header, second, first].concat()).unwrap();
    let store = FrameStore::open_read_only(&path, &topology()).unwrap();
    let message = store.frame(0).unwrap_err().to_string();
    assert!(
        message.contains("frame 0 of frame store") && message.contains("checksum"),
        "{message}"
    );
}

/// The bytes of a store of the first version, which had no checksums.
fn first_version(frames: usize) -> Vec<u8> {
    let mut bytes = b"CLOTHFRM\x01\0\0\0\0\0\0\0".to_vec();
    bytes.extend(8_u64.to_le_bytes());
    bytes.extend(topology().hash().to_le_bytes());
    bytes.extend(25_f64.to_le_bytes());
    bytes.resize(64, 0);
    for index in 0..frames {
        bytes.extend((index as f64 / 25.0).to_le_bytes());
        let numbers = positions(index).concat().into_iter();
        bytes.extend(numbers.flat_map(|x| (x as f32).to_le_bytes()));
    }
    bytes
}

#[test]
fn stores_of_the_first_version_are_read_and_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    std::fs::write(&path, first_version(2)).unwrap();
    let mut store = FrameStore::open(&path, &topology()).unwrap();
    assert_eq!(store.len(), 2);
    assert_eq!(store.frame(1).unwrap().positions_f64(), positions(1));
    store.append(0.08, &positions(2)).unwrap();
    assert_eq!(store.frame(2).unwrap().positions_f64(), positions(2));
    drop(store);
    assert_eq!(std::fs::read(&path).unwrap(), first_version(3));
}

/// A store without checksums can hold anything; a number that is not finite goes no further.
#[test]
fn stored_numbers_that_are_not_finite_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    let mut bytes = first_version(3);
    let record = 8 + 12 * 8;
    bytes[64 + record + 8 + 12 * 5 + 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    bytes[64 + 2 * record..][..8].copy_from_slice(&f64::INFINITY.to_le_bytes());
    std::fs::write(&path, bytes).unwrap();
    let store = FrameStore::open_read_only(&path, &topology()).unwrap();
    assert_eq!(store.frame(0).unwrap().positions_f64(), positions(0));
    for (index, words) in [(1, "the position of particle 5 is not finite"), (2, "its time is inf")]
    {
        let error = store.frame(index).unwrap_err();
        assert!(matches!(error, FrameError::StoreDamaged { .. }), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
    assert!(store.time(2).is_err());
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
    for bad in [f64::NAN, f64::NEG_INFINITY] {
        let refused = store.append(bad, &positions(0));
        assert!(matches!(refused, Err(FrameError::Time { index: 1, .. })));
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

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_no_stores() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let device = folder.path().join("zero");
    std::os::unix::fs::symlink("/dev/zero", &device).unwrap();
    for path in [&pipe, &device] {
        for opened in
            [FrameStore::open(path, &topology()), FrameStore::open_read_only(path, &topology())]
        {
            let error = opened.unwrap_err();
            assert!(matches!(error, FrameError::Read { .. }), "{error}");
            assert!(error.to_string().contains("not a regular file"), "{error}");
        }
        let error = FrameStore::create(path, &topology()).unwrap_err();
        assert!(matches!(error, FrameError::Write { .. }), "{error}");
    }
}
