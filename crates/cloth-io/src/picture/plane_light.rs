//! Light on the planes of a floor, several pixels of a row at a time.

use glam::Vec3;

use super::camera::View;
use super::floor::{FloorPoints, tile};
use super::geometry::Plane;
use super::shade::{FILL, GROUND, KEY, KEY_TAPS, SKY};
use super::shadow::ShadowMap;
use super::sky::{Sky, SkyGrid};
use super::tone::tone_channel;

/// What the lights of one picture do to one plane: all but what differs from point to point.
pub(super) struct PlaneLight<'a> {
    key: &'a ShadowMap,
    grid: Option<&'a SkyGrid>,
    /// Column, row and nearness of the point of the plane in the map of the strong light, and what
    /// a metre along its axes adds.
    place: Vec3,
    steps: [Vec3; 2],
    /// How squarely the strong light meets the plane on the side of the viewer.
    facing: f32,
    /// Light that does not change from point to point.
    ground: Vec3,
}

impl<'a> PlaneLight<'a> {
    pub(super) fn new(
        number: usize,
        plane: &Plane,
        view: &View,
        key: &'a ShadowMap,
        sky: &'a Sky,
    ) -> Self {
        // The side of the plane on which the viewer is.
        let side = if plane.distance(view.eye) >= 0.0 { 1.0 } else { -1.0 };
        let normal = side * plane.normal;
        Self {
            key,
            grid: sky.grid(number),
            place: key.texel(plane.point + key.clearance::<KEY_TAPS>() * normal),
            steps: plane.axes.map(|axis| key.along(axis)),
            facing: normal.dot(key.direction).max(0.0),
            ground: GROUND * (0.5 - 0.5 * normal.z),
        }
    }

    /// The colours of `points` before a `background`, ready for a screen: red, green and blue of each.
    #[inline]
    pub(super) fn colors<const N: usize>(
        &self,
        points: &FloorPoints<N>,
        background: Vec3,
    ) -> [[f32; N]; 3] {
        let lit = self.lit(points);
        let sky = self.sky(points);
        let mut strong = [0.0; N];
        let mut fill = [0.0; N];
        for i in 0..N {
            strong[i] = self.facing * lit[i];
            fill[i] = points.facing[i] * (0.4 + 0.6 * sky[i]);
        }
        std::array::from_fn(|channel| {
            let (tiles, ground) = (tile(channel), self.ground[channel]);
            let (key, open, side) = (KEY[channel], SKY[channel], FILL[channel]);
            let behind = background[channel];
            let mut colors = [0.0; N];
            for i in 0..N {
                let light = key * strong[i] + open * sky[i] + ground + side * fill[i];
                let color = tiles[0] + (tiles[1] - tiles[0]) * points.part[i];
                let color = tone_channel(color * light);
                colors[i] = color + (behind - color) * points.haze[i];
            }
            colors
        })
    }

    /// How much of the strong light reaches `points`.
    #[inline]
    fn lit<const N: usize>(&self, points: &FloorPoints<N>) -> [f32; N] {
        if self.facing == 0.0 {
            return [0.0; N];
        }
        let mut places = [[0.0; N]; 3];
        for (axis, places) in places.iter_mut().enumerate() {
            let (start, [along, across]) = (self.place[axis], self.steps.map(|step| step[axis]));
            let points = points.along[0].iter().zip(&points.along[1]);
            for (place, (first, second)) in places.iter_mut().zip(points) {
                *place = start + along * first + across * second;
            }
        }
        // Points in a row lie between the first and the last of them.
        let at = |i: usize| Vec3::from(places.map(|places| places[i]));
        let [first, last] = [at(0), at(N - 1)];
        if self.key.is_open::<KEY_TAPS>(first.min(last), first.max(last)) {
            return [1.0; N];
        }
        std::array::from_fn(|i| self.key.lit_at::<KEY_TAPS>(at(i)))
    }

    /// Light of the sky on `points`.
    #[inline]
    fn sky<const N: usize>(&self, points: &FloorPoints<N>) -> [f32; N] {
        let Some(grid) = self.grid else { return [1.0; N] };
        let (density, start) = (grid.density(), grid.place().to_array());
        let mut places = [[0.0; N]; 2];
        for ((places, along), start) in places.iter_mut().zip(&points.along).zip(start) {
            for i in 0..N {
                places[i] = start + along[i] * density;
            }
        }
        let [columns, rows] = places;
        grid.at(columns, rows)
    }
}
