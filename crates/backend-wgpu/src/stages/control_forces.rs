//! Forces on single particles, given while a simulation runs.

use cloth_core::{Anchor, AnchorSpring, ForceControl, NewtonStart, Result, stepper::Substep};

use super::Stages;
use crate::{
    dispatch::WORKGROUP,
    layout::{CALL_ITERATE, Call, ControlForce},
};

/// What is on the device.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InEffect {
    /// Number of forces.
    count: u32,
    /// Whether there was a kick that could be taken back.
    is_kicked: bool,
}

/// The name of the buffer and of the stage.
const NAME: &str = "control_forces";
/// Bytes before the first force.
const HEADER: usize = 16;

fn data(control: &ForceControl) -> ControlForce {
    let single = |vector: [f64; 3]| vector.map(|component| component as f32);
    let none = AnchorSpring { anchor: Anchor::Here, stiffness: 0.0, damping: 0.0, reach: 0.0 };
    let spring = control.spring.unwrap_or(none);
    ControlForce {
        force: single(control.force),
        particle: control.particle,
        anchor: match spring.anchor {
            Anchor::Here => [0.0; 3],
            Anchor::At(place) => single(place),
        },
        stiffness: spring.stiffness as f32,
        damping: spring.damping as f32,
        // A shader may take for granted that no number is infinite.
        reach: (spring.reach as f32).min(f32::MAX),
        is_here: u32::from(spring.anchor == Anchor::Here),
        ..ControlForce::default()
    }
}

impl Stages {
    pub(crate) const fn has_control_forces(&self) -> bool {
        self.control_forces.count > 0
    }

    /// Puts forces in place of those before. Frames under way may have to be done again with the old ones, so that
    /// they have to be good first.
    pub(crate) fn control_forces_write(&mut self, forces: &[ForceControl]) -> Result<()> {
        self.settle()?;
        self.control_forces = InEffect { count: forces.len() as u32, is_kicked: false };
        if forces.is_empty() {
            return Ok(());
        }
        let mut contents = vec![0; HEADER];
        contents[..4].copy_from_slice(&self.control_forces.count.to_ne_bytes());
        for control in forces {
            contents.extend_from_slice(bytemuck::bytes_of(&data(control)));
        }
        self.write_growing(NAME, &contents)?;
        self.over_control_forces("control_forces_anchors", 0)
    }

    fn over_control_forces(&mut self, name: &'static str, slot: usize) -> Result<()> {
        let items = (self.control_forces.count, WORKGROUP);
        self.dispatch(NAME, name, items, self.present, (slot, 0))
    }

    pub(super) fn control_forces(&mut self, substep: &Substep) -> Result<()> {
        let slot = self.slot(substep)?;
        self.velocities_in_place()?;
        self.control_forces.is_kicked = true;
        self.over_control_forces("control_forces", slot)
    }

    pub(super) fn control_forces_restore(&mut self) -> Result<()> {
        if !self.control_forces.is_kicked {
            return Ok(());
        }
        self.velocities_in_place()?;
        self.over_control_forces("control_forces_restore", 0)
    }

    /// Adds the forces to the system.
    pub(super) fn control_forces_assemble(
        &mut self,
        substep: &Substep,
        start: NewtonStart,
    ) -> Result<()> {
        let slot = self.slot(substep)?;
        let flags = if start == NewtonStart::Iterate { CALL_ITERATE } else { 0 };
        let call = self.call(Call { flags, ..Call::default() })?;
        let items = (self.control_forces.count, WORKGROUP);
        self.dispatch(NAME, "control_forces_assemble", items, self.present, (slot, call))
    }

    /// Makes sure that the present velocities may be changed in place. The boxes around groups stay as they are.
    fn velocities_in_place(&mut self) -> Result<()> {
        let before = (self.present, self.has_boxes[self.present]);
        self.in_place()?;
        if self.present == before.0 {
            self.has_boxes[self.present] = before.1;
        }
        Ok(())
    }
}
