//! What the outside does to a running simulation.

use std::collections::BTreeMap;

use crate::{
    Model, ModelError, Pose,
    error::{finite_all, not_negative},
};

/// Inputs that hold from the next frame on, until they are changed.
///
/// An empty control changes nothing: pins stay where they are held, colliders keep their pose, forces go on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Control {
    /// Changes to single particles; later entries win.
    pub pins: Vec<PinControl>,
    /// Targets of colliders; later entries win.
    pub colliders: Vec<ColliderControl>,
    /// Wind velocity \[m/s\] in place of the model's.
    pub wind_velocity: Option<[f64; 3]>,
    /// Forces on single particles in place of those given before; later entries for a particle win. An
    /// empty list ends them.
    pub forces: Option<Vec<ForceControl>>,
    /// How far all anchors are to be, at the end of the next frame, from where they were given \[m\]; the way
    /// there is travelled at constant velocity. Forces given anew start without any.
    pub anchor_offset: Option<[f64; 3]>,
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
    /// The same, to arrive at a place this far from where it is now \[m\].
    MoveBy([f64; 3]),
    /// Let the particle go, with the velocity it has.
    Release,
}

impl PinAction {
    /// Whether it moves the particle.
    #[must_use]
    pub const fn moves(&self) -> bool {
        matches!(self, Self::MoveTo(_) | Self::MoveBy(_))
    }
}

/// Where a collider is to be at the end of the next frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColliderControl {
    /// Index into [`Model::colliders`].
    pub collider: u32,
    /// Pose at the end of the next frame; the way there is travelled at constant velocity.
    pub pose: Pose,
}

/// A force on one particle, and a spring from it to a place (NUMERICS §3). A particle that is held
/// does not feel it.
///
/// The spring is taken at the end of each substep, so that no stiffness makes it unstable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceControl {
    /// Index of the particle in the composite model.
    pub particle: u32,
    /// Constant force \[N\].
    pub force: [f64; 3],
    /// A spring that pulls it besides.
    pub spring: Option<AnchorSpring>,
}

/// A spring without rest length between a particle and a place, its anchor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnchorSpring {
    /// The place.
    pub anchor: Anchor,
    /// Stiffness \[N/m\].
    pub stiffness: f64,
    /// Damping of the velocity of the particle \[N s/m\].
    pub damping: f64,
    /// Longest distance from the anchor that counts \[m\]: farther away the spring pulls as hard as there. Infinite for a
    /// spring without such a bound.
    pub reach: f64,
}

/// Where a spring is anchored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    /// Where the particle is when the next frame starts.
    Here,
    /// At this place \[m\].
    At([f64; 3]),
}

/// Where everything that moves is at the start of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlStart<'a> {
    /// Positions \[m\] of the particles that move.
    pub positions: &'a BTreeMap<u32, [f64; 3]>,
    /// Poses of all colliders.
    pub colliders: &'a [Pose],
    /// How far anchors are from where they were given \[m\].
    pub anchor_offset: [f64; 3],
}

impl Control {
    /// What holds for a part of the time: whatever moves gets `fraction` of its way from where it is at the `start` of all
    /// parts. Pins are held and released, and forces given, in the first part alone.
    #[must_use]
    pub fn part(&self, start: &ControlStart<'_>, fraction: f64, is_first: bool) -> Self {
        let mut part = self.clone();
        part.pins.retain(|pin| is_first || pin.action.moves());
        part.forces = part.forces.filter(|_| is_first);
        if let Some(offset) = &mut part.anchor_offset {
            let from = if self.forces.is_some() { [0.0; 3] } else { start.anchor_offset };
            *offset = std::array::from_fn(|k| from[k] + fraction * (offset[k] - from[k]));
        }
        for pin in &mut part.pins {
            let Some(start) = start.positions.get(&pin.particle) else { continue };
            let way: [f64; 3] = match pin.action {
                PinAction::MoveTo(target) => std::array::from_fn(|k| target[k] - start[k]),
                PinAction::MoveBy(way) => way,
                PinAction::Hold | PinAction::Release => continue,
            };
            let target = std::array::from_fn(|k| start[k] + fraction * way[k]);
            pin.action = PinAction::MoveTo(target);
        }
        for collider in &mut part.colliders {
            if let Some(start) = start.colliders.get(collider.collider as usize) {
                collider.pose = start.interpolate(&collider.pose, fraction);
            }
        }
        part
    }

    /// Checks every index against the model and every number for being finite.
    ///
    /// # Errors
    /// [`ModelError::PinOutOfRange`], [`ModelError::ForceOutOfRange`], [`ModelError::OutOfRange`] for a
    /// collider index, [`ModelError::NonFinite`], or [`ModelError::Negative`] for a spring.
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
            if let PinAction::MoveTo(target) | PinAction::MoveBy(target) = &pin.action {
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
        if let Some(offset) = &self.anchor_offset {
            finite_all(|| "offset of the anchors".into(), offset)?;
        }
        self.forces.iter().flatten().try_for_each(|force| force.validate(particles))
    }
}

impl ForceControl {
    fn validate(&self, particles: usize) -> Result<(), ModelError> {
        let &Self { particle, ref force, spring } = self;
        if particle as usize >= particles {
            return Err(ModelError::ForceOutOfRange { particle, particles });
        }
        finite_all(|| format!("force on particle {particle}"), force)?;
        let Some(AnchorSpring { anchor, stiffness, damping, reach }) = spring else {
            return Ok(());
        };
        let of = |what: &str| format!("{what} of the spring on particle {particle}");
        if let Anchor::At(place) = anchor {
            finite_all(|| of("anchor"), &place)?;
        }
        not_negative(|| of("stiffness"), stiffness)?;
        not_negative(|| of("damping"), damping)?;
        if reach == f64::INFINITY {
            Ok(())
        } else {
            not_negative(|| of("reach"), reach).map(|_| ())
        }
    }
}
