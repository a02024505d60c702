//! Finds the triangle that is visible at each sample; clipping and scan conversion come from the
//! software renderer `retrofire`.

use glam::Vec4;
use rayon::prelude::*;
use retrofire_core::geom::{Tri, vertex};
use retrofire_core::math::ProjVec3;
use retrofire_core::math::point::pt3;
use retrofire_core::render::clip::{ClipVert, Status, view_frustum};
use retrofire_core::render::raster::{ScreenPt, tri_fill};

use super::camera::View;
use super::geometry::Geometry;

/// Samples of a pixel in each direction.
pub(super) const SAMPLES: usize = 2;
/// Number of no triangle.
pub(super) const NOTHING: u32 = u32::MAX;
/// Triangles that one task projects.
const CHUNK: usize = 4096;
/// Rows that one task fills.
const BAND: usize = 64;

/// What is visible at each sample.
pub(super) struct Visibility {
    pub(super) width: usize,
    /// Triangle at each sample, by rows, or [`NOTHING`].
    pub(super) triangles: Vec<u32>,
    /// How near the triangle is; larger is nearer, linear on the screen.
    pub(super) nearness: Vec<f32>,
}

impl Visibility {
    /// What `view` sees, with [`SAMPLES`] × [`SAMPLES`] samples for each pixel.
    pub(super) fn of_view(geometry: &Geometry, view: &View) -> Self {
        let vertices: Vec<Vec4> = geometry.positions.par_iter().map(|&p| view.clip(p)).collect();
        let [width, height] = [view.width, view.height].map(|side| side as usize * SAMPLES);
        // The reciprocal of depth is linear on the screen and precise also far away.
        let nearness = |clip: Vec4| clip.w.recip();
        let to_screen = |clip: Vec4| -> ScreenPt {
            let x = (0.5 + 0.5 * clip.x / clip.w) * width as f32;
            let y = (0.5 - 0.5 * clip.y / clip.w) * height as f32;
            pt3(x, y, nearness(clip))
        };
        let numbered = geometry.triangles.par_chunks(CHUNK).enumerate();
        let screen: Vec<Vec<ScreenTriangle>> = numbered
            .map(|(chunk, triangles)| {
                let mut screen = Vec::with_capacity(triangles.len());
                for (number, triangle) in (chunk * CHUNK..).zip(triangles) {
                    let corners = triangle.map(|index| vertices[index as usize]);
                    clip(corners, |part| {
                        let triangle = ScreenTriangle::new(number as u32, part.map(to_screen));
                        screen.extend(triangle);
                    });
                }
                screen
            })
            .collect();

        let mut visibility = Self {
            width,
            triangles: vec![NOTHING; width * height],
            nearness: vec![f32::NEG_INFINITY; width * height],
        };
        let bands = visibility
            .triangles
            .par_chunks_mut(BAND * width)
            .zip(visibility.nearness.par_chunks_mut(BAND * width))
            .enumerate();
        bands.for_each(|(band, (triangles, nearness))| {
            let mut band = Band { first_row: band * BAND, width, triangles, nearness };
            for triangle in screen.iter().flatten() {
                band.fill(triangle);
            }
        });
        visibility
    }
}

/// Calls `part` with the parts of a triangle inside the view, which are triangles.
fn clip(corners: [Vec4; 3], mut part: impl FnMut([Vec4; 3])) {
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

struct ScreenTriangle {
    number: u32,
    corners: [ScreenPt; 3],
    /// Rows it covers.
    top: f32,
    bottom: f32,
}

impl ScreenTriangle {
    /// The triangle, unless it lies between the samples and covers none.
    fn new(number: u32, corners: [ScreenPt; 3]) -> Option<Self> {
        let range = |[a, b, c]: [f32; 3]| (a.min(b).min(c), a.max(b).max(c));
        let (left, right) = range(corners.map(|corner| corner.x()));
        let (top, bottom) = range(corners.map(|corner| corner.y()));
        // Samples are in the middle of pixels.
        let covers = |low: f32, high: f32| (low + 0.5).floor() < (high + 0.5).floor();
        (covers(left, right) && covers(top, bottom)).then_some(Self {
            number,
            corners,
            top,
            bottom,
        })
    }
}

/// Consecutive rows of the picture.
struct Band<'a> {
    first_row: usize,
    width: usize,
    triangles: &'a mut [u32],
    nearness: &'a mut [f32],
}

impl Band<'_> {
    fn fill(&mut self, triangle: &ScreenTriangle) {
        let last_row = self.first_row + self.triangles.len() / self.width;
        if triangle.bottom < self.first_row as f32 || triangle.top > last_row as f32 {
            return;
        }
        tri_fill(triangle.corners.map(|corner| vertex(corner, ())), |line| {
            let Some(row) = line.y.checked_sub(self.first_row) else {
                return;
            };
            let start = row * self.width;
            // Rounding can reach one sample beyond the edge.
            let end = line.xs.end.min(self.width);
            let range = start + line.xs.start.min(end)..start + end;
            let (Some(triangles), Some(nearness)) =
                (self.triangles.get_mut(range.clone()), self.nearness.get_mut(range))
            else {
                return;
            };
            for ((number, nearest), (point, ())) in triangles.iter_mut().zip(nearness).zip(line.vs)
            {
                if point.z() > *nearest {
                    *nearest = point.z();
                    *number = triangle.number;
                }
            }
        });
    }
}
