//! A camera that turns around a point.

use std::f64::consts::FRAC_PI_2;

use cloth::io::Camera;
use glam::{
    DMat4, DVec3,
    dcamera::rh::{proj::directx::perspective_infinite_reverse, view::look_at_mat4},
};

/// A camera that looks at a point from some distance; z is up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrbitCamera {
    /// Point in the middle of the picture \[m\].
    pub target: [f64; 3],
    /// Distance of the eye from it \[m\].
    pub distance: f64,
    /// Angle of the eye around the z axis, 0 on the x axis \[rad\].
    pub azimuth: f64,
    /// Angle of the eye above the horizon \[rad\].
    pub elevation: f64,
    /// Angle between the lower and the upper edge of the picture \[rad\].
    pub vertical_field_of_view: f64,
}

/// A half line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts \[m\].
    pub origin: [f64; 3],
    /// Unit vector along it.
    pub direction: [f64; 3],
}

impl Ray {
    /// The point at this distance \[m\] from the origin.
    #[must_use]
    pub fn at(&self, distance: f64) -> [f64; 3] {
        std::array::from_fn(|k| self.origin[k] + distance * self.direction[k])
    }
}

/// Just below straight up, where the horizon still has a direction.
const ELEVATION_LIMIT: f64 = FRAC_PI_2 - 0.01;

impl OrbitCamera {
    /// The same view as that of a camera for pictures.
    #[must_use]
    pub fn from_camera(camera: &Camera) -> Self {
        let offset = DVec3::from(camera.eye) - DVec3::from(camera.target);
        let distance = offset.length().max(1e-6);
        Self {
            target: camera.target,
            distance,
            azimuth: offset.y.atan2(offset.x),
            elevation: (offset.z / distance)
                .clamp(-1.0, 1.0)
                .asin()
                .clamp(-ELEVATION_LIMIT, ELEVATION_LIMIT),
            vertical_field_of_view: camera.vertical_field_of_view,
        }
    }

    /// Position of the eye \[m\].
    #[must_use]
    pub fn eye(&self) -> [f64; 3] {
        (DVec3::from(self.target) + self.distance * self.backward()).to_array()
    }

    /// Turns by the movement of a pointer in units of the height of the picture.
    pub fn orbit(&mut self, right: f64, down: f64) {
        self.azimuth -= right * 4.0;
        self.elevation = (self.elevation + down * 4.0).clamp(-ELEVATION_LIMIT, ELEVATION_LIMIT);
    }

    /// Moves sideways, so that what is at the target follows a pointer that moves by this part of
    /// the height of the picture.
    pub fn pan(&mut self, right: f64, down: f64) {
        let height = 2.0 * self.distance * (0.5 * self.vertical_field_of_view).tan();
        let (side, up) = self.axes();
        let moved = DVec3::from(self.target) + height * (down * up - right * side);
        self.target = moved.to_array();
    }

    /// Moves nearer (`steps` above zero) or away.
    pub fn zoom(&mut self, steps: f64) {
        self.distance = (self.distance * (-0.12 * steps).exp()).clamp(1e-4, 1e6);
    }

    /// The ray through a place in the picture: 0 to 1 from left to right and from top to bottom.
    #[must_use]
    pub fn ray(&self, place: [f64; 2], aspect: f64) -> Ray {
        let slope = (0.5 * self.vertical_field_of_view).tan();
        let (side, up) = self.axes();
        let direction = (2.0 * place[0] - 1.0) * slope * aspect * side
            + (1.0 - 2.0 * place[1]) * slope * up
            - self.backward();
        Ray { origin: self.eye(), direction: direction.normalize().to_array() }
    }

    /// Where in the picture a point is seen, as in [`Self::ray`]; `None` behind the eye.
    #[must_use]
    pub fn place(&self, point: [f64; 3], aspect: f64) -> Option<[f64; 2]> {
        let clip = self.clip_from_world(aspect) * DVec3::from(point).extend(1.0);
        (clip.w > 0.0).then(|| [0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w])
    }

    /// World to clip space; depth is 1 at the near plane and 0 at infinity.
    pub(crate) fn clip_from_world(&self, aspect: f64) -> DMat4 {
        let near = 0.01 * self.distance;
        perspective_infinite_reverse(self.vertical_field_of_view, aspect, near)
            * look_at_mat4(self.eye().into(), self.target.into(), DVec3::Z)
    }

    fn backward(&self) -> DVec3 {
        let (sin, cos) = self.elevation.sin_cos();
        DVec3::new(cos * self.azimuth.cos(), cos * self.azimuth.sin(), sin)
    }

    /// Unit vectors to the right and up in the picture.
    fn axes(&self) -> (DVec3, DVec3) {
        let backward = self.backward();
        let side = DVec3::Z.cross(backward).normalize();
        (side, backward.cross(side))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> OrbitCamera {
        OrbitCamera::from_camera(&Camera {
            eye: [1.0, -3.0, 2.0],
            target: [0.2, 0.1, 0.5],
            up: [0.0, 0.0, 1.0],
            vertical_field_of_view: 0.6,
        })
    }

    #[test]
    fn the_eye_of_a_picture_camera_is_kept() {
        let eye = camera().eye();
        for (found, expected) in eye.iter().zip([1.0, -3.0, 2.0]) {
            assert!((found - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn rays_go_where_points_are_seen() {
        let camera = camera();
        for place in [[0.5, 0.5], [0.1, 0.9], [0.8, 0.25]] {
            let point = camera.ray(place, 1.6).at(2.5);
            let seen = camera.place(point, 1.6).unwrap();
            assert!((seen[0] - place[0]).abs() < 1e-9 && (seen[1] - place[1]).abs() < 1e-9);
        }
        let behind = camera.ray([0.5, 0.5], 1.6).at(-1.0);
        assert_eq!(camera.place(behind, 1.6), None);
    }

    #[test]
    fn panning_moves_what_is_seen_with_the_pointer() {
        let mut camera = camera();
        let target = camera.target;
        camera.pan(0.1, -0.2);
        let seen = camera.place(target, 2.0).unwrap();
        assert!((seen[0] - (0.5 + 0.1 / 2.0)).abs() < 1e-9, "{seen:?}");
        assert!((seen[1] - 0.3).abs() < 1e-9, "{seen:?}");
    }

    #[test]
    fn the_camera_never_tips_over() {
        let mut camera = camera();
        camera.orbit(0.3, 100.0);
        assert!(camera.elevation < FRAC_PI_2);
        assert!(camera.ray([0.3, 0.3], 1.0).direction.iter().all(|x| x.is_finite()));
        let before = camera.distance;
        camera.zoom(2.0);
        assert!(camera.distance < before);
    }
}
