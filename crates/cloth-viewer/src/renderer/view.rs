//! What holds for a whole picture, and the shadow map.

use cloth::wgpu::wgpu;
use glam::{
    DMat4, DVec3, Mat4,
    dcamera::rh::{proj::directx::orthographic, view::look_at_mat4},
};

use super::{ClothMesh, OrbitCamera, Overlays};

/// Direction to the sun.
const LIGHT: DVec3 = DVec3::new(-0.42, -0.52, 0.85);
/// Side of the shadow map \[texel\].
const SHADOW_SIDE: u32 = 2048;

/// `View` of the shaders.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct ViewUniform {
    clip_from_world: [[f32; 4]; 4],
    world_from_clip: [[f32; 4]; 4],
    light_from_world: [[f32; 4]; 4],
    eye: [f32; 4],
    light: [f32; 4],
    focus: [f32; 4],
    options: [f32; 4],
}

impl ViewUniform {
    pub(super) fn new(
        camera: &OrbitCamera,
        mesh: &ClothMesh,
        [width, height]: [u32; 2],
        overlays: Overlays,
    ) -> Self {
        let clip_from_world = camera.clip_from_world(f64::from(width) / f64::from(height));
        let bounds = mesh.bounds();
        let light = LIGHT.normalize();
        let four = |v: [f64; 3], w: f32| [v[0] as f32, v[1] as f32, v[2] as f32, w];
        Self {
            clip_from_world: matrix(clip_from_world),
            world_from_clip: matrix(clip_from_world.inverse()),
            light_from_world: matrix(light_from_world(bounds.center, bounds.radius, light)),
            eye: four(camera.eye(), f32::from(u8::from(overlays.strain))),
            light: four(light.to_array(), (2.0 * bounds.radius / f64::from(SHADOW_SIDE)) as f32),
            focus: four(bounds.center.to_array(), bounds.radius as f32),
            options: [
                floor_tile(bounds.radius) as f32,
                overlays.strain_scale.max(1e-6) as f32,
                width as f32,
                height as f32,
            ],
        }
    }
}

fn matrix(matrix: DMat4) -> [[f32; 4]; 4] {
    let matrix: Mat4 = matrix.as_mat4();
    matrix.to_cols_array_2d()
}

/// A box along the light around the sphere of all that throws shadows.
fn light_from_world(center: DVec3, radius: f64, light: DVec3) -> DMat4 {
    let view = look_at_mat4(center + 2.0 * radius * light, center, DVec3::Y);
    orthographic(-radius, radius, -radius, radius, 0.5 * radius, 4.0 * radius) * view
}

/// Side of the tiles of floors \[m\]: a power of ten, so that they tell the size of things.
fn floor_tile(radius: f64) -> f64 {
    10_f64.powf((0.3 * radius).max(1e-6).log10().floor())
}

/// Depth from the light.
pub(super) struct ShadowMap {
    pub(super) view: wgpu::TextureView,
    pub(super) sampler: wgpu::Sampler,
}

impl ShadowMap {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow"),
            size: wgpu::Extent3d {
                width: SHADOW_SIDE,
                height: SHADOW_SIDE,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Depth32Float,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        Self { view: texture.create_view(&Default::default()), sampler }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shadow_map_holds_the_whole_sphere() {
        let center = DVec3::new(1.0, -2.0, 0.5);
        let matrix = light_from_world(center, 1.5, LIGHT.normalize());
        for direction in [DVec3::X, DVec3::Y, DVec3::Z, LIGHT.normalize()] {
            for sign in [-1.5, 1.5] {
                let place = matrix.project_point3(center + sign * direction);
                assert!(place.x.abs() <= 1.0 && place.y.abs() <= 1.0, "{place}");
                assert!((0.0..=1.0).contains(&place.z), "{place}");
            }
        }
    }

    #[test]
    fn tiles_are_powers_of_ten() {
        assert!((floor_tile(1.2) - 0.1).abs() < 1e-12);
        assert!((floor_tile(40.0) - 10.0).abs() < 1e-9);
    }
}
