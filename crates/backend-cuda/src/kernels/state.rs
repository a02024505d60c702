//! State in and out.

use cloth_core::{PinWrite, Result, State};

use super::CudaKernels;
use crate::{
    layout::{CudaReal, PinData, Real4},
    memory::Memory,
    queue::{Launch, argument},
};

impl<T: CudaReal> CudaKernels<T> {
    pub(super) fn state_upload(&mut self, state: &State) -> Result<()> {
        state.validate(&self.model)?;
        self.settle()?;
        self.memory.data.start_position = 0;
        let masses = self.model.masses();
        let position: Vec<Real4<T>> = state
            .positions
            .iter()
            .zip(&state.held)
            .zip(masses)
            .map(|((x, &held), &mass)| {
                let [x, y, z] = x.map(T::from_f64);
                let inverse = if held == 0 { T::ONE / T::from_f64(mass) } else { T::ZERO };
                [x, y, z, inverse]
            })
            .collect();
        let velocity: Vec<Real4<T>> = state
            .velocities
            .iter()
            .zip(masses)
            .map(|(v, &mass)| [v[0], v[1], v[2], mass].map(T::from_f64))
            .collect();
        let present = self.memory.present();
        self.memory.state.write(&self.memory.queue, present, &position, &velocity)?;
        self.semi_implicit.held_set(&state.held);
        if let Some(triangles) = &mut self.triangles {
            triangles.state_given(&self.model, state);
        }
        self.memory.status.reset(&self.memory.queue)
    }

    pub(super) fn state_download(&mut self, out: &mut State) -> Result<()> {
        self.settle()?;
        let present = self.memory.present();
        let mut read = Vec::new();
        self.memory.state.position[present].read(&self.memory.queue, &mut read)?;
        let vector = |&[x, y, z, _]: &Real4<T>| [x, y, z].map(T::to_f64);
        out.positions.clear();
        out.positions.extend(read.iter().map(vector));
        out.held.clear();
        out.held.extend(read.iter().map(|entry| u8::from(entry[3] == T::ZERO)));
        self.memory.state.velocity[present].read(&self.memory.queue, &mut read)?;
        out.velocities.clear();
        out.velocities.extend(read.iter().map(vector));
        match &self.triangles {
            Some(triangles) => triangles.set().slips_read(&mut out.slips),
            None => out.slips.clear(),
        }
        self.triangle_ghosts(&mut out.ghosts);
        Ok(())
    }

    /// The vectors in the memory of the forces.
    pub(super) fn vectors_download(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        let mut read = Vec::new();
        self.memory.state.force.read(&self.memory.queue, &mut read)?;
        out.clear();
        out.extend(read.iter().map(|&[x, y, z, _]| [x, y, z].map(T::to_f64)));
        Ok(())
    }

    pub(super) fn pins_upload(&mut self, pins: &[PinWrite]) -> Result<()> {
        self.settle()?;
        for pin in pins {
            self.semi_implicit.held_write(pin.particle, pin.held);
        }
        let data: Vec<PinData<T>> = pins
            .iter()
            .map(|pin| PinData {
                particle: pin.particle,
                flags: u32::from(pin.held)
                    | u32::from(pin.position.is_some()) << 1
                    | u32::from(pin.velocity.is_some()) << 2,
                position: pin.position.unwrap_or_default().map(T::from_f64),
                velocity: pin.velocity.unwrap_or_default().map(T::from_f64),
            })
            .collect();
        self.memory.inputs.pins.write_growing(&self.memory.queue, &data)?;
        let (address, count) = (self.memory.inputs.pins.address(), data.len() as u32);
        let arguments = [argument(&address), argument(&count)];
        self.start(("pins_write", "pins_write"), Launch::over(1), &arguments)
    }

    /// Normals of all particles. They are computed into the other motion, which holds nothing.
    pub(super) fn normals_download(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        let Memory { queue, data, tables, .. } = &mut self.memory;
        tables.triangles_prepare(queue, &self.model, data)?;
        let other = 1 - self.memory.present();
        let address = self.memory.state.position[other].address();
        let launch = Launch::over(self.count());
        self.stage("vertex_normals", |kernels| {
            let name = ("vertex_normals", "vertex_normals");
            kernels.start(name, launch, &[argument(&address)])
        })?;
        let mut read = Vec::new();
        self.memory.state.position[other].read(&self.memory.queue, &mut read)?;
        out.clear();
        out.extend(read.iter().map(|&[x, y, z, _]| [x, y, z].map(T::to_f64)));
        Ok(())
    }
}
