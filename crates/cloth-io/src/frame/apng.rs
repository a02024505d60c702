//! Writes an animated PNG.

use std::path::Path;

use image::RgbImage;
use png::{BitDepth, ColorType, Compression, Encoder};

use super::FrameError;
use super::animation::PictureAnimation;
use super::container::ContainerSource;
use super::output::output_write;

pub(super) fn write(source: &ContainerSource<'_>) -> Result<(), FrameError> {
    let style = &source.options.style;
    let pictures = PictureAnimation::of_store(style, source.store, &source.frames)?;
    let count = source.frames.len();
    encode(source.path, [style.width, style.height], source.rate, count, |take| {
        pictures.each(source, |image| image, |_, images| images.iter().try_for_each(&mut *take))
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
    encode(path, size, rate, count, |take| {
        (0..count).try_for_each(|number| take(&picture(number)?))
    })
}

/// Writes the frames that `each` hands over in their order.
fn encode(
    path: &Path,
    [width, height]: [u32; 2],
    rate: f64,
    count: usize,
    each: impl FnOnce(&mut dyn FnMut(&RgbImage) -> Result<(), FrameError>) -> Result<(), FrameError>,
) -> Result<(), FrameError> {
    let frame_count = i32::try_from(count).map_err(|_| FrameError::Size {
        file: path.to_owned(),
        unit: "frames",
        needed: count as u64,
        limit: i32::MAX as u64,
    })?;
    let (numerator, denominator) = delay(rate);
    output_write(path, |writer| {
        let error = || FrameError::write(path);
        let mut encoder = Encoder::new(writer, width, height);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(Compression::Balanced);
        encoder.set_animated(frame_count.unsigned_abs(), 0).map_err(error())?;
        encoder.set_frame_delay(numerator, denominator).map_err(error())?;
        let mut png = encoder.write_header().map_err(error())?;
        each(&mut |image| png.write_image_data(image).map_err(FrameError::write(path)))?;
        png.finish().map_err(error())
    })
}

/// The time that a frame is shown as a fraction of seconds with parts that fit the format.
fn delay(rate: f64) -> (u16, u16) {
    let denominator: u16 = if rate >= 1.0 { 1000 } else { 10 };
    let numerator = (f64::from(denominator) / rate).round();
    // The conversion saturates: a frame is shown for at most 6553 s.
    ((numerator as u16).max(1), denominator)
}

#[cfg(test)]
mod tests {
    use super::delay;

    #[test]
    fn delay_is_the_inverse_of_the_rate() {
        assert_eq!(delay(25.0), (40, 1000));
        assert_eq!(delay(60.0), (17, 1000));
        assert_eq!(delay(0.1), (100, 10));
        assert_eq!(delay(1e9), (1, 1000));
    }
}
