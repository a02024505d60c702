//! Maps of depths seen from a light, which tell what is in its shadow.

use glam::{Vec2, Vec3};

use super::camera::View;
use super::geometry::Geometry;
use super::raster::Visibility;

/// Side of the map of the strong light \[texel\].
const KEY_SIZE: usize = 1536;

/// Depths seen from a far light.
pub(super) struct ShadowMap {
    /// Unit vector towards the light.
    pub(super) direction: Vec3,
    right: Vec3,
    up: Vec3,
    center: Vec3,
    radius: f32,
    size: usize,
    nearness: Vec<f32>,
}

impl ShadowMap {
    /// The map of the strong light, which comes over the left shoulder of the viewer.
    pub(super) fn of_key_light(geometry: &Geometry, view: &View) -> Self {
        let level = Vec3::new(view.backward.x, view.backward.y, 0.0).normalize_or(Vec3::NEG_Y);
        let direction = (Vec3::Z * 1.25 + level * 0.62 - view.right * 0.75).normalize();
        Self::new(geometry, direction, KEY_SIZE)
    }

    /// The map of a light in `direction`, a unit vector, of `size` \[texel\].
    pub(super) fn new(geometry: &Geometry, direction: Vec3, size: usize) -> Self {
        let (right, up) = direction.any_orthonormal_pair();
        let mut map = Self {
            direction,
            right,
            up,
            center: geometry.center,
            radius: 1.02 * geometry.radius,
            size,
            nearness: Vec::new(),
        };
        let vertices: Vec<_> = geometry.positions.iter().map(|&p| map.local(p)).collect();
        let clip: Vec<_> = vertices.iter().map(|p| p.with_z(-p.z).extend(1.0)).collect();
        let casters = &geometry.triangles[..geometry.caster_count];
        map.nearness = Visibility::new(&clip, casters, [size; 2], |clip| -clip.z).nearness;
        map
    }

    /// Rightward, upward and towards the light, from -1 to 1 within the map.
    fn local(&self, point: Vec3) -> Vec3 {
        let from_center = (point - self.center) / self.radius;
        Vec3::new(
            from_center.dot(self.right),
            from_center.dot(self.up),
            from_center.dot(self.direction),
        )
    }

    /// How much of the light reaches `point`, from 0 to 1, softened over `reach` texels.
    pub(super) fn lit(&self, point: Vec3, normal: Vec3, reach: i32) -> f32 {
        let texel = 2.0 / self.size as f32;
        // A surface must not shadow itself: step out of it by what the softening spans.
        let step = texel * self.radius * (1.0 + reach as f32);
        let local = self.local(point + step * normal);
        let bias = 0.5 * texel;
        let place = (Vec2::new(local.x, -local.y) * 0.5 + 0.5) * self.size as f32 - 0.5;
        let floor = place.floor();
        let part = place - floor;
        let (column, row) = (floor.x as i32, floor.y as i32);
        let mut lit = 0.0;
        let mut total = 0.0;
        // Inner texels weigh fully, the outermost by how far the softening reaches into them.
        let weight = |offset: i32, part: f32| match offset {
            offset if offset == 1 - reach => 1.0 - part,
            offset if offset == reach => part,
            _ => 1.0,
        };
        for y in 1 - reach..=reach {
            let row_weight = weight(y, part.y);
            for x in 1 - reach..=reach {
                let weight = row_weight * weight(x, part.x);
                total += weight;
                if self.nearness_at(column.saturating_add(x), row.saturating_add(y))
                    <= local.z + bias
                {
                    lit += weight;
                }
            }
        }
        lit / total
    }

    fn nearness_at(&self, column: i32, row: i32) -> f32 {
        let size = self.size as i32;
        if (0..size).contains(&column) && (0..size).contains(&row) {
            self.nearness[row as usize * self.size + column as usize]
        } else {
            f32::NEG_INFINITY
        }
    }
}
