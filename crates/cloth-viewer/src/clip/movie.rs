//! Clips as MP4: AV1, which nobody charges for, encoded and packed without a library of the system.

use std::{
    io::Write,
    num::NonZeroU32,
    path::{Path, PathBuf},
};

use cloth::io::file_replace;
use image::RgbImage;
use rav1e::{
    Config, Context, EncoderConfig, EncoderStatus,
    prelude::{
        ColorDescription, ColorPrimaries, FrameType, MatrixCoefficients, PixelRange, Rational,
        SceneDetectionSpeed, TransferCharacteristics,
    },
};
use shiguredo_mp4::{
    TrackKind,
    bitstream::av1::{
        Av1ObuParseContext, Av1ObuType, Av1SampleEntryConfig, build_av01_box_from_config_obus,
        parse_obus,
    },
    boxes::SampleEntry,
    mux::{Mp4FileMuxer, Mp4FileMuxerOptions, Sample, estimate_maximum_moov_box_size},
};

use crate::ViewerError;

/// Speed of the encoder, the highest: pictures of cloth are easy, and nobody wants to wait.
const SPEED: u8 = 10;
/// Base quantizer, 0 (without loss) to 255.
const QUANTIZER: usize = 70;
/// A film can be entered at every so many pictures.
const KEY_INTERVAL: u64 = 60;
/// Parts of a picture that are encoded side by side; a fixed number gives the same bytes everywhere.
const TILES: usize = 4;
/// Units of time in a frame, so that rates need not be whole.
const FRAME_TICKS: u32 = 1000;

/// A film in the making. What is encoded waits in memory, which is little.
pub(crate) struct MovieWriter {
    path: PathBuf,
    encoder: Context<u8>,
    size: [u32; 2],
    ticks_per_second: NonZeroU32,
    samples: Vec<EncodedPicture>,
    /// The header that players want beside the pictures.
    header: Vec<u8>,
}

/// A picture as it will be in the file.
struct EncodedPicture {
    data: Vec<u8>,
    is_key: bool,
}

impl MovieWriter {
    /// Begins a film of pictures of this size that [`Self::finish`] will write to `path`.
    ///
    /// # Errors
    /// [`ViewerError::Output`] for sizes that the format has not.
    pub(crate) fn new(
        path: &Path,
        size: [u32; 2],
        frames_per_second: f64,
    ) -> Result<Self, ViewerError> {
        let ticks = (frames_per_second * f64::from(FRAME_TICKS)).round().clamp(1.0, 1e9) as u32;
        let mut settings = EncoderConfig::with_speed_preset(SPEED);
        [settings.width, settings.height] = size.map(|side| side as usize);
        settings.time_base = Rational::new(FRAME_TICKS.into(), ticks.into());
        settings.pixel_range = PixelRange::Limited;
        settings.color_description = Some(ColorDescription {
            color_primaries: ColorPrimaries::BT709,
            transfer_characteristics: TransferCharacteristics::SRGB,
            matrix_coefficients: MatrixCoefficients::BT709,
        });
        // Pictures in the order in which they are shown: a packet is a sample of the file.
        settings.low_latency = true;
        settings.speed_settings.scene_detection_mode = SceneDetectionSpeed::None;
        settings.max_key_frame_interval = KEY_INTERVAL;
        settings.quantizer = QUANTIZER;
        settings.tiles = TILES;
        let config = Config::new().with_encoder_config(settings);
        let encoder = config.new_context().map_err(|error| ViewerError::Output {
            path: path.to_owned(),
            problem: error.to_string(),
            mend: "choose a --picture-size with sides of 16 to 65535 pixels",
        })?;
        Ok(Self {
            path: path.to_owned(),
            encoder,
            size,
            ticks_per_second: NonZeroU32::new(ticks).unwrap_or(NonZeroU32::MIN),
            samples: Vec::new(),
            header: Vec::new(),
        })
    }

    /// Adds a picture; one of another size is scaled.
    ///
    /// # Errors
    /// [`ViewerError::Output`] if the encoder fails.
    pub(crate) fn push(&mut self, picture: &RgbImage) -> Result<(), ViewerError> {
        let [width, height] = self.size;
        let scaled;
        let picture = if picture.dimensions() == (width, height) {
            picture
        } else {
            let filter = image::imageops::FilterType::Triangle;
            scaled = image::imageops::resize(picture, width, height, filter);
            &scaled
        };
        let mut frame = self.encoder.new_frame();
        for (plane, samples) in frame.planes.iter_mut().zip(planes(picture)) {
            let stride = plane.cfg.width;
            plane.copy_from_raw_u8(&samples, stride, 1);
        }
        self.encoder.send_frame(frame).map_err(|error| self.failure(&error))?;
        self.packets_take()
    }

    /// Writes the file, and gives back its path.
    ///
    /// # Errors
    /// [`ViewerError::Output`].
    pub(crate) fn finish(mut self) -> Result<PathBuf, ViewerError> {
        self.encoder.flush();
        self.packets_take()?;
        let boxes = self.boxes()?;
        let written = file_replace(&self.path, |file| {
            file.write_all(&boxes.head)?;
            self.samples.iter().try_for_each(|sample| file.write_all(&sample.data))?;
            file.write_all(&boxes.tail)
        });
        written.map_err(|error| ViewerError::Output {
            path: self.path.clone(),
            problem: error.to_string(),
            mend: "check free space and permissions or choose another folder",
        })?;
        Ok(self.path)
    }

    /// Takes what the encoder has ready.
    fn packets_take(&mut self) -> Result<(), ViewerError> {
        loop {
            match self.encoder.receive_packet() {
                Ok(packet) => {
                    let is_key = packet.frame_type == FrameType::KEY;
                    self.sample_push(&packet.data, is_key)?;
                }
                // A picture is being worked on.
                Err(EncoderStatus::Encoded) => {}
                Err(EncoderStatus::NeedMoreData | EncoderStatus::LimitReached) => return Ok(()),
                Err(error) => return Err(self.failure(&error)),
            }
        }
    }

    /// A packet without the marks that only streams have.
    fn sample_push(&mut self, packet: &[u8], is_key: bool) -> Result<(), ViewerError> {
        let units =
            parse_obus(packet, Av1ObuParseContext::Sample).map_err(|error| self.failure(&error))?;
        let mut data = Vec::with_capacity(packet.len());
        for unit in units {
            if unit.obu_type == Av1ObuType::SequenceHeader && self.header.is_empty() {
                self.header = unit.obu.to_vec();
            }
            if unit.obu_type != Av1ObuType::TemporalDelimiter {
                data.extend_from_slice(unit.obu);
            }
        }
        self.samples.push(EncodedPicture { data, is_key });
        Ok(())
    }

    /// What stands around the pictures in the file.
    fn boxes(&self) -> Result<Boxes, ViewerError> {
        let fail = |error: &dyn std::fmt::Display| self.failure(error);
        let options = Mp4FileMuxerOptions {
            // Room for the index at the start, so that players need not read to the end.
            reserved_moov_box_size: estimate_maximum_moov_box_size(&[self.samples.len()]),
            ..Mp4FileMuxerOptions::default()
        };
        let mut muxer = Mp4FileMuxer::with_options(options).map_err(|e| fail(&e))?;
        let entry = Av1SampleEntryConfig { initial_presentation_delay_minus_one: None };
        let entry =
            build_av01_box_from_config_obus(&self.header, &entry).map_err(|error| fail(&error))?;
        let mut entry = Some(SampleEntry::Av01(entry));
        let mut head = muxer.initial_boxes_bytes().to_vec();
        let mut position = head.len() as u64;
        for sample in &self.samples {
            let appended = muxer.append_sample(&Sample {
                track_kind: TrackKind::Video,
                sample_entry: entry.take(),
                keyframe: sample.is_key,
                timescale: self.ticks_per_second,
                duration: FRAME_TICKS,
                composition_time_offset: None,
                data_offset: position,
                data_size: sample.data.len(),
            });
            appended.map_err(|error| fail(&error))?;
            position += sample.data.len() as u64;
        }
        let mut tail = Vec::new();
        for (offset, bytes) in muxer.finalize().map_err(|e| fail(&e))?.offset_and_bytes_pairs() {
            let offset = offset as usize;
            match head.get_mut(offset..offset + bytes.len()) {
                Some(place) => place.copy_from_slice(bytes),
                // An index without room at the start follows the pictures.
                None => tail.extend_from_slice(bytes),
            }
        }
        Ok(Boxes { head, tail })
    }

    fn failure(&self, error: &dyn std::fmt::Display) -> ViewerError {
        ViewerError::Output {
            path: self.path.clone(),
            problem: format!("MP4: {error}"),
            mend: "write a .gif or .png instead",
        }
    }
}

/// The bytes before and after the pictures.
struct Boxes {
    head: Vec<u8>,
    tail: Vec<u8>,
}

/// Brightness, and two planes of colour at half the resolution (ITU-R BT.709, limited range).
fn planes(picture: &RgbImage) -> [Vec<u8>; 3] {
    let (width, height) = picture.dimensions();
    let byte = |value: f32| value.round().clamp(0.0, 255.0) as u8;
    let luma = |[r, g, b]: [f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let bright = picture.pixels().map(|pixel| {
        let value = luma(pixel.0.map(f32::from));
        byte(16.0 + value * (219.0 / 255.0))
    });
    let bright = bright.collect();
    let (columns, rows) = (width.div_ceil(2), height.div_ceil(2));
    let count = columns as usize * rows as usize;
    let (mut blue, mut red) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for row in 0..rows {
        for column in 0..columns {
            let mut mean = [0.0; 3];
            for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                // The last ones are counted twice where a side is odd.
                let x = (2 * column + x).min(width - 1);
                let y = (2 * row + y).min(height - 1);
                for (sum, value) in mean.iter_mut().zip(picture.get_pixel(x, y).0) {
                    *sum += 0.25 * f32::from(value);
                }
            }
            let grey = luma(mean);
            blue.push(byte(128.0 + (mean[2] - grey) / 1.8556 * (224.0 / 255.0)));
            red.push(byte(128.0 + (mean[0] - grey) / 1.5748 * (224.0 / 255.0)));
        }
    }
    [bright, blue, red]
}

#[cfg(test)]
mod tests {
    use super::*;
    use shiguredo_mp4::demux::{Input, Mp4FileDemuxer};

    #[test]
    fn planes_of_known_colours() {
        // BT.709: values of the standard's colour bars at full level.
        for (colour, expected) in [
            ([255, 255, 255], [235, 128, 128]),
            ([0, 0, 0], [16, 128, 128]),
            ([255, 0, 0], [63, 102, 240]),
            ([0, 0, 255], [32, 240, 118]),
        ] {
            let found = planes(&RgbImage::from_pixel(3, 3, image::Rgb(colour)));
            assert_eq!(found.each_ref().map(Vec::len), [9, 4, 4]);
            assert_eq!(found.map(|plane| plane[0]), expected, "{colour:?}");
        }
    }

    #[test]
    fn a_film_holds_its_pictures_at_their_times() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("clip.mp4");
        let mut movie = MovieWriter::new(&path, [18, 16], 12.5).unwrap();
        for shade in 0..61_u8 {
            movie.push(&RgbImage::from_pixel(18, 16, image::Rgb([3 * shade, 90, 20]))).unwrap();
        }
        movie.push(&RgbImage::new(36, 32)).unwrap();
        assert_eq!(movie.finish().unwrap(), path);
        let bytes = std::fs::read(&path).unwrap();
        let mut demuxer = Mp4FileDemuxer::new();
        demuxer.handle_input(Input { position: 0, data: &bytes });
        let tracks = demuxer.tracks().unwrap();
        assert_eq!(tracks.len(), 1);
        let mut samples = Vec::new();
        let mut size = None;
        while let Some(sample) = demuxer.next_sample().unwrap() {
            if let Some(SampleEntry::Av01(entry)) = sample.sample_entry {
                size = Some([entry.visual.width, entry.visual.height]);
            }
            let seconds = sample.timestamp as f64 / f64::from(sample.track.timescale.get());
            let start = sample.data_offset as usize;
            let units =
                parse_obus(&bytes[start..start + sample.data_size], Av1ObuParseContext::Sample)
                    .unwrap();
            assert!(units.iter().all(|unit| unit.obu_type != Av1ObuType::TemporalDelimiter));
            samples.push((seconds, sample.keyframe));
        }
        assert_eq!(size, Some([18, 16]));
        assert_eq!(samples.len(), 62);
        for (number, (seconds, is_key)) in samples.into_iter().enumerate() {
            assert!((seconds - number as f64 / 12.5).abs() < 1e-9, "{number}: {seconds}");
            assert_eq!(is_key, number % KEY_INTERVAL as usize == 0, "{number}");
        }
    }

    #[test]
    fn what_is_encoded_looks_like_the_picture() {
        let path = Path::new("clip.mp4");
        let picture = RgbImage::from_fn(64, 48, |x, y| {
            let on = (x / 8 + y / 8) % 2 == 0;
            image::Rgb(if on { [200, 60, 50] } else { [90, 120, 140] })
        });
        let mut movie = MovieWriter::new(path, [64, 48], 30.0).unwrap();
        let mut frame = movie.encoder.new_frame();
        let expected = planes(&picture);
        for (plane, samples) in frame.planes.iter_mut().zip(&expected) {
            let stride = plane.cfg.width;
            plane.copy_from_raw_u8(samples, stride, 1);
        }
        movie.encoder.send_frame(frame).unwrap();
        movie.encoder.flush();
        let packet = loop {
            match movie.encoder.receive_packet() {
                Ok(packet) => break packet,
                Err(EncoderStatus::Encoded) => {}
                Err(error) => panic!("{error}"),
            }
        };
        let seen = packet.rec.unwrap();
        for (plane, expected) in seen.planes.iter().zip(&expected) {
            let (mut error, mut count) = (0.0, 0.0);
            for (row, samples) in expected.chunks(plane.cfg.width).enumerate() {
                for (column, &sample) in samples.iter().enumerate() {
                    let found = plane.p(column, row);
                    error += (f64::from(found) - f64::from(sample)).powi(2);
                    count += 1.0;
                }
            }
            let error: f64 = error / count;
            assert!(error.sqrt() < 6.0, "{}", error.sqrt());
        }
    }

    #[test]
    fn sizes_that_the_format_has_not_are_refused() {
        let error = MovieWriter::new(Path::new("clip.mp4"), [8, 48], 30.0).err().unwrap();
        assert!(error.to_string().contains("16 to 65535"), "{error}");
    }

    #[test]
    fn a_film_without_pictures_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let movie = MovieWriter::new(&folder.path().join("clip.mp4"), [32, 32], 30.0).unwrap();
        assert!(movie.finish().is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
