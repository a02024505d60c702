//! Writes an animated PNG.

use image::RgbImage;
use png::{BitDepth, ColorType, Compression, Encoder};

use super::FrameError;
use super::animation::PictureAnimation;
use super::container::ContainerSource;
use super::output::output_write;

pub(super) fn write(source: &ContainerSource<'_>) -> Result<(), FrameError> {
    let style = &source.options.style;
    let pictures =
        PictureAnimation::of_store(source.topology, style, source.store, &source.frames)?;
    let frame_count = source.count_i32("frames", source.frames.len())?.unsigned_abs();
    let (numerator, denominator) = delay(source.rate);
    output_write(source.path, |writer| {
        let error = || FrameError::write(source.path);
        let mut encoder = Encoder::new(writer, style.width, style.height);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(Compression::Balanced);
        encoder.set_animated(frame_count, 0).map_err(error())?;
        encoder.set_frame_delay(numerator, denominator).map_err(error())?;
        let mut png = encoder.write_header().map_err(error())?;
        let take = |_, image: RgbImage| {
            png.write_image_data(&image).map_err(FrameError::write(source.path))
        };
        pictures.each(source, |image| image, take)?;
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
