//! What the outside does to a running simulation.

use crate::{Model, ModelError, Pose, State, error::finite_all};

/// Inputs that hold from the next frame on, until they are changed.
///
/// An empty control changes nothing: pins stay where they are held, colliders keep their pose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Control {
    /// Changes to single particles; later entries win.
    pub pins: Vec<PinControl>,
    /// Targets of colliders; later entries win.
    pub colliders: Vec<ColliderControl>,
    /// Wind velocity \[m/s\] in place of the model's.
    pub wind_velocity: Option<[f64; 3]>,
}

/// What to do with one particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PinControl {
    /// Index of the particle in the composite model.
    pub particle: u32,
    /// The change.
    pub action: PinAction,
}

/// A change to one particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PinAction {
    /// Hold the particle where it is now.
    Hold,
    /// Hold the particle and move it in a straight line, to arrive at this place \[m\] exactly at
    /// the end of the next frame.
    MoveTo([f64; 3]),
    /// Let the particle go, with the velocity it has.
    Release,
}

/// Where a collider is to be at the end of the next frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColliderControl {
    /// Index into [`Model::colliders`].
    pub collider: u32,
    /// Pose at the end of the next frame; the way there is travelled at constant velocity.
    pub pose: Pose,
}

impl Control {
    /// What holds for a part of the time: whatever moves gets `fraction` of its way from where it is in `state`. Pins are
    /// held and released in the first part alone.
    #[must_use]
    pub fn part(&self, state: &State, fraction: f64, is_first: bool) -> Self {
        let mut part = self.clone();
        part.pins.retain(|pin| is_first || matches!(pin.action, PinAction::MoveTo(_)));
        for pin in &mut part.pins {
            let start = state.positions.get(pin.particle as usize);
            if let (PinAction::MoveTo(target), Some(start)) = (&mut pin.action, start) {
                *target = std::array::from_fn(|k| start[k] + fraction * (target[k] - start[k]));
            }
        }
        for collider in &mut part.colliders {
            if let Some(start) = state.colliders.get(collider.collider as usize) {
                collider.pose = start.interpolate(&collider.pose, fraction);
            }
        }
        part
    }

    /// Checks every index against the model and every number for being finite.
    ///
    /// # Errors
    /// [`ModelError::PinOutOfRange`], [`ModelError::OutOfRange`] for a collider index, or
    /// [`ModelError::NonFinite`].
    pub fn validate(&self, model: &Model) -> Result<(), ModelError> {
        let particles = model.particle_count();
        for pin in &self.pins {
            if pin.particle as usize >= particles {
                return Err(ModelError::PinOutOfRange {
                    owner: "control".into(),
                    pin: pin.particle,
                    particles,
                });
            }
            if let PinAction::MoveTo(target) = &pin.action {
                finite_all(|| format!("target of pin {}", pin.particle), target)?;
            }
        }
        for control in &self.colliders {
            if control.collider as usize >= model.colliders().len() {
                return Err(ModelError::OutOfRange {
                    what: "index of a controlled collider".into(),
                    value: f64::from(control.collider),
                    min: 0.0,
                    max: model.colliders().len() as f64 - 1.0,
                });
            }
            control.pose.validate(|| format!("target pose of collider {}", control.collider))?;
        }
        if let Some(wind) = &self.wind_velocity {
            finite_all(|| "wind velocity".into(), wind)?;
        }
        Ok(())
    }
}
