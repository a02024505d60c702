//! The texture that is drawn into.

use cloth::wgpu::wgpu;
use image::RgbImage;

use super::SAMPLES;
use crate::{Gpu, ViewerError};

/// Format of pictures: bytes as files and screens have them, encoded by the shaders.
pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Format of depth.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A picture on the device.
#[derive(Debug)]
pub struct RenderTarget {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    samples: wgpu::TextureView,
    depth: wgpu::TextureView,
    size: [u32; 2],
}

impl RenderTarget {
    /// A picture of this width and height \[pixel\].
    ///
    /// # Errors
    /// [`ViewerError::PictureSize`] for sides of zero or above what the device allows.
    pub fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, ViewerError> {
        let [width, height] = size;
        let limit = gpu.device.limits().max_texture_dimension_2d;
        if !size.iter().all(|side| (1..=limit).contains(side)) {
            return Err(ViewerError::PictureSize { width, height, limit });
        }
        let texture = |format, sample_count, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let picture = texture(
            FORMAT,
            1,
            wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::TEXTURE_BINDING,
        );
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        Ok(Self {
            view: view(&picture),
            samples: view(&texture(FORMAT, SAMPLES, wgpu::TextureUsages::empty())),
            depth: view(&texture(DEPTH_FORMAT, SAMPLES, wgpu::TextureUsages::empty())),
            texture: picture,
            size,
        })
    }

    /// Width and height \[pixel\].
    #[must_use]
    pub const fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The finished picture, to show it.
    #[must_use]
    pub const fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    pub(super) const fn samples(&self) -> &wgpu::TextureView {
        &self.samples
    }

    pub(super) const fn depth(&self) -> &wgpu::TextureView {
        &self.depth
    }

    /// The picture as it is now; waits for the device.
    ///
    /// # Errors
    /// [`ViewerError::Device`] if the device is lost.
    pub fn read(&self, gpu: &Gpu) -> Result<RgbImage, ViewerError> {
        let [width, height] = self.size;
        let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.empty_buffer(
            "picture",
            u64::from(row) * u64::from(height),
            wgpu::BufferUsages::MAP_READ,
        );
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            self.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            self.texture.size(),
        );
        gpu.queue.submit([encoder.finish()]);
        gpu.mapped(&buffer, buffer.size(), |bytes| {
            RgbImage::from_fn(width, height, |x, y| {
                let start = (y * row + 4 * x) as usize;
                image::Rgb([bytes[start], bytes[start + 1], bytes[start + 2]])
            })
        })
    }
}
