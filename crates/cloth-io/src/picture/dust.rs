//! Dust in the air of a picture: streaks that veil what is behind them.

use std::fmt;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::camera::View;
use super::floor::Floor;
use super::geometry::linear;
use super::raster::{BAND, Band, SAMPLES};

/// Radius of a grain where the camera looks at, in heights of the picture.
const RADIUS: f32 = 0.0016;
/// How much larger or smaller grains that are nearer or farther can look.
const SCALE_RANGE: [f32; 2] = [0.5, 2.5];

/// A grain that the air carries, as a camera sees it: a streak from where it was to where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureGrain {
    /// Where it was when the shutter opened \[m\].
    pub from: [f64; 3],
    /// Where it is \[m\].
    pub to: [f64; 3],
    /// How much of what is behind it it hides, from 0 to 1.
    pub opacity: f64,
}

/// The dust of a scene over time.
#[derive(Clone)]
pub struct PictureDust(Arc<dyn Fn(f64) -> Vec<PictureGrain> + Send + Sync>);

impl PictureDust {
    /// Its colour in sunlight, as sRGB.
    pub const COLOUR: [u8; 3] = [139, 110, 78];

    /// Dust as a function of time \[s\].
    #[must_use]
    pub fn moving(grains: impl Fn(f64) -> Vec<PictureGrain> + Send + Sync + 'static) -> Self {
        Self(Arc::new(grains))
    }

    /// The grains at `time` \[s\].
    #[must_use]
    pub fn at(&self, time: f64) -> Vec<PictureGrain> {
        (self.0)(time)
    }
}

impl Default for PictureDust {
    /// Clear air.
    fn default() -> Self {
        Self::moving(|_| Vec::new())
    }
}

impl fmt::Debug for PictureDust {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("PictureDust").finish_non_exhaustive()
    }
}

/// All streaks on the screen, by the bands that they cover.
pub(super) struct Dust {
    streaks: Vec<Streak>,
    bands: Vec<Vec<u32>>,
    /// Colour in linear light, ready for a screen.
    pub(super) color: Vec3,
}

/// A streak on the screen.
struct Streak {
    /// Column, row \[pixel\] and nearness of the ends.
    ends: [Vec3; 2],
    /// Half of its width \[pixel\].
    radius: f32,
    opacity: f32,
    /// First row that it can cover and the one after the last \[pixel\].
    rows: [usize; 2],
}

impl Streak {
    /// The streak that `view` sees of a grain, unless that is behind the eye or nowhere.
    fn new(grain: &PictureGrain, view: &View) -> Option<Self> {
        let [width, height] = [view.width, view.height].map(|side| side as f32);
        let end = |place: [f64; 3]| {
            let clip = view.clip(view.local(place));
            let nearness = clip.w.recip();
            let x = (0.5 + 0.5 * clip.x * nearness) * width;
            let y = (0.5 - 0.5 * clip.y * nearness) * height;
            let end = Vec3::new(x, y, nearness);
            (clip.z > -clip.w && end.is_finite()).then_some(end)
        };
        let ends = [end(grain.from)?, end(grain.to)?];
        let scale = (0.5 * (ends[0].z + ends[1].z) * view.eye.length())
            .clamp(SCALE_RANGE[0], SCALE_RANGE[1]);
        let radius = (RADIUS * height * scale).max(0.5);
        let opacity = grain.opacity.clamp(0.0, 1.0) as f32;
        let rows = reach(ends.map(|end| end.y), radius);
        Some(Self { ends, radius, opacity, rows })
    }

    /// First column that it can cover and the one after the last \[pixel\].
    fn columns(&self) -> [usize; 2] {
        reach(self.ends.map(|end| end.x), self.radius)
    }

    /// How much of a pixel it covers, from 0 to 1, and how near it is there.
    fn cover(&self, place: Vec2) -> (f32, f32) {
        let [a, b] = self.ends;
        let along = b - a;
        let flat = along.truncate();
        let part = (place - a.truncate()).dot(flat) / flat.length_squared().max(1e-12);
        let nearest = a + part.clamp(0.0, 1.0) * along;
        let distance = place.distance(nearest.truncate());
        ((self.radius + 0.5 - distance).clamp(0.0, 1.0), nearest.z)
    }
}

/// First pixel that something between `ends` can cover and the one after the last.
fn reach([a, b]: [f32; 2], radius: f32) -> [usize; 2] {
    let reach = radius + 1.0;
    // The conversion saturates.
    [(a.min(b) - reach).max(0.0) as usize, (a.max(b) + reach + 1.0).max(0.0) as usize]
}

impl Dust {
    pub(super) fn new(grains: &[PictureGrain], view: &View) -> Self {
        let streaks: Vec<Streak> = grains.iter().filter_map(|g| Streak::new(g, view)).collect();
        let mut bands = vec![Vec::new(); (view.height as usize).div_ceil(BAND)];
        for (index, streak) in streaks.iter().enumerate() {
            let [first, end] = streak.rows;
            for band in bands.iter_mut().take(end.div_ceil(BAND)).skip(first / BAND) {
                band.push(index as u32);
            }
        }
        Self { streaks, bands, color: linear(PictureDust::COLOUR) }
    }

    /// Fills `clear` with how much of each pixel of a row is seen through the dust, from 0 to 1, or with
    /// nothing where there is no dust: row `row_in_band` of `samples`, which is band number `band`.
    pub(super) fn veil(
        &self,
        clear: &mut Vec<f32>,
        samples: &Band,
        [band, row_in_band]: [usize; 2],
        floor: &Floor,
        view: &View,
    ) {
        clear.clear();
        let Some(streaks) = self.bands.get(band).filter(|streaks| !streaks.is_empty()) else {
            return;
        };
        let (width, row) = (view.width as usize, band * BAND + row_in_band);
        clear.resize(width, 1.0);
        for &index in streaks {
            let streak = &self.streaks[index as usize];
            if !(streak.rows[0]..streak.rows[1]).contains(&row) {
                continue;
            }
            let [left, right] = streak.columns();
            for (column, clear) in clear.iter_mut().enumerate().take(right).skip(left) {
                let (cover, nearness) = streak.cover(Vec2::new(column as f32, row as f32) + 0.5);
                if cover > 0.0 {
                    let samples = samples.pixel(column, [band, row_in_band], floor, view);
                    let behind = samples.iter().filter(|sample| sample.1 < nearness).count();
                    let part = behind as f32 / (SAMPLES * SAMPLES) as f32;
                    *clear *= 1.0 - streak.opacity * cover * part;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Camera, Picture, PictureCloth, PictureScene, PictureStyle};
    use super::*;

    const CAMERA: Camera = Camera {
        eye: [0.0, -4.0, 0.0],
        target: [0.0; 3],
        up: [0.0, 0.0, 1.0],
        vertical_field_of_view: 0.5,
    };

    /// A picture of a curtain at y = 0 over its left half, with these grains.
    fn render(dust: &[PictureGrain]) -> image::RgbImage {
        let positions = [[-3.0, 0.0, -3.0], [0.0, 0.0, -3.0], [0.0, 0.0, 3.0], [-3.0, 0.0, 3.0]];
        let scene = PictureScene {
            positions: &positions,
            triangles: &[[0, 1, 2], [0, 2, 3]],
            texture: None,
            cloths: vec![PictureCloth { triangles: 0..2, color: [200, 30, 30] }],
            shapes: &[],
            dust,
            overlays: None,
        };
        let style = PictureStyle { width: 60, height: 40, ..PictureStyle::default() };
        Picture::render(&scene, &CAMERA, &style).unwrap()
    }

    fn streak(y: f64, opacity: f64) -> PictureGrain {
        PictureGrain { from: [-0.5, y, 0.0], to: [0.5, y, 0.0], opacity }
    }

    #[test]
    fn dust_is_seen_before_the_cloth_and_not_behind_it() {
        let clear = render(&[]);
        let changed = |dust: &[PictureGrain]| {
            let picture = render(dust);
            let pixels = clear.enumerate_pixels().zip(picture.pixels());
            let changed = pixels.filter(|((.., a), b)| a != b).map(|((x, y, _), _)| [x, y]);
            changed.collect::<Vec<_>>()
        };
        let before = changed(&[streak(-1.0, 0.8)]);
        assert!(before.iter().any(|[x, _]| *x < 29) && before.iter().any(|[x, _]| *x > 31));
        assert!(before.iter().all(|[_, y]| (18..22).contains(y)), "{before:?}");
        let behind = changed(&[streak(1.0, 0.8)]);
        assert!(behind.iter().all(|[x, _]| *x >= 29) && !behind.is_empty(), "{behind:?}");
        for nowhere in [streak(-1.0, 0.0), streak(-5.0, 0.8), streak(f64::NAN, 0.8)] {
            assert_eq!(changed(&[nowhere]), [[0; 2]; 0]);
        }
    }

    #[test]
    fn the_order_of_grains_is_not_seen() {
        let grains = [streak(-1.0, 0.3), streak(-2.0, 0.6), streak(1.0, 0.5)];
        let reversed: Vec<_> = grains.iter().rev().copied().collect();
        assert_eq!(render(&grains), render(&reversed));
    }
}
