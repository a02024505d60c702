//! Maps of depths seen from a light, which tell what is in its shadow.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::camera::View;
use super::geometry::{Mesh, Stage};
use super::scan::{self, ScanTriangle};

/// Texels of the map of the strong light along its side for each pixel along the longer side of the
/// picture: shadows as sharp as the picture can show.
const KEY_SIZE_PER_PIXEL: f32 = 1.3;
/// Least and greatest side of the map of the strong light \[texel\].
const KEY_SIZE_RANGE: [f32; 2] = [512.0, 2048.0];
/// Rows that one task fills.
const BAND: usize = 256;
/// Texels of nothing around a map, as many as softening can reach.
const MARGIN: usize = 4;
/// Texels along the side of a block.
const BLOCK: usize = 16;

/// Depths seen from a far light.
#[derive(Clone)]
pub(super) struct ShadowMap {
    /// Unit vector towards the light.
    pub(super) direction: Vec3,
    right: Vec3,
    up: Vec3,
    center: Vec3,
    radius: f32,
    /// Texels along the side of the square that everything casts into.
    size: usize,
    /// How near the light what casts a shadow is, by rows; [`MARGIN`] texels of nothing lie around
    /// the square, so that softening needs not ask where it ends.
    nearness: Vec<f32>,
    /// The greatest nearness in blocks of [`BLOCK`] x [`BLOCK`] texels, by rows, margin included.
    blocks: Vec<f32>,
}

/// Unit vector towards the strong light, which comes over the left shoulder of the viewer.
pub(super) fn key_direction(view: &View) -> Vec3 {
    let level = Vec3::new(view.backward.x, view.backward.y, 0.0).normalize_or(Vec3::NEG_Y);
    (Vec3::Z * 1.25 + level * 0.62 - view.right * 0.75).normalize()
}

/// Side of the map of the strong light \[texel\].
pub(super) fn key_size(view: &View) -> usize {
    let [least, greatest] = KEY_SIZE_RANGE;
    (KEY_SIZE_PER_PIXEL * view.width.max(view.height) as f32).clamp(least, greatest) as usize
}

impl ShadowMap {
    /// The empty map of a light in `direction`, a unit vector, of `size` \[texel\].
    pub(super) fn new(stage: &Stage, direction: Vec3, size: usize) -> Self {
        let (right, up) = direction.any_orthonormal_pair();
        let radius = 1.02 * stage.radius;
        let stride = size + 2 * MARGIN;
        let nearness = vec![f32::NEG_INFINITY; stride * stride];
        let blocks = vec![f32::NEG_INFINITY; stride.div_ceil(BLOCK) * stride.div_ceil(BLOCK)];
        let center = stage.center;
        Self { direction, right, up, center, radius, size, nearness, blocks }
    }

    /// Texels in a row, margin included.
    fn stride(&self) -> usize {
        self.size + 2 * MARGIN
    }

    /// Enters everything in `mesh`, which must be inside the stage of the map.
    pub(super) fn cast(&mut self, mesh: &Mesh) {
        let vertices: Vec<Vec3> = mesh.positions.iter().map(|&p| self.texel(p)).collect();
        let stride = self.stride();
        let columns = MARGIN..MARGIN + self.size;
        self.nearness.par_chunks_mut(BAND * stride).enumerate().for_each(|(band, nearness)| {
            let top = band * BAND;
            let bottom = top + nearness.len() / stride;
            for corners in &mesh.triangles {
                let corners = corners.map(|index| vertices[index as usize]);
                // Most triangles of a fine cloth lie between the samples of a small map, or around one.
                let [rows, across] = scan::bounds(corners);
                if rows[0].max(top) >= rows[1].min(bottom) || across[0] >= across[1] {
                    continue;
                }
                if rows[1] - rows[0] == 1 && across[1] - across[0] == 1 {
                    let place = (rows[0] - top) * stride + across[0];
                    if columns.contains(&across[0])
                        && let Some(near) = scan::single(corners, rows[0], across[0])
                        && let Some(nearest) = nearness.get_mut(place)
                    {
                        *nearest = nearest.max(near);
                    }
                    continue;
                }
                let Some(triangle) = ScanTriangle::new(corners) else { continue };
                triangle.spans(top, bottom, |row, start, end, span| {
                    let base = (row - top) * stride;
                    let (start, end) = (start.max(columns.start), end.min(columns.end));
                    let Some(texels) = nearness.get_mut(base + start..base + end) else { return };
                    for (column, nearest) in (start..).zip(texels) {
                        *nearest = nearest.max(span.at(column));
                    }
                });
            }
        });
        let rows = self.nearness.chunks(BLOCK * stride);
        let blocks = self.blocks.chunks_mut(stride.div_ceil(BLOCK));
        for (rows, blocks) in rows.zip(blocks) {
            for row in rows.chunks(stride) {
                for (block, texels) in blocks.iter_mut().zip(row.chunks(BLOCK)) {
                    *block = texels.iter().fold(*block, |greatest, &texel| greatest.max(texel));
                }
            }
        }
    }

    /// Column and row \[texel\], margin included, and towards the light.
    #[inline]
    fn texel(&self, point: Vec3) -> Vec3 {
        let local = (point - self.center) / self.radius;
        let (half, margin) = (0.5 * self.size as f32, MARGIN as f32);
        Vec3::new(
            half + half * local.dot(self.right) + margin,
            half - half * local.dot(self.up) + margin,
            local.dot(self.direction),
        )
    }

    /// How much of the light reaches `point`, from 0 to 1, softened over a square of `TAPS` x `TAPS`
    /// texels; `TAPS` is even.
    #[inline]
    pub(super) fn lit<const TAPS: usize>(&self, point: Vec3, normal: Vec3) -> f32 {
        const { assert!(TAPS.is_multiple_of(2) && TAPS <= MARGIN) };
        let reach = TAPS / 2;
        let texel = 2.0 / self.size as f32;
        // A surface must not shadow itself: step out of it by what the softening spans.
        let step = texel * self.radius * (1 + reach) as f32;
        let place = self.texel(point + step * normal);
        let limit = place.z + 0.5 * texel;
        // The first of the texels.
        let first = Vec2::new(place.x, place.y) - (reach as f32 - 0.5);
        let stride = self.stride();
        let end = (stride - TAPS) as f32;
        if !(first.min_element() >= 0.0 && first.max_element() < end) {
            // Nothing casts a shadow there.
            return 1.0;
        }
        let [column, row] = [first.x as u32 as usize, first.y as u32 as usize];
        if self.is_open::<TAPS>(column, row, limit) {
            return 1.0;
        }
        let part = first - Vec2::new(column as f32, row as f32);
        let mut sum = 0.0;
        for y in 0..TAPS {
            let start = (row + y) * stride + column;
            let Some(texels) = self.nearness.get(start..start + TAPS) else { return 1.0 };
            let mut row_sum = 0.0;
            for (x, &nearness) in texels.iter().enumerate() {
                let lit = if nearness <= limit { 1.0 } else { 0.0 };
                row_sum += weight::<TAPS>(x, part.x) * lit;
            }
            sum += weight::<TAPS>(y, part.y) * row_sum;
        }
        // The weights of a row add up to this, wherever the point lies between the texels.
        let total = (TAPS - 1) as f32;
        sum / (total * total)
    }

    /// Whether everything is farther from the light than `limit` in the blocks of the texels from
    /// `column` and `row` on, as it is for most of a floor.
    #[inline]
    fn is_open<const TAPS: usize>(&self, column: usize, row: usize, limit: f32) -> bool {
        let blocks = self.stride().div_ceil(BLOCK);
        let (left, right) = (column / BLOCK, (column + TAPS - 1) / BLOCK);
        let (top, bottom) = (row / BLOCK, (row + TAPS - 1) / BLOCK);
        let is_far = |x: usize, y: usize| {
            self.blocks.get(y * blocks + x).is_none_or(|&nearness| nearness <= limit)
        };
        is_far(left, top) && is_far(right, top) && is_far(left, bottom) && is_far(right, bottom)
    }
}

/// The weight of a texel along one axis: inner ones weigh fully, the outermost by how far the
/// softening reaches into them, `part` of which is behind the first one.
#[inline]
fn weight<const TAPS: usize>(index: usize, part: f32) -> f32 {
    if index == 0 {
        1.0 - part
    } else if index == TAPS - 1 {
        part
    } else {
        1.0
    }
}
