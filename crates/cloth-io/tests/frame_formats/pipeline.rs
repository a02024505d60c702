//! Frames that several threads write.

use std::num::NonZeroUsize;

use cloth_io::{
    Bounds, Camera, Frame, FrameError, FrameFormat, FramePipeline, PictureSequence, PictureStyle,
};

use crate::{
    common::{positions, store, topology},
    files, small_style,
};

/// The files that a pipeline with that many threads writes, in the order of their names.
fn piped(threads: usize) -> Vec<(String, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let store = store(&root.join("frames.cloth"), 0);
    let mut pipeline = FramePipeline::new(&topology(), NonZeroUsize::new(threads)).unwrap();
    for format in [FrameFormat::Obj, FrameFormat::Vtu] {
        pipeline.add_geometry(format, &root.join("geometry"), "run", &store).unwrap();
    }
    let bounds = Bounds { min: [-2.0; 3], max: [2.0; 3] };
    let style = PictureStyle { camera: Some(Camera::fit(&bounds, 1.8)), ..small_style() };
    let sequence = |name: &str| PictureSequence { folder: root.join(name), name: "run".to_owned() };
    pipeline.add_pictures(&sequence("pictures"), &style).unwrap();
    let smaller = PictureStyle { width: 32, height: 18, ..style };
    pipeline.add_pictures(&sequence("smaller"), &smaller).unwrap();
    for index in 0..9 {
        let positions = positions(index as usize);
        pipeline.write(&Frame::new(index, 0.04 * index as f64, &positions), None).unwrap();
    }
    pipeline.finish().unwrap();
    let mut contents = Vec::new();
    for name in ["geometry", "pictures", "smaller"] {
        let folder = root.join(name);
        for file in files(&folder) {
            contents.push((format!("{name}/{file}"), std::fs::read(folder.join(file)).unwrap()));
        }
    }
    contents
}

#[test]
fn a_pipeline_writes_the_same_bytes_with_any_number_of_threads() {
    let one = piped(1);
    assert_eq!(one.len(), 9 + 9 + 1 + 9 + 9);
    assert_eq!(one, piped(3));
    let collection = one.iter().find(|(name, _)| name.ends_with(".pvd")).unwrap();
    let text = String::from_utf8(collection.1.clone()).unwrap();
    assert_eq!(text.matches("run_00000").count(), 9, "{text}");
}

#[test]
fn what_a_pipeline_cannot_write_is_told_later() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 0);
    let path = folder.path().join("obj");
    let mut pipeline = FramePipeline::new(&topology(), NonZeroUsize::new(2)).unwrap();
    pipeline.add_geometry(FrameFormat::Obj, &path, "run", &store).unwrap();
    pipeline.write(&Frame::new(0, 0.0, &positions(0)), None).unwrap();
    pipeline.finish().unwrap();
    std::fs::remove_dir_all(&path).unwrap();
    let mut told = None;
    for index in 1..40 {
        let positions = positions(0);
        told = pipeline.write(&Frame::new(index, 0.0, &positions), None).err();
        if told.is_some() {
            break;
        }
    }
    let message = told.expect("before long").to_string();
    assert!(message.contains("run_000001.obj"), "the earliest frame first: {message}");
    // Frames that are not good are refused at once, and geometry is not drawn.
    let mut bad = positions(0);
    bad[7][0] = f64::NAN;
    let refused = pipeline.write(&Frame::new(50, 0.0, &bad), None);
    assert!(matches!(refused, Err(FrameError::Position { particle: 7 })));
    let refused = pipeline.add_geometry(FrameFormat::Png, &path, "run", &store);
    assert!(matches!(refused, Err(FrameError::Kind { .. })));
}
