//! Writes an animated GIF: one palette for all frames, ordered dither, and only the pixels that
//! change. A fixed palette and a fixed dither pattern keep still parts of the picture still, which
//! the eye prefers and the compression too.

use std::{borrow::Cow, path::Path};

use ::gif::{DisposalMethod, Encoder, Frame, Repeat};
use color_quant::NeuQuant;
use image::RgbImage;
use rayon::prelude::*;

use super::FrameError;
use super::animation::{PictureAnimation, batch_limit};
use super::container::ContainerSource;
use super::output::output_write;

/// Number of the palette entry for pixels that stay as they were.
const UNCHANGED: u8 = 255;
/// Frames that the palette is made from.
const PALETTE_FRAMES: usize = 6;

/// The least stride whose frames are shown for at least 1/50 s: browsers slow down faster ones.
pub(super) fn automatic_stride(frames_per_second: f64) -> usize {
    (frames_per_second / 50.0).ceil().max(1.0) as usize
}

pub(super) fn write(source: &ContainerSource<'_>) -> Result<(), FrameError> {
    let style = &source.options.style;
    let pictures = PictureAnimation::of_store(style, source.store, &source.frames)?;
    let step = palette_step(source.frames.len());
    let samples = source.frames.iter().step_by(step);
    let palette = Palette::of(samples.map(|&index| pictures.stored(source, index)))?;
    encode(source.path, [style.width, style.height], source.rate, &palette, |take| {
        pictures.each(source, |image| palette.indices(&image), take)
    })
}

/// Writes pictures that were made before; each is asked for by its number.
pub(super) fn write_pictures(
    path: &Path,
    size: [u32; 2],
    rate: f64,
    count: usize,
    picture: impl Fn(usize) -> Result<RgbImage, FrameError>,
) -> Result<(), FrameError> {
    let palette = Palette::of((0..count).step_by(palette_step(count)).map(&picture))?;
    encode(path, size, rate, &palette, |take| {
        let numbers: Vec<usize> = (0..count).collect();
        numbers.chunks(batch_limit(size)).try_for_each(|batch| {
            let indices = |&number: &usize| Ok(palette.indices(&picture(number)?));
            let frames: Result<_, FrameError> = batch.iter().map(indices).collect();
            take(batch[0], frames?)
        })
    })
}

/// Takes the palette entries of the pixels of frames that follow each other, and the number of the
/// first one.
type FramesTaker<'a> = &'a mut dyn FnMut(usize, Vec<Vec<u8>>) -> Result<(), FrameError>;

/// Writes the frames that `each` hands over in their order.
fn encode(
    path: &Path,
    size: [u32; 2],
    rate: f64,
    palette: &Palette,
    each: impl FnOnce(FramesTaker<'_>) -> Result<(), FrameError>,
) -> Result<(), FrameError> {
    let side = |side: u32| {
        u16::try_from(side).map_err(|_| FrameError::Size {
            file: path.to_owned(),
            unit: "pixels in a row or column",
            needed: side.into(),
            limit: u16::MAX.into(),
        })
    };
    let (width, height) = (side(size[0])?, side(size[1])?);
    output_write(path, |writer| {
        let error = || FrameError::write(path);
        let mut encoder = Encoder::new(writer, width, height, &palette.colors).map_err(error())?;
        encoder.set_repeat(Repeat::Infinite).map_err(error())?;
        let mut shown: Option<Vec<u8>> = None;
        let mut take = |start: usize, mut batch: Vec<Vec<u8>>| {
            // A frame needs only the one before it: a batch is compressed by all threads.
            let frames = (0..batch.len()).into_par_iter().map(|position| {
                let before = match position.checked_sub(1) {
                    Some(before) => Some(batch[before].as_slice()),
                    None => shown.as_deref(),
                };
                let mut frame = Frame {
                    delay: delay(start + position, rate),
                    ..difference(before, &batch[position], width, height)
                };
                frame.make_lzw_pre_encoded();
                frame
            });
            let frames: Vec<Frame<'static>> = frames.collect();
            for frame in &frames {
                encoder.write_lzw_pre_encoded_frame(frame).map_err(error())?;
            }
            shown = batch.pop().or_else(|| shown.take());
            Ok(())
        };
        each(&mut take)
    })
}

/// Every so many frames the palette is made from one.
fn palette_step(count: usize) -> usize {
    count.div_ceil(PALETTE_FRAMES).max(1)
}

/// How long frame `number` is shown \[1/100 s\], rounded so that errors do not add up.
fn delay(number: usize, rate: f64) -> u16 {
    let hundredths = |number: usize| (number as f64 * 100.0 / rate).round();
    (hundredths(number + 1) - hundredths(number)) as u16
}

/// The part of the picture that differs from what is `shown`.
fn difference(shown: Option<&[u8]>, indices: &[u8], width: u16, height: u16) -> Frame<'static> {
    let frame = Frame { dispose: DisposalMethod::Keep, ..Frame::default() };
    let Some(shown) = shown else {
        return Frame { width, height, buffer: Cow::Owned(indices.to_vec()), ..frame };
    };
    let columns = usize::from(width);
    let (mut left, mut right, mut top, mut bottom) = (columns, 0, usize::from(height), 0);
    for (row, (old, new)) in shown.chunks(columns).zip(indices.chunks(columns)).enumerate() {
        let changed = |(old, new): (&u8, &u8)| old != new;
        if let Some(first) = old.iter().zip(new).position(changed) {
            let last = old.iter().zip(new).rposition(changed).unwrap_or(first);
            left = left.min(first);
            right = right.max(last + 1);
            top = top.min(row);
            bottom = row + 1;
        }
    }
    if bottom == 0 {
        // Nothing changed, but the format wants at least one pixel.
        (left, right, top, bottom) = (0, 1, 0, 1);
    }
    let mut buffer = Vec::with_capacity((right - left) * (bottom - top));
    for row in top..bottom {
        let range = row * columns + left..row * columns + right;
        let pixels = shown[range.clone()].iter().zip(&indices[range]);
        buffer.extend(pixels.map(|(old, new)| if old == new { UNCHANGED } else { *new }));
    }
    Frame {
        left: left as u16,
        top: top as u16,
        width: (right - left) as u16,
        height: (bottom - top) as u16,
        transparent: Some(UNCHANGED),
        buffer: Cow::Owned(buffer),
        ..frame
    }
}

/// The palette of a whole animation with a table from coarse colours to palette entries.
struct Palette {
    colors: Vec<u8>,
    /// Palette entry of each colour of 6 bits per channel.
    table: Vec<u8>,
    /// The pattern of [`dither`].
    dither: [[i8; 8]; 8],
}

impl Palette {
    fn of(samples: impl Iterator<Item = Result<RgbImage, FrameError>>) -> Result<Self, FrameError> {
        let mut pixels = Vec::new();
        for image in samples {
            pixels.extend(image?.pixels().step_by(3).flat_map(|p| [p[0], p[1], p[2], 255]));
        }
        let network = NeuQuant::new(3, usize::from(UNCHANGED), &pixels);
        let mut colors = network.color_map_rgb();
        colors.resize(3 * 256, 0);
        let table = (0..1usize << 18)
            .into_par_iter()
            .map(|cell| {
                let channel = |shift: usize| ((cell >> shift) & 63) as u8 * 4 + 2;
                network.index_of(&[channel(12), channel(6), channel(0), 255]) as u8
            })
            .collect();
        let dither = std::array::from_fn(|row| std::array::from_fn(|column| dither(column, row)));
        Ok(Self { colors, table, dither })
    }

    fn indices(&self, image: &RgbImage) -> Vec<u8> {
        let columns = image.width() as usize;
        let mut indices = vec![0; columns * image.height() as usize];
        let rows = indices.chunks_exact_mut(columns).zip(image.as_raw().chunks_exact(3 * columns));
        for ((indices, pixels), offsets) in rows.zip(self.dither.iter().cycle()) {
            let pixels = indices.iter_mut().zip(pixels.chunks_exact(3)).enumerate();
            for (column, (index, pixel)) in pixels {
                let offset = offsets[column % 8];
                let channel =
                    |slot: usize| usize::from(pixel[slot].saturating_add_signed(offset) >> 2);
                *index = self.table[channel(0) << 12 | channel(1) << 6 | channel(2)];
            }
        }
        indices
    }
}

/// Ordered dither of an 8 × 8 pattern, -3 to 3 steps of a colour channel.
fn dither(column: usize, row: usize) -> i8 {
    let (mut rank, mut x, mut y) = (0i32, column, row);
    for _ in 0..3 {
        rank = rank * 4 + ((x ^ y) & 1) as i32 * 2 + (y & 1) as i32;
        x >>= 1;
        y >>= 1;
    }
    (rank * 7 / 64 - 3) as i8
}

#[cfg(test)]
mod tests {
    use super::{UNCHANGED, automatic_stride, delay, difference, dither};

    #[test]
    fn delays_add_up_to_the_duration() {
        let total: u32 = (0..300).map(|number| u32::from(delay(number, 30.0))).sum();
        assert_eq!(total, 1000);
        assert!((0..300).all(|number| [3, 4].contains(&delay(number, 30.0))));
    }

    #[test]
    fn the_dither_is_balanced() {
        let offsets: Vec<i8> = (0..64).map(|index| dither(index % 8, index / 8)).collect();
        assert_eq!((offsets.iter().min(), offsets.iter().max()), (Some(&-3), Some(&3)));
        let sum: i32 = offsets.iter().map(|&offset| i32::from(offset)).sum();
        assert!(sum.abs() <= 3, "{sum}");
    }

    #[test]
    fn fast_runs_are_thinned() {
        assert_eq!(automatic_stride(24.0), 1);
        assert_eq!(automatic_stride(60.0), 2);
        assert_eq!(automatic_stride(240.0), 5);
    }

    #[test]
    fn only_changed_pixels_are_written() {
        let shown = [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1];
        let next = [1, 1, 1, 1, 1, 2, 1, 1, 1, 1, 3, 1];
        let frame = difference(Some(&shown), &next, 4, 3);
        assert_eq!((frame.left, frame.top, frame.width, frame.height), (1, 1, 2, 2));
        assert_eq!(*frame.buffer, [2, UNCHANGED, UNCHANGED, 3]);
        let frame = difference(Some(&shown), &shown, 4, 3);
        assert_eq!(*frame.buffer, [UNCHANGED]);
    }
}
