//! What is drawn on top of the cloth: discs and lines.

use cloth::{
    StrainMeasure,
    io::{PictureDust, PictureGrain, PictureLegend, PictureStrain, PictureStyle},
    wgpu::wgpu,
};

use super::FrameContents;
use crate::Gpu;

/// Which parts of the picture are on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlays {
    /// The shaded surface of the cloths.
    pub surface: bool,
    /// The edges of all triangles.
    pub wires: bool,
    /// Springs by class: stretch, shear, bend.
    pub springs: [bool; 3],
    /// Colours of the surface by the strain of springs and of triangles of fabric.
    pub strain: bool,
    /// Which strain.
    pub strain_measure: StrainMeasure,
    /// Strain shown in red.
    pub strain_scale: f64,
    /// Lines on fabric along warp and weft.
    pub threads: bool,
    /// Particles that are held.
    pub pins: bool,
    /// Particles in contact with a collider or another particle; found on the host, which fetches the state for them.
    pub contacts: bool,
    /// Cells of the grid in which near particles are looked for; found on the host, too.
    pub bins: bool,
}

impl Default for Overlays {
    fn default() -> Self {
        Self {
            surface: true,
            wires: false,
            springs: [false; 3],
            strain: false,
            strain_measure: StrainMeasure::Stretch,
            strain_scale: PictureStrain::SCALE,
            threads: false,
            pins: false,
            contacts: false,
            bins: false,
        }
    }
}

impl Overlays {
    /// What pictures in this look show on the cloth.
    #[must_use]
    pub fn of_style(style: &PictureStyle) -> Self {
        let strain = style.overlays.strain.as_ref();
        Self {
            strain: strain.is_some(),
            strain_measure: strain.map_or(StrainMeasure::Stretch, |strain| strain.measure),
            strain_scale: strain.map_or(PictureStrain::SCALE, |strain| strain.scale),
            threads: style.overlays.legend().threads,
            ..Self::default()
        }
    }

    /// What explains the colours and lines on the cloth.
    #[must_use]
    pub fn legend(self) -> PictureLegend {
        let strain = (self.strain_measure, self.strain_scale);
        PictureLegend { strain: self.strain.then_some(strain), threads: self.threads }
    }
}

/// A disc that faces the eye.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Disc {
    place: [f32; 3],
    particle: u32,
    colour: [u8; 4],
    radius: f32,
}

impl Disc {
    /// A disc at a particle, with a radius in pixels.
    #[must_use]
    pub const fn at_particle(particle: u32, colour: [u8; 4], radius: f32) -> Self {
        Self { place: [0.0; 3], particle, colour, radius }
    }

    /// A disc at a place \[m\], with a radius in pixels.
    #[must_use]
    pub fn at_place(place: [f64; 3], colour: [u8; 4], radius: f32) -> Self {
        Self { place: place.map(|x| x as f32), particle: u32::MAX, colour, radius }
    }
}

/// A line in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaceLine {
    /// Both ends.
    pub ends: [LineEnd; 2],
    /// sRGB and opacity.
    pub colour: [u8; 4],
}

/// Where a line ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LineEnd {
    /// At a place \[m\].
    Place([f64; 3]),
    /// At a particle, wherever that is.
    Particle(u32),
}

/// The streaks of dust.
pub(crate) fn dust_lines(grains: &[PictureGrain]) -> impl Iterator<Item = PlaceLine> + '_ {
    let is_seen = |grain: &&PictureGrain| {
        grain.opacity > 0.0 && grain.from.iter().chain(&grain.to).all(|x| x.is_finite())
    };
    grains.iter().filter(is_seen).map(|grain| {
        let [red, green, blue] = PictureDust::COLOUR;
        let opacity = (255.0 * grain.opacity).round() as u8;
        let ends = [grain.from, grain.to].map(LineEnd::Place);
        PlaceLine { ends, colour: [red, green, blue, opacity] }
    })
}

/// End of a line in space.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct EndVertex {
    place: [f32; 3],
    particle: u32,
    colour: [u8; 4],
}

impl EndVertex {
    fn new(end: LineEnd, colour: [u8; 4]) -> Self {
        match end {
            LineEnd::Place(place) => {
                Self { place: place.map(|x| x as f32), particle: u32::MAX, colour }
            }
            LineEnd::Particle(particle) => Self { place: [0.0; 3], particle, colour },
        }
    }
}

/// The overlays of one picture on the device.
#[derive(Default)]
pub(super) struct OverlayBuffers {
    discs: Option<wgpu::Buffer>,
    disc_count: u32,
    lines: Option<wgpu::Buffer>,
    end_count: u32,
}

impl OverlayBuffers {
    pub(super) fn update(&mut self, gpu: &Gpu, contents: &FrameContents) {
        let lines = contents.lines.iter();
        let ends = lines.flat_map(|line| line.ends.map(|end| EndVertex::new(end, line.colour)));
        let ends: Vec<EndVertex> = ends.collect();
        self.disc_count = fill(gpu, &mut self.discs, "discs", &contents.discs);
        self.end_count = fill(gpu, &mut self.lines, "lines", &ends);
    }

    pub(super) fn draw_lines(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(lines) = self.lines.as_ref().filter(|_| self.end_count > 0) {
            pass.set_vertex_buffer(0, lines.slice(..));
            pass.draw(0..self.end_count, 0..1);
        }
    }

    pub(super) fn draw_discs(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(discs) = self.discs.as_ref().filter(|_| self.disc_count > 0) {
            pass.set_vertex_buffer(0, discs.slice(..));
            pass.draw(0..4, 0..self.disc_count);
        }
    }
}

/// Puts `values` into a buffer that grows as needed; their number.
pub(super) fn fill<T: bytemuck::NoUninit>(
    gpu: &Gpu,
    buffer: &mut Option<wgpu::Buffer>,
    label: &str,
    values: &[T],
) -> u32 {
    let bytes: &[u8] = bytemuck::cast_slice(values);
    if bytes.is_empty() {
        return 0;
    }
    match buffer {
        Some(buffer) if buffer.size() >= bytes.len() as u64 => {
            gpu.queue.write_buffer(buffer, 0, bytes);
        }
        _ => *buffer = Some(gpu.buffer(label, values, wgpu::BufferUsages::VERTEX)),
    }
    values.len() as u32
}

/// An opaque colour.
pub(crate) const fn colour_bytes([red, green, blue]: [u8; 3]) -> [u8; 4] {
    [red, green, blue, 255]
}

/// sRGB to linear light.
pub(super) fn colour_linear(srgb: [u8; 3]) -> [u8; 4] {
    let linear = srgb.map(|channel| {
        let c = f64::from(channel) / 255.0;
        let light = if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
        (light * 255.0).round() as u8
    });
    colour_bytes(linear)
}
