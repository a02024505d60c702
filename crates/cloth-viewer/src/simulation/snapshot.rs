//! A frame on its way from the simulation to the window.

use std::{sync::Arc, time::Duration};

use cloth::{
    Model, StepReport,
    io::{PictureGrain, PictureSolid},
};

use crate::{
    FrameBuffers, FrameContents, Gpu, LineEnd, Overlays,
    renderer::{Disc, PlaceLine, colour_bytes, dust_lines},
};

use super::KeptView;

/// All that the window needs of one frame.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Number of the frame.
    pub frame: u64,
    /// Simulated time \[s\].
    pub time: f64,
    /// Positions and normals on the device.
    pub buffers: Arc<FrameBuffers>,
    /// Colliders at that time.
    pub shapes: Vec<PictureSolid>,
    /// Dust in the air.
    pub dust: Vec<PictureGrain>,
    /// Particles that are held.
    pub held: Vec<u32>,
    /// Particles in contact, if they were asked for.
    pub contacts: Vec<u32>,
    /// Edges of occupied cells, if they were asked for.
    pub bins: Vec<PlaceLine>,
    /// The hold on the cloth, if there is one.
    pub grab: Option<GrabView>,
    /// What the solver did; empty for recorded frames.
    pub report: StepReport,
    /// Time that the frame took to compute.
    pub duration: Duration,
    /// Simulated time over the time that passed on the clock.
    pub real_time_factor: f64,
    /// Whether the simulation waits.
    pub paused: bool,
    /// Number of recorded frames, if they are.
    pub recorded: Option<usize>,
    /// Which frames of a scene in progress are kept, if they are to be.
    pub kept: Option<KeptView>,
    /// Whether the simulation is farther than this frame.
    pub is_past: bool,
}

/// A hold on the cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrabView {
    /// The particle.
    pub particle: u32,
    /// Where it was when the frame was done \[m\], if the host knows: with the backend `wgpu` it does not.
    pub position: Option<[f64; 3]>,
    /// Where it is pulled \[m\].
    pub target: [f64; 3],
}

/// Colours of discs and of the spring of the pointer.
const HELD: [u8; 3] = [250, 210, 60];
const CONTACT: [u8; 3] = [240, 90, 40];
const GRABBED: [u8; 3] = [60, 220, 250];

impl Snapshot {
    /// What is drawn of this frame.
    #[must_use]
    pub fn contents(&self, overlays: Overlays) -> FrameContents {
        let mut discs = Vec::new();
        if overlays.contacts {
            let colour = colour_bytes(CONTACT);
            discs.extend(self.contacts.iter().map(|&p| Disc::at_particle(p, colour, 2.5)));
        }
        if overlays.pins {
            let colour = colour_bytes(HELD);
            discs.extend(self.held.iter().map(|&p| Disc::at_particle(p, colour, 5.0)));
        }
        let mut lines = if overlays.bins { self.bins.clone() } else { Vec::new() };
        lines.extend(dust_lines(&self.dust));
        if let Some(grab) = self.grab {
            let colour = colour_bytes(GRABBED);
            discs.push(Disc::at_particle(grab.particle, colour, 6.0));
            discs.push(Disc::at_place(grab.target, colour, 4.0));
            let ends = [LineEnd::Particle(grab.particle), LineEnd::Place(grab.target)];
            lines.push(PlaceLine { ends, colour });
        }
        FrameContents { shapes: self.shapes.clone(), discs, lines, overlays }
    }
}

/// Buffers that take turns: one is drawn while the next one is filled.
#[derive(Default)]
pub(super) struct FramePool {
    buffers: Vec<Arc<FrameBuffers>>,
    particle_count: usize,
}

impl FramePool {
    /// Buffers that nobody holds.
    pub(super) fn take(&mut self, gpu: &Gpu, particle_count: usize) -> Arc<FrameBuffers> {
        if self.particle_count != particle_count {
            self.buffers.clear();
            self.particle_count = particle_count;
        }
        // What was submitted before with these buffers is done before they are filled: it is one queue.
        if let Some(free) = self.buffers.iter().find(|buffers| Arc::strong_count(buffers) == 1) {
            return Arc::clone(free);
        }
        let buffers = Arc::new(FrameBuffers::new(gpu, particle_count));
        self.buffers.push(Arc::clone(&buffers));
        buffers
    }
}

/// Side of the cells in which near particles are looked for \[m\].
pub(super) fn cell_side(model: &Model) -> f64 {
    let rest_length =
        || model.springs().kinds().iter().map(|kind| kind.rest_length).fold(1e-3, f64::max);
    model.self_contact().map_or_else(rest_length, |contact| contact.distance)
}
