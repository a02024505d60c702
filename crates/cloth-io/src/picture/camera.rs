//! Where a picture is seen from.

use glam::{DVec3, Vec3, Vec4};

use super::PictureError;

/// A perspective camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position of the camera \[m\].
    pub eye: [f64; 3],
    /// Point in the middle of the picture \[m\].
    pub target: [f64; 3],
    /// Direction that is up in the picture.
    pub up: [f64; 3],
    /// Angle between the lower and the upper edge of the picture \[rad\].
    pub vertical_field_of_view: f64,
}

impl Camera {
    /// A camera that looks at all of `bounds` from the front, a little from the right and from
    /// above. `aspect` is the width of the picture divided by its height.
    #[must_use]
    pub fn fit(bounds: &Bounds, aspect: f64) -> Self {
        let vertical_field_of_view = 32f64.to_radians();
        let Some((center, half)) = bounds.center_and_half_extents() else {
            return Self::fit(&Bounds::of(&[[-0.5; 3], [0.5; 3]]), aspect);
        };
        let backward = DVec3::new(0.42, -1.0, 0.42).normalize();
        let right = DVec3::Z.cross(backward).normalize();
        let up = backward.cross(right);
        let slope_up = (0.5 * vertical_field_of_view).tan();
        let slope_right = slope_up * aspect.max(1e-3);
        // The distance from which each corner of the box is inside the picture.
        let mut distance = 1e-3f64;
        for corner in 0..8 {
            let sign = |bit: usize| if corner & bit == 0 { -1.0 } else { 1.0 };
            let corner = half * DVec3::new(sign(1), sign(2), sign(4));
            let needed_up = corner.dot(up).abs() / slope_up;
            let needed_right = corner.dot(right).abs() / slope_right;
            distance = distance.max(corner.dot(backward) + needed_up.max(needed_right));
        }
        let margin = 1.1;
        Self {
            eye: (center + backward * distance * margin).to_array(),
            target: center.to_array(),
            up: [0.0, 0.0, 1.0],
            vertical_field_of_view,
        }
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest coordinates \[m\].
    pub min: [f64; 3],
    /// Highest coordinates \[m\].
    pub max: [f64; 3],
}

impl Bounds {
    /// The box of nothing.
    pub const EMPTY: Self = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    /// The smallest box around `positions` \[m\]; positions that are not finite are skipped.
    #[must_use]
    pub fn of(positions: &[[f64; 3]]) -> Self {
        let finite = |position: &&[f64; 3]| position.iter().all(|x| x.is_finite());
        let point = |&position: &[f64; 3]| Self { min: position, max: position };
        let points = positions.iter().filter(finite).map(point);
        points.fold(Self::EMPTY, |bounds, point| bounds.union(&point))
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: DVec3::from(self.min).min(other.min.into()).to_array(),
            max: DVec3::from(self.max).max(other.max.into()).to_array(),
        }
    }

    /// Middle and half of the size, unless the box is empty.
    pub(super) fn center_and_half_extents(&self) -> Option<(DVec3, DVec3)> {
        let (min, max) = (DVec3::from(self.min), DVec3::from(self.max));
        let (center, half) = (0.5 * (min + max), 0.5 * (max - min));
        (min.cmple(max).all() && center.is_finite() && half.is_finite()).then_some((center, half))
    }
}

/// A camera prepared for a picture. Its coordinates are relative to the target of the camera, so
/// that single precision is enough wherever the scene lies.
pub(super) struct View {
    pub(super) origin: DVec3,
    pub(super) eye: Vec3,
    pub(super) backward: Vec3,
    pub(super) right: Vec3,
    pub(super) up: Vec3,
    pub(super) width: u32,
    pub(super) height: u32,
    /// Rightward and upward slope of rays at the edges of the picture.
    slope: [f32; 2],
}

impl View {
    pub(super) fn new(camera: &Camera, width: u32, height: u32) -> Result<Self, PictureError> {
        let fail = |problem| Err(PictureError::Camera { problem });
        let origin = DVec3::from(camera.target);
        let offset = DVec3::from(camera.eye) - origin;
        let angle = camera.vertical_field_of_view;
        if !(offset.is_finite() && offset.length() > 0.0) {
            return fail("eye and target are the same point or not finite");
        }
        if !(angle > 0.0 && angle < 3.1) {
            return fail("the field of view is not between 0 and 3.1 rad");
        }
        let backward = offset.normalize();
        let right = DVec3::from(camera.up).cross(backward);
        if !(right.is_finite() && right.length() > 1e-9) {
            return fail("the up vector is zero or along the line of sight");
        }
        let right = right.normalize();
        let slope = (0.5 * angle).tan();
        Ok(Self {
            origin,
            eye: offset.as_vec3(),
            backward: backward.as_vec3(),
            right: right.as_vec3(),
            up: backward.cross(right).as_vec3(),
            width,
            height,
            slope: [(slope * f64::from(width) / f64::from(height)) as f32, slope as f32],
        })
    }

    /// Half of the height that the picture shows where the camera looks at \[m\].
    pub(super) fn half_height(&self) -> f32 {
        self.slope[1] * self.eye.length()
    }

    /// The point `position` \[m\] in the coordinates of the view.
    pub(super) fn local(&self, position: [f64; 3]) -> Vec3 {
        (DVec3::from(position) - self.origin).as_vec3()
    }

    /// Direction of the ray through column `x` and row `y` of the picture \[pixel\], not
    /// normalised.
    pub(super) fn ray(&self, x: f32, y: f32) -> Vec3 {
        let right = (2.0 * x / self.width as f32 - 1.0) * self.slope[0];
        let up = (1.0 - 2.0 * y / self.height as f32) * self.slope[1];
        right * self.right + up * self.up - self.backward
    }

    /// Projects a point to clip space.
    pub(super) fn clip(&self, point: Vec3) -> Vec4 {
        // The depth range only clips: nearer and farther than this nothing is seen.
        let distance = self.eye.length();
        let (near, far) = (1e-3 * distance, 1e3 * distance);
        let from_eye = point - self.eye;
        let depth = -from_eye.dot(self.backward);
        let scale = (far + near) / (far - near);
        Vec4::new(
            from_eye.dot(self.right) / self.slope[0],
            from_eye.dot(self.up) / self.slope[1],
            scale * depth - 2.0 * far * near / (far - near),
            depth,
        )
    }
}
