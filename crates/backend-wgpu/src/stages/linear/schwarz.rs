//! The preconditioner `schwarz`: the host builds it from a copy of the matrix, kernels apply it.

use cloth_core::{
    GroupHierarchy, LinearOutcome, LinearVector, Preconditioner, Result,
    schwarz::{Arch, CoarseLevel, FREE, Reuse, Schwarz},
};

use super::{Stages, vectors_call};
use crate::layout::{CALL_SECOND, CALL_SOLVE, Call};

/// Words of the head and of a level, as in `shared/schwarz.wgsl`.
const HEAD_WORDS: usize = 6;
const LEVEL_WORDS: usize = 16;
/// Nodes of a run, which a workgroup smooths.
const RUN: u32 = GroupHierarchy::SMOOTHED as u32;

/// Rows of the factor of the last level, and its nodes, that a workgroup takes.
const ROWS: u32 = 16;
const NODES: u32 = 8;

/// The preconditioner as the host has it.
#[derive(Debug)]
pub(in crate::stages) struct SchwarzTables {
    schwarz: Schwarz,
    reuse: Reuse,
    /// Nodes of each level, and groups of these.
    levels: Vec<[u32; 2]>,
}

impl Stages {
    /// `preconditioner_build` of `schwarz`: anew, for other constraints, or not at all.
    pub(super) fn schwarz_build(&mut self) -> Result<()> {
        self.linear_prepare()?;
        let mut tables = match self.schwarz.take() {
            Some(tables) => tables,
            None => Box::new(SchwarzTables {
                schwarz: Schwarz::new(GroupHierarchy::new(&self.model)),
                reuse: Reuse::default(),
                levels: Vec::new(),
            }),
        };
        let built = self.schwarz_update(&mut tables);
        self.schwarz = Some(tables);
        built
    }

    fn schwarz_update(&mut self, tables: &mut SchwarzTables) -> Result<()> {
        if tables.reuse.wants_build() {
            tables.schwarz.build(&self.matrix_copy()?, Arch::new());
        } else {
            // Particles are held by command alone otherwise, which a frame begins with.
            if self.model.colliders().is_empty() {
                return Ok(());
            }
            let filters = self.filters_read()?;
            if !tables.schwarz.is_outdated(|particle| filters[particle as usize].unwrap_or(FREE)) {
                return Ok(());
            }
            tables.schwarz.update(&self.matrix_copy()?, Arch::new());
        }
        let schwarz = &tables.schwarz;
        let groups = |level: &CoarseLevel| level.starts().len().saturating_sub(1) as u32;
        let size = |level: &CoarseLevel| [level.matrix().len() as u32, groups(level)];
        tables.levels = schwarz.levels().iter().map(size).collect();
        let nodes: u32 = tables.levels.iter().map(|[nodes, _]| nodes).sum();
        self.write_growing("schwarz_tables", bytemuck::cast_slice(&words(schwarz)))?;
        let levels = schwarz.levels().iter();
        let factors: Vec<&[f32]> = levels.map(|level| level.factors().rows()).collect();
        let room = factors.iter().map(|rows| size_of_val(*rows) as u64).sum();
        let mut offset = 0;
        for rows in factors {
            let bytes = bytemuck::cast_slice(rows);
            match offset {
                0 => self.write_growing_to("schwarz_factors", bytes, room)?,
                _ => self.write("schwarz_factors", offset, bytes)?,
            }
            offset += bytes.len() as u64;
        }
        if !self.buffers.has("schwarz_vectors") {
            let size = 4 * 3 * 6 * u64::from(nodes);
            self.buffers.create(&self.context, "schwarz_vectors", size, None)?;
        }
        Ok(())
    }

    /// Records to = S P^-1 from, and the sums of to . from and from . from, with these flags.
    pub(super) fn schwarz_record(
        &mut self,
        (from, to): (LinearVector, LinearVector),
        flags: u32,
    ) -> Result<()> {
        let Some(tables) = &self.schwarz else { return Ok(()) };
        let levels = tables.levels.clone();
        let groups = tables.schwarz.group_starts().len() as u32 - 1;
        let call = Call { flags, ..vectors_call(from, to) };
        let last = levels.len().saturating_sub(1);
        self.schwarz_kernel("preconditioner_apply_groups", groups, call)?;
        for (level, &[nodes, groups]) in levels[..last].iter().enumerate() {
            let call = Call { level: level as u32, ..call };
            self.schwarz_kernel("preconditioner_apply_smooth", nodes.div_ceil(RUN), call)?;
            self.schwarz_kernel("preconditioner_apply_restrict", groups, call)?;
        }
        let bottom = Call { level: last as u32, ..call };
        let nodes = levels[last][0];
        self.schwarz_kernel("preconditioner_apply_bottom", (6 * nodes).div_ceil(ROWS), bottom)?;
        let name = "preconditioner_apply_bottom_sums";
        self.schwarz_kernel(name, nodes.div_ceil(NODES), bottom)?;
        for (level, &[nodes, _]) in levels[..last].iter().enumerate().rev() {
            let call = Call { level: level as u32, flags: flags | CALL_SECOND, ..call };
            self.schwarz_kernel("preconditioner_apply_smooth", nodes.div_ceil(RUN), call)?;
        }
        self.solve_kernel("preconditioner_apply", "preconditioner_apply_end", call)
    }

    fn schwarz_kernel(&mut self, name: &'static str, workgroups: u32, call: Call) -> Result<()> {
        let call = self.call(call)?;
        self.dispatch("preconditioner_apply", name, (workgroups, 1), self.present, (0, call))
    }

    /// The same within a solve, for its residual, if that is what the preconditioner is.
    pub(super) fn schwarz_of_residual(&mut self) -> Result<()> {
        if self.preconditioner != Preconditioner::Schwarz {
            return Ok(());
        }
        let vectors = (LinearVector::Residual, LinearVector::Preconditioned);
        self.schwarz_record(vectors, CALL_SOLVE)
    }

    /// Another frame, substep or state: nothing of before counts.
    pub(crate) fn schwarz_forget(&mut self) {
        if let Some(tables) = &mut self.schwarz {
            tables.reuse.forget();
        }
    }

    /// Notes the iterations of a solve.
    pub(super) fn schwarz_solved(&mut self, outcome: &LinearOutcome) {
        if let Some(tables) = &mut self.schwarz {
            if self.preconditioner == Preconditioner::Schwarz {
                tables.reuse.solved(outcome.iterations);
            } else if outcome.restarted {
                tables.reuse.forget();
            }
        }
    }
}

/// Contents of `schwarz_tables`.
fn words(schwarz: &Schwarz) -> Vec<u32> {
    let mut words = vec![0; HEAD_WORDS + LEVEL_WORDS * schwarz.levels().len()];
    let mut put = |list: &mut dyn Iterator<Item = u32>| {
        let at = words.len() as u32;
        words.extend(list);
        at
    };
    let single = |number: f64| (number as f32).to_bits();
    let prolongation = schwarz.prolongation().as_flattened().as_flattened();
    let head = [
        schwarz.group_starts().len() as u32 - 1,
        put(&mut schwarz.order().iter().copied()),
        put(&mut schwarz.group_starts().iter().copied()),
        put(&mut schwarz.places().iter().copied()),
        put(&mut schwarz.group_of().iter().copied()),
        put(&mut prolongation.iter().map(|entry| entry.to_bits())),
    ];
    let (mut rows, mut vector) = (0, 0);
    let mut levels = Vec::new();
    for level in schwarz.levels() {
        let (matrix, factors) = (level.matrix(), level.factors());
        let unknowns = 6 * matrix.len() as u32;
        let blocks = matrix.blocks().as_flattened().as_flattened();
        let prolongation = level.prolongation().as_flattened().as_flattened();
        levels.push([
            matrix.len() as u32,
            level.starts().len().saturating_sub(1) as u32,
            single(level.weight()),
            put(&mut matrix.starts().iter().copied()),
            put(&mut matrix.columns().iter().copied()),
            put(&mut blocks.iter().map(|&entry| single(entry))),
            rows as u32,
            put(&mut factors.scale().iter().map(|&scale| single(scale))),
            put(&mut prolongation.iter().map(|&entry| single(entry))),
            put(&mut level.starts().iter().copied()),
            vector,
            vector + unknowns,
            vector + 2 * unknowns,
        ]);
        rows += factors.rows().len();
        vector += 3 * unknowns;
    }
    words[..HEAD_WORDS].copy_from_slice(&head);
    for (words, level) in words[HEAD_WORDS..].chunks_exact_mut(LEVEL_WORDS).zip(levels) {
        words[..level.len()].copy_from_slice(&level);
    }
    words
}
