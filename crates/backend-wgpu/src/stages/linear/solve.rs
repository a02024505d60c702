//! Linear solvers: recording of iterations, and what became of them.

use cloth_core::{
    Integrator, LinearMethod, LinearOutcome, LinearSettings, LinearStart, LinearVector,
    Preconditioner, Result,
    stepper::{Substep, linear::restarts},
};

use super::{Stages, vectors_call};
use crate::{
    layout::{
        CALL_DEFERRED, CALL_ENERGY, CALL_FROM_SOLUTION, CALL_ODD, CALL_REFERENCE, CALL_RESTARTS,
        CALL_SCHWARZ, Call, SOLVE_CONVERGED, SOLVE_ENDED, SOLVE_INDEFINITE, SOLVE_RUNNING, Solve,
    },
    linear::{SolveRequest, call_of, linear_check, vector_number},
    readback::{Answer, Readback},
};

/// Iterations after which the host looks, where it waits for a solve: first as many as the last one took, then few, then twice as many each time. The
/// device is at work on the next ones meanwhile; those behind the end return at once, which takes time, too.
struct Chunks {
    next: u32,
    then: u32,
    most: u32,
}

impl Chunks {
    /// An iteration with `schwarz` is ten kernels and more.
    fn new(of_last: u32, is_schwarz: bool) -> Self {
        let (least, most) = if is_schwarz { (2, 8) } else { (8, 32) };
        Self { next: (of_last + of_last / 8 + 1).clamp(least, 2 * most), then: least, most }
    }

    fn take(&mut self, left: u32) -> u32 {
        let count = self.next.min(left);
        self.next = self.then;
        self.then = (2 * self.then).min(self.most);
        count
    }
}

impl Stages {
    pub(crate) fn vector_dot(&mut self, a: LinearVector, b: LinearVector) -> Result<f64> {
        self.solve_kernel("vector_dot", "vector_dot", vectors_call(a, b))?;
        self.single("vector_dot", "vector_dot_total", 0, Call::default())?;
        Ok(f64::from(self.solve_read()?.scalar))
    }

    /// A kernel over blocks of particles.
    pub(super) fn solve_kernel(
        &mut self,
        stage: &'static str,
        name: &'static str,
        call: Call,
    ) -> Result<()> {
        self.linear_prepare()?;
        let call = self.call(call)?;
        let [blocks, _] = crate::dispatch::solve_blocks(self.particle_count());
        self.dispatch(stage, name, (blocks, 1), self.present, (0, call))
    }

    /// Records S A c of an iteration of `conjugate_gradient`.
    fn solve_image(&mut self, stage: &'static str, call: Call) -> Result<()> {
        let Some(contacts) = self.crowd else {
            return self.solve_kernel(stage, "conjugate_gradient_image", call);
        };
        let items = (contacts, crate::dispatch::WORKGROUP);
        self.dispatch(stage, "conjugate_gradient_contacts", items, self.present, (0, 0))?;
        self.solve_kernel(stage, "conjugate_gradient_image_crowded", call)
    }

    /// A kernel of one workgroup.
    fn single(
        &mut self,
        stage: &'static str,
        name: &'static str,
        slot: usize,
        call: Call,
    ) -> Result<()> {
        self.linear_prepare()?;
        let call = self.call(call)?;
        self.dispatch(stage, name, (1, 1), self.present, (slot, call))
    }

    /// Everything before the first iteration.
    fn solve_begin(&mut self, stage: &'static str, slot: usize, call: Call) -> Result<()> {
        let starts_at_solution = call.flags & CALL_FROM_SOLUTION != 0;
        self.single(stage, "linear_begin", slot, call)?;
        let items = (self.particle_count(), crate::dispatch::WORKGROUP);
        let index = self.call(call)?;
        self.dispatch(stage, "linear_start", items, self.present, (slot, index))?;
        let reference = Call {
            vector_from: vector_number(LinearVector::Direction),
            flags: call.flags | CALL_REFERENCE,
            ..call
        };
        self.solve_kernel(stage, "linear_residual", reference)?;
        self.schwarz_of_residual()?;
        if !starts_at_solution {
            return Ok(());
        }
        if call.flags & CALL_ENERGY != 0 {
            let closer = self.closer(stage, slot, call)? as f32;
            let offset = std::mem::offset_of!(Solve, energy_before);
            self.solve_write(offset, &[closer.to_bits()])?;
        }
        self.residual_of_solution(stage, slot, call)
    }

    /// How much closer the solution is than z in the square of the norm of the energy, as `linear::begin` has it, with the residual of z in
    /// place.
    fn closer(&mut self, stage: &'static str, slot: usize, call: Call) -> Result<f64> {
        // Keeps what the sums of products are about to overwrite.
        self.single(stage, "linear_reference", slot, call)?;
        let of_start = self.step_times_residual()?;
        let vector_from = vector_number(LinearVector::Solution);
        self.solve_kernel(stage, "linear_residual", Call { vector_from, ..call })?;
        Ok(of_start + self.step_times_residual()?)
    }

    /// (y - z) r, z as the direction.
    fn step_times_residual(&mut self) -> Result<f64> {
        use LinearVector::{Direction, Residual, Solution};
        Ok(self.vector_dot(Solution, Residual)? - self.vector_dot(Direction, Residual)?)
    }

    /// The residual of the solution, after that of the start at z.
    pub(super) fn residual_of_solution(
        &mut self,
        stage: &'static str,
        slot: usize,
        call: Call,
    ) -> Result<()> {
        if call.flags & CALL_ENERGY == 0 {
            self.single(stage, "linear_reference", slot, call)?;
        }
        let vector_from = vector_number(LinearVector::Solution);
        self.solve_kernel(stage, "linear_residual", Call { vector_from, ..call })?;
        self.schwarz_of_residual()
    }

    /// Records `count` iterations after the first `done` ones. Returns what tells later kernels where the last one
    /// left its scalars.
    fn solve_iterate(
        &mut self,
        method: LinearMethod,
        (done, count): (u32, u32),
        call: Call,
    ) -> Result<Call> {
        let is_schwarz = self.preconditioner == Preconditioner::Schwarz;
        let is_general = method == LinearMethod::Jacobi || is_schwarz;
        let is_general = is_general || call.flags & CALL_ENERGY != 0;
        let reach = self.solve_reach.filter(|_| !is_general);
        if let Some(reach) = reach {
            let stage = "conjugate_gradient";
            let after = |done: u32| Call {
                flags: call.flags | if done % 2 == 1 { CALL_ODD } else { 0 },
                reach,
                ..call
            };
            if done == 0 {
                self.solve_image(stage, call)?;
            }
            for number in done..done + count {
                self.solve_kernel(stage, "conjugate_gradient_iteration", after(number))?;
            }
            return Ok(after(done + count));
        }
        for _ in 0..count {
            if method == LinearMethod::Jacobi {
                self.solve_kernel("jacobi", "jacobi", call)?;
                let vector_from = vector_number(LinearVector::Solution);
                self.solve_kernel("jacobi", "linear_residual", Call { vector_from, ..call })?;
            } else {
                let stage = "conjugate_gradient";
                self.solve_image(stage, call)?;
                self.solve_kernel(stage, "conjugate_gradient_step", call)?;
                self.schwarz_of_residual()?;
            }
        }
        Ok(call)
    }

    /// Records as many iterations as the solve of this call is likely to need.
    pub(super) fn solve_iterate_recorded(
        &mut self,
        method: LinearMethod,
        call: Call,
    ) -> Result<Call> {
        let policy = self.solve_policy.as_ref();
        let count = policy.map_or(0, |policy| policy.iterations(call.pass_number));
        self.solve_iterate(method, (0, count), call)
    }

    /// Solves the system with the preconditioner that was built last, and waits for what comes of it.
    pub(crate) fn solve_now(
        &mut self,
        settings: &LinearSettings,
        start: LinearStart,
    ) -> Result<LinearOutcome> {
        linear_check(settings)?;
        let solve = self.solve_to_end(settings, start)?;
        let mut outcome = outcome(&solve);
        let residual = f64::from(solve.outcome_residual);
        if solve.outcome_phase == SOLVE_INDEFINITE && restarts(self.preconditioner, residual) {
            // Rounding has made it so: the rest with the diagonal, as `linear::restart`.
            let iterations = solve.outcome_iterations;
            self.preconditioner_build(Preconditioner::Diagonal)?;
            let rest = LinearSettings {
                preconditioner: Preconditioner::Diagonal,
                iterations_max: settings.iterations_max - iterations,
                ..*settings
            };
            outcome = self::outcome(&self.solve_to_end(&rest, LinearStart::Solution)?);
            outcome.iterations += iterations;
            outcome.restarted = true;
        }
        self.schwarz_solved(&outcome);
        Ok(outcome)
    }

    /// The same, and what the device says of it.
    fn solve_to_end(&mut self, settings: &LinearSettings, start: LinearStart) -> Result<Solve> {
        let solve = self.solve_in_chunks(settings, start)?;
        let is_schwarz = self.preconditioner == Preconditioner::Schwarz;
        self.last_iterations[usize::from(is_schwarz)] = solve.outcome_iterations;
        Ok(solve)
    }

    fn solve_in_chunks(&mut self, settings: &LinearSettings, start: LinearStart) -> Result<Solve> {
        let method = settings.method;
        let stage = stage_of(method);
        let mut call = call_of(settings, start);
        if method == LinearMethod::ConjugateGradient {
            call.flags |= CALL_RESTARTS;
            if self.preconditioner == Preconditioner::Schwarz {
                call.flags |= CALL_SCHWARZ;
            }
        }
        let slot = self.slots.current;
        self.solve_begin(stage, slot, call)?;
        let is_schwarz = self.preconditioner == Preconditioner::Schwarz;
        let mut chunks = Chunks::new(self.last_iterations[usize::from(is_schwarz)], is_schwarz);
        let mut done = 0;
        // The device is at work on the next iterations while the host learns of those before.
        let mut asked: Option<Answer> = None;
        loop {
            let count = chunks.take(settings.iterations_max - done);
            let after = self.solve_iterate(method, (done, count), call)?;
            done += count;
            self.single(stage, "linear_end", slot, after)?;
            let answer = self.solve_ask()?;
            if let Some(before) = asked.replace(answer) {
                let solve: Solve = before.wait(&self.context, bytemuck::pod_read_unaligned)?;
                if solve.outcome_phase != SOLVE_RUNNING {
                    return Ok(solve);
                }
            }
            if done == settings.iterations_max
                && let Some(last) = asked.take()
            {
                return last.wait(&self.context, bytemuck::pod_read_unaligned);
            }
        }
    }

    /// Asks for what has become of a solve after all that is recorded.
    fn solve_ask(&mut self) -> Result<Answer> {
        let size = size_of::<Solve>() as u64;
        let readback = Readback::new(&self.context, size);
        let solve = self.buffers.get("solve", 0, 0)?;
        self.recorder.copy(&self.context, solve, 0, readback.buffer(), 0, size);
        self.recorder.submit(&self.context)?;
        Ok(Answer::ask(&self.context, readback, size))
    }

    /// Records all solves of a substep.
    pub(in crate::stages) fn solve_record(
        &mut self,
        substep: &Substep,
        request: &SolveRequest,
    ) -> Result<()> {
        let Some(policy) = &self.solve_policy else { return Ok(()) };
        let constrained = self.model.has_collider_constraints();
        let passes = if constrained { policy.passes() } else { 1 };
        let method = request.linear.method;
        let slot = self.slot(substep)?;
        let preconditioner = match method {
            LinearMethod::Jacobi => Preconditioner::Block,
            _ => request.linear.preconditioner,
        };
        for pass in 0..passes {
            self.preconditioner_build(preconditioner)?;
            let start = if pass == 0 { request.start } else { LinearStart::Solution };
            let call = Call { pass_number: pass, pass_count: request.passes, ..Call::default() };
            let call = self.pass_record(&request.linear, start, slot, call)?;
            // A contact that pulled in the very last solve has to be there when its impulse is looked for.
            let keeps = pass + 1 == request.passes && self.model.collider_impulses();
            if constrained && !keeps {
                self.constraint_release_record()?;
                if pass + 1 == passes && passes < request.passes {
                    self.single("constraint_release", "linear_close", slot, call)?;
                }
            }
        }
        Ok(())
    }

    /// Records one solve of a substep with the preconditioner that is there. `call` has its number and
    /// flags of its own; returns all that its kernels were told.
    pub(in crate::stages) fn pass_record(
        &mut self,
        linear: &LinearSettings,
        start: LinearStart,
        slot: usize,
        call: Call,
    ) -> Result<Call> {
        let stage = stage_of(linear.method);
        let settings = call_of(linear, start);
        let call = Call {
            flags: call.flags | settings.flags | CALL_DEFERRED,
            pass_number: call.pass_number,
            pass_count: call.pass_count,
            ..settings
        };
        self.solve_begin(stage, slot, call)?;
        let after = self.solve_iterate_recorded(linear.method, call)?;
        self.single(stage, "linear_end", slot, after)?;
        Ok(call)
    }

    /// Books what the device did since the last time, and lets it count anew.
    pub(in crate::stages) fn solve_log_take(&mut self, solve: &Solve) -> Result<()> {
        let report = &mut self.deferred.report;
        // The semi-implicit integrator counts a substep as one.
        if !matches!(self.config.integrator, Integrator::SemiImplicit(_)) {
            report.solves += solve.solves;
        }
        report.solves_unconverged += solve.solves_unconverged;
        report.iterations += u64::from(solve.iterations);
        report.residual = report.residual.max(f64::from(solve.residual_max));
        // Known already if nothing was constrained anew.
        self.constrained.get_or_insert(u64::from(solve.constrained));
        self.released += u64::from(solve.released);
        if solve.solves > 0 || solve.released > 0 { self.solve_log_reset() } else { Ok(()) }
    }

    /// Lets the device count constrained particles anew.
    pub(in crate::stages) fn constrained_reset(&mut self) -> Result<()> {
        if !self.buffers.has("solve") || self.model.colliders().is_empty() {
            return Ok(());
        }
        self.solve_write(std::mem::offset_of!(Solve, constrained), &[0])
    }

    pub(in crate::stages) fn solve_log_reset(&mut self) -> Result<()> {
        if !self.buffers.has("solve") {
            return Ok(());
        }
        let first = std::mem::offset_of!(Solve, released);
        let words = (size_of::<Solve>() - first) / 4;
        self.solve_write(first, &vec![0; words])
    }
}

pub(super) const fn stage_of(method: LinearMethod) -> &'static str {
    match method {
        LinearMethod::Jacobi => "jacobi",
        _ => "conjugate_gradient",
    }
}

fn outcome(solve: &Solve) -> LinearOutcome {
    let phase = solve.outcome_phase;
    // What cannot go on stands as it is, if anything was done.
    let stands = phase == SOLVE_INDEFINITE && solve.outcome_iterations > 0;
    let breakdown = !(phase == SOLVE_CONVERGED || phase == SOLVE_ENDED || stands);
    let residual = f64::from(solve.outcome_residual);
    LinearOutcome {
        iterations: solve.outcome_iterations,
        residual: if breakdown { f64::INFINITY } else { residual },
        energy: (solve.next.energy >= 0.0).then_some(f64::from(solve.next.energy)),
        converged: phase == SOLVE_CONVERGED,
        breakdown,
        ..LinearOutcome::default()
    }
}
