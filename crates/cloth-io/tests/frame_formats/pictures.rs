//! Pictures and clips.

use cloth_io::{ContainerOptions, Frame, FrameFormat, FrameSequenceWriter, container_write};

use crate::{
    common::{positions, store, topology},
    small_style,
};

#[test]
fn animated_pictures_have_all_frames() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 3);
    let options = ContainerOptions { style: small_style(), ..ContainerOptions::default() };
    let path = folder.path().join("run.gif");
    container_write(FrameFormat::Gif, &path, &topology(), &store, &options).unwrap();
    let mut decoder = gif::DecodeOptions::new();
    decoder.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = decoder.read_info(std::fs::File::open(&path).unwrap()).unwrap();
    assert_eq!((decoder.width(), decoder.height()), (64, 36));
    assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        delays.push(frame.delay);
    }
    assert_eq!(delays, [4, 4, 4]);

    let path = folder.path().join("run.png");
    container_write(FrameFormat::Apng, &path, &topology(), &store, &options).unwrap();
    let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let reader = png::Decoder::new(file).read_info().unwrap();
    assert_eq!(reader.info().animation_control().unwrap().num_frames, 3);
    assert_eq!((reader.info().width, reader.info().height), (64, 36));
}

#[test]
fn picture_sequences_have_the_size_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let topology = topology();
    let writer = FrameSequenceWriter::new(FrameFormat::Png, folder.path(), "run", &topology);
    let mut writer = writer.unwrap().with_style(small_style());
    let path = writer.write(&Frame::new(0, 0.0, &positions(0))).unwrap();
    assert_eq!(image::image_dimensions(path).unwrap(), (64, 36));
}

#[test]
fn an_animation_has_the_same_bytes_with_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 9);
    let options = ContainerOptions { style: small_style(), ..ContainerOptions::default() };
    let bytes = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let path = folder.path().join("run.gif");
        pool.install(|| container_write(FrameFormat::Gif, &path, &topology(), &store, &options))
            .unwrap();
        std::fs::read(path).unwrap()
    };
    assert_eq!(bytes(1), bytes(3));
}
