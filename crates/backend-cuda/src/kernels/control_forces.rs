//! Forces on single particles, given while a simulation runs.

use cloth_core::{Anchor, AnchorSpring, ForceControl, NewtonStart, Result, stepper::Substep};

use super::CudaKernels;
use crate::{
    layout::{ControlForceData, CudaReal},
    queue::{Launch, argument},
};

/// What is on the device.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ControlForces {
    /// Number of forces.
    pub(super) count: u32,
    /// Whether there was a kick that could be taken back.
    is_kicked: bool,
}

/// What the forces do in one substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kick<T> {
    step: u64,
    length: T,
    offset: [T; 3],
}

fn data<T: CudaReal>(control: &ForceControl) -> ControlForceData<T> {
    let none = AnchorSpring { anchor: Anchor::Here, stiffness: 0.0, damping: 0.0, reach: 0.0 };
    let spring = control.spring.unwrap_or(none);
    ControlForceData {
        particle: control.particle,
        is_here: u32::from(spring.anchor == Anchor::Here),
        force: control.force.map(T::from_f64),
        anchor: match spring.anchor {
            Anchor::Here => [T::ZERO; 3],
            Anchor::At(place) => place.map(T::from_f64),
        },
        stiffness: T::from_f64(spring.stiffness),
        damping: T::from_f64(spring.damping),
        reach: T::from_f64(spring.reach),
        before: [T::ZERO; 3],
    }
}

impl<T: CudaReal> CudaKernels<T> {
    /// Puts forces in place of those before.
    pub(super) fn control_forces_upload(&mut self, forces: &[ForceControl]) -> Result<()> {
        self.settle()?;
        self.control_forces = ControlForces { count: forces.len() as u32, is_kicked: false };
        if forces.is_empty() {
            return Ok(());
        }
        let data: Vec<ControlForceData<T>> = forces.iter().map(data).collect();
        let memory = &mut self.memory;
        memory.inputs.control_forces.write_growing(&memory.queue, &data)?;
        self.control_forces_start("control_forces_anchors", None)
    }

    fn control_forces_start(&mut self, name: &'static str, kick: Option<&Kick<T>>) -> Result<()> {
        let count = self.control_forces.count;
        let address = self.memory.inputs.control_forces.address();
        let mut arguments = vec![argument(&address), argument(&count)];
        if let Some(Kick { step, length, offset: [x, y, z] }) = kick {
            arguments.extend([argument(length), argument(x), argument(y), argument(z)]);
            arguments.push(argument(step));
        }
        let launch = Launch::over(count as usize);
        self.stage("control_forces", |kernels| {
            kernels.start(("control_forces", name), launch, &arguments)
        })
    }

    /// Collects a kick: it comes before the substep that is collected next, or before whatever else asks for the state.
    pub(super) fn kick_push(&mut self, substep: &Substep) -> Result<()> {
        if self.frames.kick.is_some() {
            self.settle()?;
        }
        self.control_forces.is_kicked = true;
        self.frames.kick = Some(Kick {
            step: substep.step,
            length: T::from_f64(substep.length),
            offset: substep.anchor_offset.map(T::from_f64),
        });
        Ok(())
    }

    pub(super) fn kick_run(&mut self, kick: &Kick<T>) -> Result<()> {
        self.control_forces_start("control_forces", Some(kick))
    }

    /// Adds the forces to the system.
    pub(super) fn control_forces_add(
        &mut self,
        substep: &Substep,
        start: NewtonStart,
    ) -> Result<()> {
        self.settle()?;
        let count = self.control_forces.count;
        let address = self.memory.inputs.control_forces.address();
        let length = T::from_f64(substep.length);
        let [x, y, z] = substep.anchor_offset.map(T::from_f64);
        let is_iterate = u32::from(start == NewtonStart::Iterate);
        let mut arguments = vec![argument(&address), argument(&count), argument(&length)];
        arguments.extend([argument(&x), argument(&y), argument(&z), argument(&is_iterate)]);
        let launch = Launch::over(count as usize);
        self.stage("control_forces", |kernels| {
            kernels.linear_start(("control_forces", "control_forces_assemble"), launch, &arguments)
        })
    }

    /// Takes the last kick back.
    pub(super) fn kick_restore(&mut self) -> Result<()> {
        self.settle()?;
        if !self.control_forces.is_kicked {
            return Ok(());
        }
        self.control_forces_start("control_forces_restore", None)
    }
}
