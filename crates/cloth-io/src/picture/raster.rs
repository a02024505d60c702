//! Finds what is visible at each sample of a picture, a band of rows at a time; clipping comes from
//! the software renderer `retrofire`.

use glam::{Vec3, Vec4};
use rayon::prelude::*;
use retrofire_core::geom::{Tri, vertex};
use retrofire_core::math::ProjVec3;
use retrofire_core::render::clip::{ClipVert, Status, view_frustum};

use super::camera::View;
use super::floor::{EDGE, Floor, plane_of};
use super::geometry::Mesh;
use super::scan::ScanTriangle;

/// Samples of a pixel in each direction.
pub(super) const SAMPLES: usize = 2;
/// Number of no triangle.
pub(super) const NOTHING: u32 = u32::MAX;
/// Rows of pixels of a band: its samples fit into the cache of a core.
pub(super) const BAND: usize = 16;
/// Triangles that one task projects.
const CHUNK: usize = 2048;

/// What is seen at a sample.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Seen {
    Nothing,
    /// A plane of the floor.
    Plane(usize),
    /// A triangle of the solids (mesh 0) or of the cloth (mesh 1).
    Triangle {
        mesh: usize,
        triangle: usize,
    },
}

/// All triangles on the screen, by the bands that they cover.
pub(super) struct Screen {
    triangles: Vec<(u32, ScanTriangle)>,
    bands: Vec<Vec<u32>>,
    /// Where the numbers of the cloth begin, after those of the solids.
    cloth_start: u32,
}

impl Screen {
    /// What `view` sees of the solids and the cloth.
    pub(super) fn new(meshes: [&Mesh; 2], view: &View) -> Self {
        let cloth_start = meshes[0].triangles.len() as u32;
        let mut triangles = Vec::new();
        for (mesh, start) in meshes.into_iter().zip([0, cloth_start]) {
            project(mesh, start, view, &mut triangles);
        }
        let mut bands = vec![Vec::new(); (view.height as usize).div_ceil(BAND)];
        for (index, (_, triangle)) in triangles.iter().enumerate() {
            let [first, end] = triangle.rows();
            let last = (end - 1) / (BAND * SAMPLES);
            for band in bands.iter_mut().take(last + 1).skip(first / (BAND * SAMPLES)) {
                band.push(index as u32);
            }
        }
        Self { triangles, bands, cloth_start }
    }

    /// What the number of a sample stands for.
    #[inline]
    pub(super) fn seen(&self, number: u32) -> Seen {
        if number == NOTHING {
            Seen::Nothing
        } else if let Some(plane) = plane_of(number) {
            Seen::Plane(plane)
        } else if number >= self.cloth_start {
            Seen::Triangle { mesh: 1, triangle: (number - self.cloth_start) as usize }
        } else {
            Seen::Triangle { mesh: 0, triangle: number as usize }
        }
    }
}

/// Appends the triangles of `mesh` that are on the screen, numbered from `start`.
fn project(mesh: &Mesh, start: u32, view: &View, screen: &mut Vec<(u32, ScanTriangle)>) {
    let vertices: Vec<Vec4> = mesh.positions.par_iter().map(|&p| view.clip(p)).collect();
    let [width, height] = [view.width, view.height].map(|side| (side as usize * SAMPLES) as f32);
    // The reciprocal of depth is linear on the screen and precise also far away.
    let to_screen = |clip: Vec4| {
        let nearness = clip.w.recip();
        let x = (0.5 + 0.5 * clip.x * nearness) * width;
        let y = (0.5 - 0.5 * clip.y * nearness) * height;
        Vec3::new(x, y, nearness)
    };
    let numbered = mesh.triangles.par_chunks(CHUNK).enumerate();
    let chunks: Vec<Vec<(u32, ScanTriangle)>> = numbered
        .map(|(chunk, triangles)| {
            let mut screen = Vec::with_capacity(triangles.len());
            for (number, triangle) in (start + (chunk * CHUNK) as u32..).zip(triangles) {
                let corners = triangle.map(|index| vertices[index as usize]);
                clip(corners, |part| {
                    screen.extend(ScanTriangle::new(part.map(to_screen)).map(|t| (number, t)));
                });
            }
            screen
        })
        .collect();
    screen.extend(chunks.into_iter().flatten());
}

/// Calls `part` with the parts of a triangle inside the view, which are triangles.
fn clip(corners: [Vec4; 3], mut part: impl FnMut([Vec4; 3])) {
    let is_inside = |c: &Vec4| [c.x, c.y, c.z].iter().all(|x| x.abs() <= c.w);
    if corners.iter().all(is_inside) {
        return part(corners);
    }
    let vertices = corners.map(|c| ClipVert::new(vertex(ProjVec3::new(c.to_array()), ())));
    match view_frustum::status(&vertices) {
        Status::Hidden => {}
        Status::Visible => part(corners),
        Status::Clipped => {
            let mut parts = Vec::new();
            view_frustum::clip([Tri(vertices)].as_slice(), &mut parts);
            for Tri(vertices) in parts {
                part(vertices.map(|vertex| Vec4::from(vertex.pos.0)));
            }
        }
    }
}

/// What is visible at each sample of consecutive rows of the picture.
pub(super) struct Band {
    /// Samples in a row.
    width: usize,
    /// Pixels in each row of pixels that triangles can cover, from the first to the one after the last; samples
    /// beside them are not filled, as the floor tells what is there.
    covered: [[usize; 2]; BAND],
    /// Number of what is seen, by rows, see [`Screen::seen`].
    numbers: Vec<u32>,
    /// How near it is; larger is nearer, linear on the screen.
    nearness: Vec<f32>,
}

impl Band {
    /// A band with nothing in it.
    pub(super) fn new(view: &View) -> Self {
        let width = view.width as usize * SAMPLES;
        let count = width * BAND * SAMPLES;
        let covered = [[0, 0]; BAND];
        Self { width, covered, numbers: vec![NOTHING; count], nearness: vec![0.0; count] }
    }

    /// Finds what is visible in band number `number`, of which the picture has `rows` rows of pixels.
    pub(super) fn fill(
        &mut self,
        screen: &Screen,
        floor: &Floor,
        view: &View,
        number: usize,
        rows: usize,
    ) {
        let top = number * BAND * SAMPLES;
        let bottom = top + rows * SAMPLES;
        let triangles = screen.bands.get(number).map_or(&[][..], Vec::as_slice);
        let triangles = || triangles.iter().map(|&index| &screen.triangles[index as usize]);
        self.cover(triangles().map(|(_, triangle)| triangle), top, bottom);
        for row in top..bottom {
            let [start, end] = self.covered[(row - top) / SAMPLES].map(|pixel| pixel * SAMPLES);
            let base = (row - top) * self.width;
            let samples = base + start..base + end;
            let (numbers, nearness) =
                (&mut self.numbers[samples.clone()], &mut self.nearness[samples]);
            floor.fill(row, start, view, numbers, nearness);
        }
        for (number, triangle) in triangles() {
            triangle.spans(top, bottom, |row, start, end, span| {
                let base = (row - top) * self.width;
                // Rounding can reach one sample beyond the edge.
                let range = base + start..base + end.min(self.width);
                let (Some(numbers), Some(nearness)) =
                    (self.numbers.get_mut(range.clone()), self.nearness.get_mut(range))
                else {
                    return;
                };
                for (column, (seen, nearest)) in (start..).zip(numbers.iter_mut().zip(nearness)) {
                    let nearness = span.at(column);
                    if nearness > *nearest {
                        (*nearest, *seen) = (nearness, *number);
                    }
                }
            });
        }
    }

    /// Notes which pixels `triangles` can cover.
    fn cover<'t>(
        &mut self,
        triangles: impl Iterator<Item = &'t ScanTriangle>,
        top: usize,
        bottom: usize,
    ) {
        self.covered = [[usize::MAX, 0]; BAND];
        for triangle in triangles {
            let ([first, end], [left, right]) = (triangle.rows(), triangle.columns());
            let (first, end) = (first.max(top), end.min(bottom));
            // A sample more on each side, as rounding may have it.
            let (left, right) = (left.saturating_sub(1) / SAMPLES, (right + 1).div_ceil(SAMPLES));
            let rows = (first - top) / SAMPLES..(end - top).div_ceil(SAMPLES);
            for [start, end] in self.covered.get_mut(rows).into_iter().flatten() {
                (*start, *end) = ((*start).min(left), (*end).max(right));
            }
        }
        let width = self.width / SAMPLES;
        for [start, end] in &mut self.covered {
            *end = (*end).min(width);
            *start = (*start).min(*end);
        }
    }

    /// Numbers and nearness at the samples of a pixel in row `row_in_band` of band number `band`, left to right, then
    /// downwards.
    #[inline]
    pub(super) fn pixel(
        &self,
        column: usize,
        [band, row_in_band]: [usize; 2],
        floor: &Floor,
        view: &View,
    ) -> [(u32, f32); SAMPLES * SAMPLES] {
        let [first, end] = self.covered[row_in_band];
        if !(first..end).contains(&column) {
            return floor.samples([column, band * BAND + row_in_band], view);
        }
        let start = row_in_band * SAMPLES * self.width + column * SAMPLES;
        std::array::from_fn(|sample| {
            let index = start + sample / SAMPLES * self.width + sample % SAMPLES;
            (self.numbers[index], self.nearness[index])
        })
    }

    /// Fills `numbers` with what all samples of each pixel of a row see, or [`EDGE`] where they see different
    /// things.
    pub(super) fn row(&self, numbers: &mut [u32], [band, row_in_band]: [usize; 2], floor: &Floor) {
        let behind = floor.numbers(band * BAND + row_in_band);
        if behind.is_empty() {
            numbers.fill(NOTHING);
        } else {
            numbers.copy_from_slice(behind);
        }
        let [first, end] = self.covered[row_in_band];
        let base = row_in_band * SAMPLES * self.width;
        let samples = |row: usize| {
            let base = base + row * self.width;
            self.numbers[base + first * SAMPLES..base + end * SAMPLES].as_chunks::<SAMPLES>().0
        };
        let rows: [_; SAMPLES] = std::array::from_fn(samples);
        for (pixel, number) in numbers[first..end].iter_mut().enumerate() {
            let seen = rows[0][pixel][0];
            let is_same = rows.iter().all(|row| row[pixel] == [seen; SAMPLES]);
            *number = if is_same { seen } else { EDGE };
        }
    }
}
