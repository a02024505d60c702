//! Finds what is visible at each sample of a picture, a band of rows at a time; clipping comes from
//! the software renderer `retrofire`.

use glam::{Vec3, Vec4};
use rayon::prelude::*;
use retrofire_core::geom::{Tri, vertex};
use retrofire_core::math::ProjVec3;
use retrofire_core::render::clip::{ClipVert, Status, view_frustum};

use super::camera::View;
use super::floor::Floor;
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
/// Numbers from here on are those of planes.
const PLANE: u32 = u32::MAX - (1 << 16);

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
        } else if number >= PLANE {
            Seen::Plane((number - PLANE) as usize)
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
        Self { width, numbers: vec![NOTHING; count], nearness: vec![0.0; count] }
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
        self.numbers.fill(NOTHING);
        // Nothing is behind the eye, and nothing that is too far is seen.
        let farthest = if floor.nearness().is_empty() { 0.0 } else { floor.farthest(view) };
        self.nearness.fill(farthest);
        let samples = self.numbers.chunks_mut(self.width).zip(self.nearness.chunks_mut(self.width));
        for (row, (numbers, nearness)) in (top..bottom).zip(samples) {
            let middle = |sample: usize| (sample as f32 + 0.5) / SAMPLES as f32;
            for (plane, line) in (PLANE..NOTHING).zip(floor.nearness()) {
                for (sample, (number, nearest)) in
                    numbers.iter_mut().zip(&mut *nearness).enumerate()
                {
                    let nearness = line.at(middle(sample), middle(row));
                    if nearness > *nearest {
                        (*nearest, *number) = (nearness, plane);
                    }
                }
            }
        }
        for &index in screen.bands.get(number).into_iter().flatten() {
            let (number, triangle) = &screen.triangles[index as usize];
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

    /// Numbers and nearness at the samples of a pixel in row `row` of the band, left to right, then
    /// downwards.
    #[inline]
    pub(super) fn pixel(&self, column: usize, row: usize) -> [(u32, f32); SAMPLES * SAMPLES] {
        let start = row * SAMPLES * self.width + column * SAMPLES;
        std::array::from_fn(|sample| {
            let index = start + sample / SAMPLES * self.width + sample % SAMPLES;
            (self.numbers[index], self.nearness[index])
        })
    }
}
