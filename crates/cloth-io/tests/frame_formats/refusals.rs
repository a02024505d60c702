//! What cannot be written, or named.

use cloth_io::{
    ContainerOptions, Frame, FrameError, FrameFormat, FrameSequenceWriter, container_write,
};

use crate::{
    common::{positions, store, topology},
    files, small_style,
};

#[test]
fn names_are_read_back_and_typing_errors_explained() {
    for format in FrameFormat::ALL {
        assert_eq!(format.to_string().to_uppercase().parse(), Ok(format));
    }
    assert_eq!("glb".parse(), Ok(FrameFormat::Gltf));
    let message = "fbx".parse::<FrameFormat>().unwrap_err().to_string();
    assert!(message.starts_with("unknown output format `fbx`; use one of: obj, ply, vtu"));
}

#[test]
fn wrong_kinds_and_bad_frames_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let topology = topology();
    let path = folder.path().join("frames.cloth");
    let options = ContainerOptions::default();
    let empty = store(&path, 0);
    for format in FrameFormat::ALL {
        let writer = FrameSequenceWriter::new(format, folder.path(), "run", &topology);
        assert_eq!(writer.is_ok(), format.is_sequence());
        let container = container_write(format, &path, &topology, &empty, &options);
        match container.unwrap_err() {
            FrameError::Kind { .. } => assert!(format.is_sequence()),
            FrameError::FrameNone { .. } => assert!(!format.is_sequence()),
            other => panic!("{other}"),
        }
    }
    let mut writer =
        FrameSequenceWriter::new(FrameFormat::Obj, folder.path(), "run", &topology).unwrap();
    let mut bad = positions(0);
    bad[7][0] = f64::NAN;
    let refused = writer.write(&Frame::new(0, 0.0, &bad));
    assert!(matches!(refused, Err(FrameError::Position { particle: 7 })));
    let refused = writer.write(&Frame::new(0, 0.0, &bad[1..]));
    assert!(matches!(refused, Err(FrameError::ParticleCount { found: 7, expected: 8 })));
    assert_eq!(files(folder.path()), ["frames.cloth"], "no half file is left");
}

/// What one format cannot hold, no format takes: OBJ is text and could hold 1e300, PLY could hold NaN.
#[test]
fn a_frame_that_is_not_finite_is_refused_alike_by_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let topology = topology();
    let good = positions(0);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        let mut broken = good.clone();
        broken[6][1] = bad;
        let frames = [
            ("position", Frame::new(0, 0.0, &broken)),
            ("velocity", Frame { velocities: Some(&broken), ..Frame::new(0, 0.0, &good) }),
            ("normal", Frame { normals: Some(&broken), ..Frame::new(0, 0.0, &good) }),
        ];
        for (wrong, frame) in frames {
            for format in FrameFormat::ALL.into_iter().filter(|format| format.is_sequence()) {
                let writer = FrameSequenceWriter::new(format, folder.path(), "run", &topology);
                let refused = writer.unwrap().with_style(small_style()).write(&frame).unwrap_err();
                match refused {
                    FrameError::Position { particle: 6 } => assert_eq!(wrong, "position"),
                    FrameError::Vector { what, particle: 6 } => assert_eq!(wrong, what),
                    other => panic!("{format}: {other}"),
                }
            }
        }
        // All other formats are made of a store.
        let mut store = store(&folder.path().join("frames.cloth"), 0);
        let refused = store.append(0.0, &broken);
        assert!(matches!(refused, Err(FrameError::Position { particle: 6 })), "{bad}");
    }
    for format in [FrameFormat::Obj, FrameFormat::Ply, FrameFormat::Vtu, FrameFormat::Png] {
        let writer = FrameSequenceWriter::new(format, folder.path(), "run", &topology);
        let refused = writer.unwrap().write(&Frame::new(3, f64::NAN, &good));
        assert!(matches!(refused, Err(FrameError::Time { index: 3, .. })), "{format}");
    }
    assert_eq!(files(folder.path()), ["frames.cloth"]);
}

/// A damaged store gives no file in any format, and the file from before stays.
#[test]
fn a_damaged_frame_is_refused_alike_by_every_container() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    drop(store(&path, 4));
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[64 + 2 * (16 + 12 * 8) + 40] ^= 4;
    std::fs::write(&path, bytes).unwrap();
    let damaged = cloth_io::FrameStore::open_read_only(&path, &topology()).unwrap();
    let options = ContainerOptions { style: small_style(), ..ContainerOptions::default() };
    for format in FrameFormat::ALL.into_iter().filter(|format| !format.is_sequence()) {
        let output = folder.path().join("run.out");
        std::fs::write(&output, "before").unwrap();
        let error = container_write(format, &output, &topology(), &damaged, &options).unwrap_err();
        assert!(matches!(error, FrameError::StoreDamaged { index: 2, .. }), "{format}: {error}");
        assert_eq!(std::fs::read(&output).unwrap(), b"before", "{format}");
    }
}

#[test]
fn errors_name_the_file_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 1);
    let path = folder.path().join("missing").join("run.npz");
    let options = ContainerOptions::default();
    let problem =
        container_write(FrameFormat::Npz, &path, &topology(), &store, &options).unwrap_err();
    let message = problem.to_string();
    assert!(message.contains("run.npz"), "{message}");
    assert!(message.contains("choose another folder"), "{message}");
}
