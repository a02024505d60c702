//! A solver of a scene: of whatever is simulated at a time, by the particles that the scene has.

mod sewing;
mod stage;

use std::{collections::BTreeSet, sync::Arc};

use cloth_core::{
    Backend, ColliderImpulse, Control, ControlStart, Error, Frame, Model, Pose, Result, Solver,
    State, StepReport, contact::Contacts,
};
use cloth_scene::CompiledScene;

use crate::{SceneAudit, rigid_exchange::moved_from};

pub(crate) use stage::Stage;

use sewing::{Gathered, Sewing, control_map};

/// How far the sides of a tear are moved apart, each \[m\]: less where something else is that near.
const TEAR_GAPS: [f64; 2] = [1e-4, 2e-5];

/// How often cloth that may tear is looked at \[s\]; no more often than its steps are long.
const TEAR_INTERVAL: f64 = 4e-3;

/// Share of a substep below which a difference is rounding, and most substeps that are counted.
const ROUNDING: f64 = 1e-6;
const STEPS_MAX: f64 = 1e6;

/// How often some of what is to be welded is brought together in one frame. Each time takes as long as a frame or two.
const GATHERINGS: usize = 32;

/// A solver of a scene. Where seams are welded, edges tear or a phase begins, another solver goes on from the state; whoever calls sees the particles
/// of the scene's model throughout.
///
/// [`Self::begin`] comes before each frame of the scene; all else is as for any [`Solver`].
pub struct StagedSolver<S: Solver = Box<dyn Solver>> {
    scene: CompiledScene,
    solver: S,
    sewing: Sewing<S>,
    /// Made when something tears.
    audit: Option<SceneAudit>,
    /// What was told for the next frame, if it is done in parts.
    control: Control,
    /// Wind and forces that hold on, for another solver; by the scene's particles.
    kept: Control,
    /// How far anchors were at the end of the last frame \[m\].
    anchor_offset: [f64; 3],
    /// What the parts of the present frame before the last one did.
    earlier: StepReport,
}

impl StagedSolver {
    /// A solver of `scene` at its start.
    ///
    /// # Errors
    /// What [`Backend::create_solver`] reports.
    pub fn new(scene: CompiledScene, backend: &dyn Backend) -> Result<Self> {
        let stage = Stage::start(&scene);
        let is_welded = stage.weld().is_some();
        let mut solver = Self::at_stage(scene, backend, stage)?;
        if is_welded {
            // The welded model lies where the scene does not say it, if cloth was pulled apart.
            let start = solver.scene.model.initial_state();
            solver.upload(&start)?;
        }
        Ok(solver)
    }

    /// A solver of what is simulated in `frame` of `scene` where these stitches are broken and these edges torn, at `state`.
    ///
    /// # Errors
    /// What [`Backend::create_solver`] and [`Solver::upload`] report, and what cannot be welded.
    pub(crate) fn at_state(
        scene: CompiledScene,
        backend: &dyn Backend,
        (frame, state): (u64, &State),
        gone: (&[u32], &[u32]),
    ) -> Result<Self> {
        let stage = Stage::of_state(&scene, frame, state, gone)?;
        Self::at_stage(scene, backend, stage)
    }

    fn at_stage(scene: CompiledScene, backend: &dyn Backend, stage: Stage) -> Result<Self> {
        let (model, config) = stage.model_and_config(&scene);
        let solver = backend.create_solver(model, &config)?;
        Ok(Self { sewing: Sewing::new(backend, stage), ..Self::of_solver(scene, solver) })
    }
}

impl<S: Solver> StagedSolver<S> {
    /// Goes on with a solver of the scene's model that was made elsewhere. It cannot follow where another one is needed.
    pub fn of_solver(scene: CompiledScene, solver: S) -> Self {
        Self {
            scene,
            solver,
            sewing: Sewing::default(),
            audit: None,
            control: Control::default(),
            kept: Control::default(),
            anchor_offset: [0.0; 3],
            earlier: StepReport::default(),
        }
    }

    /// The scene.
    #[must_use]
    pub const fn scene(&self) -> &CompiledScene {
        &self.scene
    }

    /// The solver of what is simulated at present.
    #[must_use]
    pub const fn inner(&self) -> &S {
        &self.solver
    }

    /// That solver, which may be one of another model than the scene's.
    pub const fn inner_mut(&mut self) -> &mut S {
        &mut self.solver
    }

    pub(crate) const fn stage(&self) -> &Stage {
        self.sewing.stage()
    }

    /// Makes the solver one of what is simulated in `frame` of the scene, the next one: seams that close, those that are welded, edges that tear, another
    /// phase. Returns whether particles have moved by it.
    ///
    /// # Errors
    /// What cannot be welded, and what the solvers report.
    pub fn begin(&mut self, frame: u64) -> Result<bool> {
        let stage = self.stage().clone();
        if !stage.may_end(&self.scene, frame) {
            return Ok(false);
        }
        let mut state = State::default();
        self.download(&mut state)?;
        let mut next = stage.next(&self.scene, frame, &state)?;
        if stage.welds(&next) {
            if self.scene.model.has_triangle_contact() {
                (next, state) = self.welded(&stage, next, state)?;
            } else {
                next.weld_set(&self.scene, &state)?;
            }
        }
        if !stage.needs_solver(&self.scene, &next) {
            self.sewing.stage_set(next);
            return Ok(false);
        }
        if stage.differs_in_stitches_alone(&next) {
            let (model, _) = next.model_and_config(&self.scene);
            if self.solver.stitches_set(&model)? {
                self.sewing.stage_set(next);
                return Ok(false);
            }
        }
        self.follow(next, state)?;
        Ok(true)
    }

    /// `next` at `state`, with what becomes one in it at one place. Stitches between which something is caught are left open: where all that are to be
    /// welded cannot come together, those come first that nothing was in the way of, then the others, in halves.
    fn welded(&self, stage: &Stage, next: Stage, mut state: State) -> Result<(Stage, State)> {
        let (scene, config) = (&self.scene, stage.config(&self.scene));
        let mut left: BTreeSet<u32> = stage.welds_of(scene, &next).into_iter().collect();
        let all = left.len();
        let mut groups: Vec<Vec<u32>> = vec![left.iter().copied().collect()];
        for _ in 0..GATHERINGS {
            let Some(group) = groups.pop() else { break };
            let is_other = |stitch: &u32| group.binary_search(stitch).is_err();
            let part = next.without(left.iter().copied().filter(is_other));
            match self.sewing.gathered((scene, &part), (config, &state))? {
                Gathered::At(there) => {
                    state = there;
                    left.retain(is_other);
                }
                Gathered::Caught(caught) => {
                    let caught = part.caught_among(&scene.model, &state, (&group, &caught));
                    groups.extend(parts(group, caught));
                }
            }
        }
        if left.len() == all {
            return Ok((next.unwelded(scene, &state, stage), state));
        }
        let mut next = next.without(left);
        next.weld_set(scene, &state)?;
        Ok((next, state))
    }

    /// Goes on with a solver of another stage from a state by the scene's particles.
    fn follow(&mut self, next: Stage, state: State) -> Result<()> {
        let (model, config) = next.model_and_config(&self.scene);
        let mut solver = self.sewing.solver(model, &config)?;
        solver.upload(&self.scene_state((self.stage(), &next), state))?;
        self.solver = solver;
        self.sewing.stage_set(next);
        self.hand_over(&self.kept.clone())
    }

    /// Tears what bears no more. Returns what was before, if something did.
    fn tear(&mut self) -> Result<Option<(Stage, State)>> {
        let mut state = State::default();
        self.download(&mut state)?;
        let edges = self.scene.model.edges_that_tear(&state, self.stage().torn());
        if edges.is_empty() {
            return Ok(None);
        }
        let stage = self.stage().clone();
        let Some((next, parted)) = self.torn(&stage, &state, &edges)? else { return Ok(None) };
        self.follow(next, parted)?;
        Ok(Some((stage, state)))
    }

    /// Advances by a part of a frame, after what bears no more is torn. Where a body then pinches what has just been torn, it holds on until the next part.
    fn part(&mut self, control: &Control, part: Frame) -> Result<()> {
        let before = self.tear()?;
        self.hand_over(control)?;
        let moved = self.solver.advance(part);
        let Some((stage, state)) = before else { return moved };
        match moved.and_then(|()| self.solver.synchronize()) {
            Err(Error::Pinched { .. } | Error::PinchedByBody { .. }) => {}
            outcome => return outcome.map(|_| ()),
        }
        let (model, config) = stage.model_and_config(&self.scene);
        self.solver = self.sewing.solver(model, &config)?;
        self.sewing.stage_set(stage);
        self.upload(&state)?;
        self.hand_over(&self.kept.clone())?;
        self.hand_over(control)?;
        self.solver.advance(part)
    }

    /// Tells the solver what holds.
    fn hand_over(&mut self, control: &Control) -> Result<()> {
        let Some(weld) = self.sewing.stage().weld() else {
            return self.solver.set_control(control);
        };
        let mut control = control.clone();
        control_map(&mut control, &weld.map);
        self.solver.set_control(&control)
    }

    /// At which shares of a frame cloth that may tear is looked at, each the end of a substep.
    fn parts(&self, frame: Frame) -> Vec<f64> {
        let longest = self.stage().config(&self.scene).time_step;
        let steps = (frame.duration / longest - ROUNDING).ceil().clamp(1.0, STEPS_MAX);
        let each = (TEAR_INTERVAL * steps / frame.duration).floor().max(1.0);
        let parts = (steps / each).ceil() as u32;
        (1..=parts).map(|part| (f64::from(part) * each / steps).min(1.0)).collect()
    }

    /// Stitches that are broken and edges that are torn, each ascending.
    #[must_use]
    pub fn gone(&self) -> [Vec<u32>; 2] {
        [self.stage().broken().to_vec(), self.stage().torn().to_vec()]
    }

    /// Goes to the state of a frame, in which these stitches are broken and these edges torn.
    ///
    /// # Errors
    /// As [`Self::begin`].
    pub fn restore(
        &mut self,
        (frame, state): (u64, &State),
        [broken, torn]: &[Vec<u32>; 2],
    ) -> Result<()> {
        let next = Stage::of_state(&self.scene, frame, state, (broken, torn))?;
        let stage = self.stage();
        if stage.needs_solver(&self.scene, &next) {
            let (model, config) = next.model_and_config(&self.scene);
            self.solver = self.sewing.solver(model, &config)?;
        }
        self.sewing.stage_set(next);
        self.upload(state)
    }

    /// A state by the scene's particles, as the solver of `next` takes it over from that of `stage`.
    fn scene_state(&self, (stage, next): (&Stage, &Stage), mut state: State) -> State {
        // Contacts and ghosts have the numbers of what was simulated.
        let masses = self.scene.model.masses();
        match (stage.weld(), next.weld()) {
            (_, Some(weld)) if stage.is_same_weld(next) => State {
                slips: std::mem::take(&mut state.slips),
                ghosts: std::mem::take(&mut state.ghosts),
                ..weld.contract(masses, &state)
            },
            (before, Some(weld)) => {
                if let Some(before) = before {
                    state.ghosts = before.ghosts_expanded(&state.ghosts);
                }
                weld.contract(masses, &state)
            }
            (_, None) => state,
        }
    }

    /// `stage` at `state` once these edges are torn, and the state with their sides apart; nothing if something is so near that they cannot part: what
    /// is left for the next frame.
    fn torn(
        &mut self,
        stage: &Stage,
        state: &State,
        edges: &[u32],
    ) -> Result<Option<(Stage, State)>> {
        let torn = stage.torn_too(&self.scene, state, edges)?;
        let (Some(before), Some(after)) = (stage.weld(), torn.weld()) else { return Ok(None) };
        let parted =
            self.apart(state, |model, positions, gap| after.parted(model, before, positions, gap));
        Ok(parted.map(|positions| (torn, State { positions, ..state.clone() })))
    }

    /// What `parted` makes of positions and the largest gap with which no more triangles intersect than before, if there is one.
    fn apart(
        &mut self,
        state: &State,
        parted: impl Fn(&Model, &[[f64; 3]], f64) -> Vec<[f64; 3]>,
    ) -> Option<Vec<[f64; 3]>> {
        let model = &self.scene.model;
        let audit = self.audit.get_or_insert_with(|| SceneAudit::new(model));
        let pairs =
            |positions: &[[f64; 3]]| audit.at(positions, &state.colliders, state.time).pairs();
        let mut pairs_before = None;
        for gap in TEAR_GAPS {
            let positions = parted(model, &state.positions, gap);
            if positions == state.positions {
                return Some(positions);
            }
            let found = pairs(&positions);
            // Where triangles intersected before, some may go on to.
            if found == 0 || found <= *pairs_before.get_or_insert_with(|| pairs(&state.positions)) {
                return Some(positions);
            }
        }
        None
    }
}

/// What is tried next of stitches that cannot all come together, the last first, if it is more than one.
fn parts(group: Vec<u32>, caught: Vec<u32>) -> Vec<Vec<u32>> {
    if group.len() < 2 {
        return Vec::new();
    }
    if 2 * caught.len() > group.len() {
        let (first, second) = group.split_at(group.len() / 2);
        return vec![first.to_vec(), second.to_vec()];
    }
    let free = group.into_iter().filter(|stitch| caught.binary_search(stitch).is_err()).collect();
    vec![caught, free]
}

impl<S: Solver> Solver for StagedSolver<S> {
    fn model(&self) -> &Arc<Model> {
        &self.scene.model
    }

    fn colliders(&self) -> &[Pose] {
        self.solver.colliders()
    }

    /// The state is one of the scene's particles, with contacts and ghosts by the numbers of what is simulated at present. Where it is one of another
    /// stage, in which other particles are one, contacts and ghosts are forgotten. What has torn since stays so, with its sides apart.
    fn upload(&mut self, state: &State) -> Result<()> {
        let Some(weld) = self.stage().weld().cloned() else { return self.solver.upload(state) };
        let parted = if self.stage().torn().is_empty() {
            None
        } else {
            self.apart(state, |model, positions, gap| weld.parted_from(model, positions, gap))
        };
        let parted = parted.map(|positions| State { positions, ..state.clone() });
        let state = parted.as_ref().unwrap_or(state);
        let state = State {
            slips: state.slips.clone(),
            ghosts: state.ghosts.clone(),
            ..weld.contract(self.scene.model.masses(), state)
        };
        self.solver.upload(&state)
    }

    fn set_control(&mut self, control: &Control) -> Result<()> {
        let Control { wind_velocity, forces, anchor_offset, .. } = control;
        if forces.is_some() {
            self.kept.forces.clone_from(forces);
            self.kept.anchor_offset = None;
        }
        self.kept.wind_velocity = wind_velocity.or(self.kept.wind_velocity);
        self.kept.anchor_offset = anchor_offset.or(self.kept.anchor_offset);
        if self.scene.model.tears().is_empty() {
            return self.hand_over(control);
        }
        control.validate(&self.scene.model)?;
        self.control = control.clone();
        Ok(())
    }

    fn advance(&mut self, frame: Frame) -> Result<()> {
        self.earlier = StepReport::default();
        if self.scene.model.tears().is_empty() {
            return self.solver.advance(frame);
        }
        let control = std::mem::take(&mut self.control);
        let positions = moved_from(&mut *self, &control)?;
        let colliders = self.colliders().to_vec();
        let start = ControlStart {
            positions: &positions,
            colliders: &colliders,
            anchor_offset: self.anchor_offset,
        };
        let mut done = 0.0;
        for share in self.parts(frame) {
            let is_first = done == 0.0;
            if !is_first {
                // It has added what was before.
                self.earlier = self.synchronize()?;
            }
            let control = control.part(&start, share, is_first);
            self.part(&control, Frame { duration: (share - done) * frame.duration })?;
            done = share;
        }
        self.anchor_offset = self.kept.anchor_offset.unwrap_or_default();
        Ok(())
    }

    fn synchronize(&mut self) -> Result<StepReport> {
        let report =
            self.solver.synchronize().map_err(|error| match (error, self.stage().weld()) {
                (Error::Diverged(mut divergence), Some(weld)) => {
                    let firsts = weld.firsts();
                    let first = firsts.get(divergence.particle as usize);
                    divergence.particle = first.copied().unwrap_or(divergence.particle);
                    Error::Diverged(divergence)
                }
                (error, _) => error,
            });
        let mut all = std::mem::take(&mut self.earlier);
        report.map(|report| {
            all.add_part(report);
            all
        })
    }

    fn download(&mut self, out: &mut State) -> Result<()> {
        self.solver.download(out)?;
        if let Some(weld) = self.sewing.stage().weld() {
            out.positions = weld.expand(&out.positions);
            out.velocities = weld.expand(&out.velocities);
            out.held = weld.expand(&out.held);
        }
        Ok(())
    }

    fn particle_position(&mut self, particle: u32) -> Result<[f64; 3]> {
        let became = match self.stage().weld() {
            Some(weld) => weld.map.get(particle as usize).copied().unwrap_or(u32::MAX),
            None => particle,
        };
        self.solver.particle_position(became)
    }

    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        self.solver.collider_impulses(out)
    }

    fn normals(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.solver.normals(out)?;
        if let Some(weld) = self.sewing.stage().weld() {
            *out = weld.expand(out);
        }
        Ok(())
    }

    /// Of particles that are one the first is named.
    fn contacts_read(&mut self, out: &mut Contacts) -> Result<()> {
        self.solver.contacts_read(out)?;
        let Some(weld) = self.sewing.stage().weld() else { return Ok(()) };
        let particles = self.solver.model().particle_count() as u32;
        let firsts = weld.firsts();
        let behind = weld.map.len() as u32;
        for particle in out.contacts.iter_mut().flat_map(|contact| &mut contact.particles) {
            *particle = match particle.checked_sub(particles) {
                Some(node) => behind + node,
                None => firsts[*particle as usize],
            };
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_caught_waits_until_the_others_are_together() {
        let group = vec![2, 3, 5, 7, 11];
        assert_eq!(parts(group.clone(), vec![3, 7]), [vec![3, 7], vec![2, 5, 11]]);
        // Where most are caught, which of them is in the way is found by halves.
        assert_eq!(parts(group.clone(), group), [vec![2, 3], vec![5, 7, 11]]);
        assert!(parts(vec![2], vec![2]).is_empty(), "one alone stays open");
    }
}
