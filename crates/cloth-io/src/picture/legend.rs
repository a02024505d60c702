//! What the colours and lines of a picture mean, in its lower left corner.

use cloth_core::StrainMeasure;
use glam::Vec3;
use image::{Rgb, RgbImage};

use super::ThreadDirection;
use super::strain::heat;

/// Width and height of letters \[dot\], and what lies between them.
const LETTER: [u32; 2] = [5, 7];
const GAP: u32 = 1;
/// Length of the bar of colours and of samples of threads \[dot\].
const BAR: u32 = 60;
const SAMPLE: u32 = 14;
/// Space around everything, and between rows \[dot\].
const MARGIN: u32 = 4;
/// Height of the picture for each pixel that a dot is wide.
const HEIGHT_OF_DOT: u32 = 360;
/// Share of the picture that shines through, and the colour of the plate.
const CLEAR: f32 = 0.35;
const PLATE: [f32; 3] = [24.0, 26.0, 30.0];
const INK: [u8; 3] = [240, 240, 240];

/// What a legend explains; by default nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PictureLegend {
    /// Which strain a heat map shows, if there is one, and how much of it is red.
    pub strain: Option<(StrainMeasure, f64)>,
    /// Whether there are threads.
    pub threads: bool,
}

impl PictureLegend {
    /// Draws it into the lower left corner of a picture; nothing where there is no room.
    pub fn draw(&self, image: &mut RgbImage) {
        let rows = u32::from(self.strain.is_some()) + u32::from(self.threads);
        let dot = (image.height() / HEIGHT_OF_DOT).max(1);
        let text = self.strain.map(caption).unwrap_or_default();
        let bar_row = text_width("0") + BAR + text_width(&text) + 4;
        let width = (bar_row.max(2 * (SAMPLE + text_width("warp")) + 14) + 2 * MARGIN) * dot;
        let height = (rows * (LETTER[1] + MARGIN) + MARGIN) * dot;
        let [left, bottom] = [2 * MARGIN * dot, image.height().saturating_sub(2 * MARGIN * dot)];
        // At most a quarter of the picture, or it would hide what it explains.
        if rows == 0 || 2 * (left + width) > image.width() || 2 * height > bottom {
            return;
        }
        let mut pen = Pen { image, dot, origin: [left, bottom - height] };
        pen.plate(width, height);
        if self.strain.is_some() {
            pen.strain(MARGIN, &text);
        }
        if self.threads {
            pen.threads((rows - 1) * (LETTER[1] + MARGIN) + MARGIN);
        }
    }
}

/// The number that is red, and of what if that is not stretch.
fn caption((measure, scale): (StrainMeasure, f64)) -> String {
    match measure {
        StrainMeasure::Stretch => percent(scale),
        component => format!("{} {}", percent(scale), component.name()),
    }
}

/// A share in percent, as short as it can be said.
fn percent(share: f64) -> String {
    let rounded = (share * 1e4).round() / 1e2;
    if rounded == 0.0 { format!("{:.0e}%", 100.0 * share) } else { format!("{rounded}%") }
}

/// Width of `text` \[dot\].
fn text_width(text: &str) -> u32 {
    text.chars().count() as u32 * (LETTER[0] + GAP)
}

/// A colour from linear light to sRGB.
fn encoded(linear: Vec3) -> [u8; 3] {
    linear.to_array().map(|light| {
        let value = if light <= 0.003_130_8 {
            12.92 * light
        } else {
            1.055 * light.powf(1.0 / 2.4) - 0.055
        };
        (255.0 * value).round() as u8
    })
}

/// Draws in dots from the corner of the plate.
struct Pen<'a> {
    image: &'a mut RgbImage,
    /// Side of a dot \[pixel\].
    dot: u32,
    /// Corner of the plate \[pixel\].
    origin: [u32; 2],
}

impl Pen<'_> {
    /// Darkens the picture below the legend; sides in pixels.
    fn plate(&mut self, width: u32, height: u32) {
        let [left, top] = self.origin;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (left + x, top + y))) {
            let Rgb(pixel) = self.image.get_pixel_mut(x, y);
            for (channel, plate) in pixel.iter_mut().zip(PLATE) {
                *channel = (CLEAR * f32::from(*channel) + (1.0 - CLEAR) * plate) as u8;
            }
        }
    }

    /// The bar of colours, from 0 to the number that is red.
    fn strain(&mut self, row: u32, text: &str) {
        let mut column = MARGIN + self.text([MARGIN, row], "0") + 2;
        for step in 0..BAR {
            let color = encoded(heat((step as f32 + 0.5) / BAR as f32));
            self.fill([column + step, row], [1, LETTER[1]], color);
        }
        column += BAR + 2;
        self.text([column, row], text);
    }

    /// A piece of both threads with their names.
    fn threads(&mut self, row: u32) {
        let mut column = MARGIN;
        for (direction, name) in ThreadDirection::ALL.into_iter().zip(["warp", "weft"]) {
            // On grey, as the dark one would not be seen on the plate.
            self.fill([column, row], [SAMPLE, LETTER[1]], [128; 3]);
            self.fill([column, row + 3], [SAMPLE, 2], direction.colour());
            column += SAMPLE + 3;
            column += self.text([column, row], name) + 8;
        }
    }

    fn fill(&mut self, [column, row]: [u32; 2], [width, height]: [u32; 2], color: [u8; 3]) {
        let [left, top] = [self.origin[0] + column * self.dot, self.origin[1] + row * self.dot];
        for y in top..top + height * self.dot {
            for x in left..left + width * self.dot {
                self.image.put_pixel(x, y, Rgb(color));
            }
        }
    }

    /// Writes `text`; its width \[dot\].
    fn text(&mut self, [column, row]: [u32; 2], text: &str) -> u32 {
        for (number, letter) in (0..).zip(text.chars()) {
            let start = column + number * (LETTER[0] + GAP);
            for (line, bits) in (0..).zip(letter_rows(letter)) {
                for dot in (0..LETTER[0]).filter(|dot| bits >> (LETTER[0] - 1 - dot) & 1 == 1) {
                    self.fill([start + dot, row + line], [1, 1], INK);
                }
            }
        }
        text_width(text)
    }
}

/// The rows of a letter, from the top, its left dot as the highest bit.
const fn letter_rows(letter: char) -> [u8; 7] {
    match letter {
        '0' => [0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110],
        '1' => [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110],
        '2' => [0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111],
        '3' => [0b11110, 0b00001, 0b00001, 0b01110, 0b00001, 0b00001, 0b11110],
        '4' => [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010],
        '5' => [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110],
        '6' => [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110],
        '7' => [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000],
        '8' => [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110],
        '9' => [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100],
        '.' => [0, 0, 0, 0, 0, 0b01100, 0b01100],
        '-' => [0, 0, 0, 0b11111, 0, 0, 0],
        '%' => [0b11000, 0b11001, 0b00010, 0b00100, 0b01000, 0b10011, 0b00011],
        'E' => [0b11111, 0b10000, 0b10000, 0b11110, 0b10000, 0b10000, 0b11111],
        'a' => [0, 0, 0b01110, 0b00001, 0b01111, 0b10001, 0b01111],
        'e' => [0, 0, 0b01110, 0b10001, 0b11111, 0b10000, 0b01110],
        'f' => [0b00110, 0b01000, 0b11110, 0b01000, 0b01000, 0b01000, 0b01000],
        'p' => [0, 0, 0b11110, 0b10001, 0b11110, 0b10000, 0b10000],
        'r' => [0, 0, 0b10110, 0b11001, 0b10000, 0b10000, 0b10000],
        't' => [0b01000, 0b01000, 0b11110, 0b01000, 0b01000, 0b01001, 0b00110],
        'w' => [0, 0, 0b10001, 0b10001, 0b10101, 0b10101, 0b01010],
        _ => [0; 7],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn legend(strain: bool, threads: bool) -> PictureLegend {
        PictureLegend { strain: strain.then_some((StrainMeasure::Warp, 0.1)), threads }
    }

    /// Pixels that a legend changes in a grey picture.
    fn changed(size: [u32; 2], legend: PictureLegend) -> Vec<[u32; 2]> {
        let mut image = RgbImage::from_pixel(size[0], size[1], Rgb([150; 3]));
        legend.draw(&mut image);
        let pixels = image.enumerate_pixels().filter(|(.., pixel)| pixel.0 != [150; 3]);
        pixels.map(|(x, y, _)| [x, y]).collect()
    }

    #[test]
    fn it_takes_a_corner_and_no_more() {
        for size in [[800, 450], [1920, 1080], [320, 180]] {
            let both = changed(size, legend(true, true));
            assert!(both.len() > 1000, "{size:?}");
            assert!(both.iter().all(|[x, y]| 2 * x < size[0] && 2 * y >= size[1]), "{size:?}");
            assert!(changed(size, legend(true, false)).len() < both.len());
        }
        assert_eq!(changed([800, 450], legend(false, false)).len(), 0);
        assert_eq!(changed([64, 36], legend(true, true)).len(), 0, "there is no room");
    }

    #[test]
    fn it_says_the_number_that_is_red() {
        assert_eq!([0.1, 0.025, 1e-4, 2.0].map(percent), ["10%", "2.5%", "0.01%", "200%"]);
        assert_eq!(percent(1e-7), "1e-5%");
        assert_eq!(caption((StrainMeasure::Shear, 0.1)), "10% E12");
        for letter in "0123456789.-%Ewarpweft".chars() {
            assert_ne!(letter_rows(letter), [0; 7], "{letter}");
        }
    }
}
