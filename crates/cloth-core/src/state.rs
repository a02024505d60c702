//! What changes from step to step.

use crate::{
    Model, ModelError, Pose,
    contact::{ContactSlip, Ghost},
    error::finite_all,
};

/// Positions and velocities of all particles at one time.
///
/// Host precision is f64 whatever a solver computes in: the conversion from f32 is exact, so that
/// a downloaded state, written to a checkpoint and uploaded again, continues with the same bits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Simulated time \[s\].
    pub time: f64,
    /// Substeps done since the start of the simulation.
    pub step: u64,
    /// Times that the adaptive time step is halved at present.
    pub time_step_halvings: u32,
    /// Good substeps in a row since it last changed, 0 while it is not halved.
    pub time_step_good: u32,
    /// Particle positions \[m\], length n.
    pub positions: Vec<[f64; 3]>,
    /// Particle velocities \[m/s\], length n.
    pub velocities: Vec<[f64; 3]>,
    /// 1 for a particle that is held at present, 0 for a free one, length n.
    pub held: Vec<u8>,
    /// Pose of each collider.
    pub colliders: Vec<Pose>,
    /// What friction between triangles remembers: how far contacts have slipped, ascending by key.
    pub slips: Vec<ContactSlip>,
    /// What bodies have pinched, ascending by particle.
    pub ghosts: Vec<Ghost>,
}

impl State {
    /// Number of particles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no particle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Checks lengths against a model, and that every number is finite.
    ///
    /// # Errors
    /// [`ModelError::LengthMismatch`] or [`ModelError::NonFinite`] with the particle.
    pub fn validate(&self, model: &Model) -> Result<(), ModelError> {
        let particles = model.particle_count();
        for (what, found, expected) in [
            ("state.positions", self.positions.len(), particles),
            ("state.velocities", self.velocities.len(), particles),
            ("state.held", self.held.len(), particles),
            ("state.colliders", self.colliders.len(), model.colliders().len()),
        ] {
            if found != expected {
                return Err(ModelError::LengthMismatch { what, found, expected });
            }
        }
        finite_all(|| "state.time".into(), &[self.time])?;
        for (i, (x, v)) in self.positions.iter().zip(&self.velocities).enumerate() {
            finite_all(|| format!("position of particle {i}"), x)?;
            finite_all(|| format!("velocity of particle {i}"), v)?;
        }
        for (i, pose) in self.colliders.iter().enumerate() {
            pose.validate(|| format!("collider {i}"))?;
        }
        for ghost in &self.ghosts {
            let particle = ghost.particle;
            if particle as usize >= particles {
                return Err(ModelError::GhostOutOfRange { particle, particles });
            }
            for anchor in &ghost.anchors {
                finite_all(|| format!("weights of ghost {particle}"), &anchor.weights)?;
                finite_all(|| format!("height of ghost {particle}"), &[anchor.height])?;
            }
        }
        for (i, slip) in self.slips.iter().enumerate() {
            finite_all(|| format!("slip of contact {i}"), &slip.slip)?;
        }
        Ok(())
    }
}
