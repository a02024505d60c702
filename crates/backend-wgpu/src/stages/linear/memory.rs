//! The memory of the linear system.

use cloth_core::Result;

use super::{CALLS_MAX, Stages};
use crate::{
    buffers::{VECTOR_SIZE, uniform_stride},
    dispatch::PARTIALS_MAX,
    forms,
    layout::{Call, Solve},
    linear::{VECTOR_COPIES, VECTOR_COUNT},
    tables::{links::LinkTables, spring_kinds},
};

/// Bytes of the constraint of a particle (`shared/constraint.wgsl`).
pub(super) const CONSTRAINT_SIZE: u64 = 240;

impl Stages {
    /// Takes the memory, if it is not there yet.
    pub(in crate::stages) fn linear_prepare(&mut self) -> Result<()> {
        if self.buffers.has("solve") {
            return Ok(());
        }
        let particles = self.model.particle_count() as u64;
        let links = LinkTables::new(&self.model);
        let kinds = spring_kinds(&self.model);
        let calls = uniform_stride(&self.context.limits, size_of::<Call>()) * CALLS_MAX as u64;
        let memory = self.context.limits.max_compute_workgroup_storage_size;
        let at_once = forms::iteration(&self.model, &self.config, &links, memory).is_ok();
        self.solve_reach = at_once.then_some(links.reach);
        let copies = if at_once { VECTOR_COPIES } else { 0 };
        let mut zeroed = vec![
            ("vectors", (VECTOR_COUNT + copies) * VECTOR_SIZE * particles),
            ("factors", VECTOR_SIZE * links.places as u64),
            ("matrix_base", 2 * VECTOR_SIZE * particles),
            ("matrix_diagonal", 2 * VECTOR_SIZE * particles),
            ("inverse", 2 * VECTOR_SIZE * particles),
            ("partials", 4 * 8 * u64::from(PARTIALS_MAX)),
            ("call", calls),
        ];
        for name in super::super::motion::KEPT {
            if !self.buffers.has(name) {
                zeroed.push((name, VECTOR_SIZE * particles));
            }
        }
        if !self.model.colliders().is_empty() {
            zeroed.push(("constraints", CONSTRAINT_SIZE * particles));
        }
        for (name, size) in zeroed {
            self.buffers.create(&self.context, name, size, None)?;
        }
        for (name, contents) in [
            ("link_rows", bytemuck::cast_slice(&links.rows)),
            ("link_entries", bytemuck::cast_slice(&links.entries)),
            ("link_kinds", bytemuck::cast_slice(&links.kinds)),
            ("spring_kinds", bytemuck::cast_slice(&kinds)),
        ] {
            let contents: &[u8] = contents;
            self.buffers.create(&self.context, name, contents.len() as u64, Some(contents))?;
        }
        self.contact_factors_create()?;
        self.fabric_linear_prepare()?;
        self.buffers.create(&self.context, "solve", size_of::<Solve>() as u64, None)
    }

    /// Takes memory for as many pairs as the rows of partners have room for.
    pub(in crate::stages) fn contact_factors_create(&mut self) -> Result<()> {
        let is_penalty = self.is_penalty();
        let entries = self.contact.as_ref().map(|policy| u64::from(policy.sizes.entries));
        match entries.filter(|_| is_penalty) {
            Some(entries) => {
                self.buffers.create(&self.context, "contact_factors", VECTOR_SIZE * entries, None)
            }
            None => Ok(()),
        }
    }
}
