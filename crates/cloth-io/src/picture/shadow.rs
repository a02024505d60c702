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
pub(super) struct ShadowMap {
    /// Unit vector towards the light.
    pub(super) direction: Vec3,
    /// What a metre along each axis of the scene adds to column, row and nearness.
    steps: [Vec3; 3],
    /// Column, row and nearness of the origin.
    origin: Vec3,
    radius: f32,
    /// Texels along the side of the square that everything casts into.
    size: usize,
    /// How near the light what casts a shadow is, by rows; [`MARGIN`] texels of nothing lie around
    /// the square, so that softening needs not ask where it ends.
    nearness: Vec<f32>,
    /// The greatest nearness in blocks of [`BLOCK`] x [`BLOCK`] texels, by rows, margin included.
    blocks: Vec<f32>,
}

impl Clone for ShadowMap {
    fn clone(&self) -> Self {
        Self { nearness: self.nearness.clone(), blocks: self.blocks.clone(), ..*self }
    }

    /// Into the same memory.
    fn clone_from(&mut self, other: &Self) {
        let mut nearness = std::mem::take(&mut self.nearness);
        let mut blocks = std::mem::take(&mut self.blocks);
        nearness.clone_from(&other.nearness);
        blocks.clone_from(&other.blocks);
        *self = Self { nearness, blocks, ..*other };
    }
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
        let half = 0.5 * size as f32;
        let (right, down) = (right * (half / radius), up * (-half / radius));
        let near = direction / radius;
        let steps = std::array::from_fn(|axis| Vec3::new(right[axis], down[axis], near[axis]));
        let middle = half + MARGIN as f32;
        let mut map = Self { direction, steps, origin: Vec3::ZERO, radius, size, nearness, blocks };
        map.origin = Vec3::new(middle, middle, 0.0) - map.along(stage.center);
        map
    }

    /// Texels in a row, margin included.
    fn stride(&self) -> usize {
        self.size + 2 * MARGIN
    }

    /// Enters everything in `mesh`, which must be inside the stage of the map.
    pub(super) fn cast(&mut self, mesh: &Mesh) {
        let vertices: Vec<Vec3> = mesh.positions.iter().map(|&p| self.texel(p)).collect();
        let cells: Vec<u32> = vertices.iter().map(|&vertex| cell(vertex)).collect();
        let stride = self.stride();
        let size = self.size;
        self.nearness.par_chunks_mut(BAND * stride).enumerate().for_each(|(band, nearness)| {
            cast_band(&mesh.triangles, &vertices, &cells, size, band * BAND, nearness);
        });
        self.blocks_update(&cells);
    }

    /// Finds the greatest nearness in the blocks that `cells` lie in.
    fn blocks_update(&mut self, cells: &[u32]) {
        let stride = self.stride();
        let rows = cells.iter().map(|cell| (cell >> 16) as usize / BLOCK);
        let (first, last) =
            rows.fold((usize::MAX, 0), |(first, last), row| (first.min(row), last.max(row)));
        let rows = self
            .nearness
            .chunks(BLOCK * stride)
            .zip(self.blocks.chunks_mut(stride.div_ceil(BLOCK)));
        let mut greatest = vec![f32::NEG_INFINITY; stride];
        for (rows, blocks) in rows.take(last.saturating_add(1)).skip(first) {
            greatest.fill(f32::NEG_INFINITY);
            for row in rows.chunks_exact(stride) {
                for (greatest, &texel) in greatest.iter_mut().zip(row) {
                    *greatest = if texel > *greatest { texel } else { *greatest };
                }
            }
            for (block, greatest) in blocks.iter_mut().zip(greatest.chunks(BLOCK)) {
                *block = greatest.iter().fold(*block, |block, &texel| block.max(texel));
            }
        }
    }

    /// What a step along one axis of the scene adds to column, row and nearness for each metre; and those of the origin.
    pub(super) fn affine(&self) -> ([Vec3; 3], Vec3) {
        (self.steps, self.origin)
    }

    /// What a step of that length and direction adds to column, row and nearness.
    #[inline]
    pub(super) fn along(&self, step: Vec3) -> Vec3 {
        step.x * self.steps[0] + step.y * self.steps[1] + step.z * self.steps[2]
    }

    /// Column and row \[texel\], margin included, and towards the light.
    #[inline]
    pub(super) fn texel(&self, point: Vec3) -> Vec3 {
        self.origin + self.along(point)
    }

    /// How far a point steps out of its surface so that this does not shadow itself: as far as
    /// softening over `TAPS` x `TAPS` texels spans \[m\].
    #[inline]
    pub(super) fn clearance<const TAPS: usize>(&self) -> f32 {
        2.0 / self.size as f32 * self.radius * (1 + TAPS / 2) as f32
    }

    /// How much of the light reaches `point`, from 0 to 1, softened over a square of `TAPS` x `TAPS`
    /// texels; `TAPS` is even.
    #[inline]
    pub(super) fn lit<const TAPS: usize>(&self, point: Vec3, normal: Vec3) -> f32 {
        self.lit_at::<TAPS>(self.texel(point + self.clearance::<TAPS>() * normal))
    }

    /// The same for column, row and nearness of a point that has stepped out of its surface.
    #[inline]
    pub(super) fn lit_at<const TAPS: usize>(&self, place: Vec3) -> f32 {
        const { assert!(TAPS.is_multiple_of(2) && TAPS <= MARGIN) };
        let limit = self.limit(place.z);
        // The first of the texels.
        let first = place.truncate() - first_tap::<TAPS>();
        let stride = self.stride();
        let end = (stride - TAPS) as f32;
        if !(first.min_element() >= 0.0 && first.max_element() < end) {
            // Nothing casts a shadow there.
            return 1.0;
        }
        let [column, row] = [first.x as i32, first.y as i32];
        let part = first - Vec2::new(column as f32, row as f32);
        let start = row as usize * stride + column as usize;
        let mut sum = 0.0;
        for y in 0..TAPS {
            let texels = self.nearness.get(start + y * stride..);
            let Some(texels) = texels.and_then(<[f32]>::first_chunk::<TAPS>) else { return 1.0 };
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

    /// Whether nothing casts a shadow on any point with column, row and nearness between `least` and
    /// `greatest`, as it is for most of a floor; sometimes it says no where it could say yes.
    #[inline]
    pub(super) fn is_open<const TAPS: usize>(&self, least: Vec3, greatest: Vec3) -> bool {
        let limit = self.limit(least.z);
        let tap = first_tap::<TAPS>();
        let (first, last) = (least.truncate() - tap, greatest.truncate() - tap + TAPS as f32);
        let stride = self.stride() as f32;
        if last.min_element() < 0.0 || first.max_element() >= stride {
            return true;
        }
        // The conversion saturates, and makes no block of what is not a number.
        let block = |texel: f32| texel.clamp(0.0, stride - 1.0) as i32 as usize / BLOCK;
        let blocks = self.stride().div_ceil(BLOCK);
        if !(first.is_finite() && last.is_finite() && limit.is_finite()) {
            return false;
        }
        let columns = block(first.x)..=block(last.x);
        (block(first.y)..=block(last.y)).all(|row| {
            let blocks = self.blocks.get(row * blocks..(row + 1) * blocks);
            let blocks = blocks.and_then(|blocks| blocks.get(columns.clone()));
            blocks.is_none_or(|blocks| blocks.iter().all(|&nearness| nearness <= limit))
        })
    }

    /// The nearness of what does not yet shadow a point of that nearness.
    #[inline]
    fn limit(&self, nearness: f32) -> f32 {
        nearness + 1.0 / self.size as f32
    }
}

/// Enters triangles into the rows of a map from `top` on. Each corner is a place in the map, in one of its `cells`.
fn cast_band(
    triangles: &[[u32; 3]],
    vertices: &[Vec3],
    cells: &[u32],
    size: usize,
    top: usize,
    nearness: &mut [f32],
) {
    let stride = size + 2 * MARGIN;
    let columns = MARGIN..MARGIN + size;
    let bottom = top + nearness.len() / stride;
    // As a comparison: `max` would ask what is no number.
    let nearer =
        |nearest: &mut f32, near: f32| *nearest = if near > *nearest { near } else { *nearest };
    for corners in triangles {
        let corners = corners.map(|index| index as usize);
        // Most triangles of a fine cloth lie between the samples of a small map, or around one.
        let Some([rows, across]) = between(corners.map(|index| cells[index])) else { continue };
        if rows[0].max(top) >= rows[1].min(bottom) {
            continue;
        }
        let corners = corners.map(|index| vertices[index]);
        if rows[1] - rows[0] == 1 && across[1] - across[0] == 1 {
            if columns.contains(&across[0])
                && let Some(near) = scan::single(corners, rows[0], across[0])
                && let Some(nearest) = nearness.get_mut((rows[0] - top) * stride + across[0])
            {
                nearer(nearest, near);
            }
            continue;
        }
        let Some(triangle) = ScanTriangle::new(corners) else { continue };
        triangle.spans(top, bottom, |row, start, end, span| {
            let base = (row - top) * stride;
            let (start, end) = (start.max(columns.start), end.min(columns.end));
            let Some(texels) = nearness.get_mut(base + start..base + end) else { return };
            for (column, nearest) in (start..).zip(texels) {
                nearer(nearest, span.at(column));
            }
        });
    }
}

/// How far the first of the texels that soften a point lies before it \[texel\].
#[inline]
fn first_tap<const TAPS: usize>() -> f32 {
    (TAPS / 2) as f32 - 0.5
}

/// The first column and the first row of samples that are not before a place, in one number.
#[inline]
fn cell(place: Vec3) -> u32 {
    let first = |x: f32| scan::ceiling(x - 0.5).min(0xffff) as u32;
    first(place.y) << 16 | first(place.x)
}

/// Rows, then columns of samples between corners in these cells, each from the first to the one after the last;
/// `None` if there is none.
#[inline]
fn between([a, b, c]: [u32; 3]) -> Option<[[usize; 2]; 2]> {
    let difference = (a ^ b) | (a ^ c);
    if difference & 0xffff == 0 || difference >> 16 == 0 {
        return None;
    }
    let range = |shift: u32| {
        let [a, b, c] = [a, b, c].map(|cell| (cell >> shift & 0xffff) as usize);
        [a.min(b).min(c), a.max(b).max(c)]
    };
    Some([range(16), range(0)])
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

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> ShadowMap {
        let stage = Stage { center: Vec3::new(0.1, 0.2, 0.0), radius: 2.0 };
        let mut map = ShadowMap::new(&stage, Vec3::new(0.3, -0.2, 0.9).normalize(), 200);
        let positions =
            vec![Vec3::new(0.0, 0.0, 0.5), Vec3::new(0.7, 0.1, 0.6), Vec3::new(0.2, 0.8, 0.4)];
        map.cast(&Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() });
        map
    }

    /// Where a row of points is called open, none of them is in shadow, and rows beside the shadow are called that.
    #[test]
    fn what_is_open_is_lit() {
        let map = map();
        let (mut open, mut dark) = (0, 0);
        for row in 0..80 {
            for run in 0..10 {
                let at = |i: usize| {
                    let x = -2.0 + 0.05 * (8 * run + i) as f32;
                    map.texel(Vec3::new(x, -2.0 + 0.05 * row as f32, 0.0))
                };
                let is_open = map.is_open::<4>(at(0).min(at(7)), at(0).max(at(7)));
                let least = (0..8).map(|i| map.lit_at::<4>(at(i))).fold(1.0, f32::min);
                assert!(!is_open || least > 0.9999, "row {row}, run {run}: {least}");
                open += usize::from(is_open);
                dark += usize::from(least < 0.5);
            }
        }
        assert!(open > 600 && dark > 10, "{open} open, {dark} dark");
    }

    /// Cells tell the samples between corners as their bounds do.
    #[test]
    fn cells_are_bounds() {
        for corners in [
            [(1.2, 3.4), (1.4, 3.45), (1.3, 3.49)],
            [(1.2, 3.4), (1.7, 3.6), (1.3, 3.45)],
            [(9.5, 0.5), (2.5, 7.1), (4.4, 3.3)],
            [(-4.0, 2.0), (f32::NAN, 7.0), (3.0, 9.0)],
        ] {
            let corners = corners.map(|(x, y)| Vec3::new(x, y, 0.0));
            let expected = scan::bounds(corners);
            let is_some = expected.iter().all(|[first, end]| first < end);
            if corners.iter().all(|corner| corner.is_finite()) {
                assert_eq!(between(corners.map(cell)), is_some.then_some(expected), "{corners:?}");
            } else {
                assert!(between(corners.map(cell)).is_none_or(|[rows, _]| rows[1] <= 9));
            }
        }
    }
}
