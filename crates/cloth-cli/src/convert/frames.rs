//! From the frames of a run to any format.

use cloth::{
    io::{
        ContainerOptions, Frame, FrameFormat, FrameSequenceWriter, FrameStore, PictureStyle,
        Topology, container_write,
    },
    picture_style, topology,
};

use crate::{arguments::ConvertArguments, failure::Failure, memory, run_folder::RunFolder};

use super::extension;

pub(super) fn convert(arguments: &ConvertArguments) -> Result<(), Failure> {
    let format = format(arguments)?;
    let (scene, options) = RunFolder::scene_read(&arguments.input)?;
    memory::check(&scene, &options)?;
    let compiled = scene.compile(&options)?;
    let folder = RunFolder::new(Some(&arguments.input), &compiled.name);
    let topology = topology(&compiled);
    let store = FrameStore::open_read_only(&folder.store(), &topology)?;
    let size = arguments.picture_size;
    let style = PictureStyle { width: size.width, height: size.height, ..picture_style(&compiled) };
    if format.is_sequence() {
        return sequence_write(format, arguments, folder.name(), &topology, &store, style);
    }
    let frame_stride = arguments.frame_stride.map(std::num::NonZeroUsize::get);
    let options = ContainerOptions { frame_stride, style, ..ContainerOptions::default() };
    let report = container_write(format, &arguments.output, &topology, &store, &options)?;
    for warning in report.warnings {
        eprintln!("warning: {warning}");
    }
    Ok(())
}

/// The format that is asked for; of formats with one file per frame only by its name, as their
/// output is a folder.
fn format(arguments: &ConvertArguments) -> Result<FrameFormat, Failure> {
    if let Some(format) = arguments.format {
        return Ok(format);
    }
    let extension = extension(&arguments.output);
    let known = FrameFormat::ALL
        .into_iter()
        .find(|format| !format.is_sequence() && format.extension() == extension);
    known.ok_or_else(|| {
        Failure::Usage(format!(
            "the name `{}` does not say a format; use --format with one of: {}",
            arguments.output.display(),
            FrameFormat::ALL.map(FrameFormat::name).join(", ")
        ))
    })
}

fn sequence_write(
    format: FrameFormat,
    arguments: &ConvertArguments,
    name: &str,
    topology: &Topology,
    store: &FrameStore,
    style: PictureStyle,
) -> Result<(), Failure> {
    let writer = FrameSequenceWriter::new(format, &arguments.output, name, topology)?;
    let mut writer = writer.with_style(style);
    let stride = arguments.frame_stride.map_or(1, std::num::NonZeroUsize::get);
    for index in (0..store.len()).step_by(stride) {
        let stored = store.frame(index)?;
        writer.write(&Frame::new(index as u64, stored.time, &stored.positions_f64()))?;
    }
    Ok(())
}
