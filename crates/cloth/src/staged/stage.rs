//! What is simulated at a time: seams that close, seams that are welded, edges that are torn, phases.
//!
//! A model never changes, and neither does the one of a solver. Where a scene changes, another solver goes on from the state of the one before:
//! every backend can do that.

use std::{collections::BTreeMap, sync::Arc};

use cloth_core::{
    BROKEN, Integrator, Model, Result, SolverConfig, State, Stitching, Weld, Welding,
};
use cloth_scene::CompiledScene;

/// Stitches wider than this \[m\] are not welded: their vertices would jump.
const WELD_GAP: f64 = 1e-3;

/// Share of the stitches that may be wider when others are welded.
const OPEN_MAX: f64 = 0.1;

/// Something may be caught between what is to be welded. So many frames after its time that is tried in every frame, then in every one of so many: it
/// takes longer than a frame.
const ATTEMPTS: u64 = 8;

/// Share of a frame below which a difference of two times is rounding.
const ROUNDING: f64 = 1e-6;

/// What a solver simulates.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stage {
    is_welded: bool,
    /// Stitches that are to be welded and could not be yet, once others are; ascending.
    open: Vec<u32>,
    /// What is simulated instead of the model of the scene.
    weld: Option<Arc<Weld>>,
    phase: Option<usize>,
    /// The time that stitches are as long as \[s\].
    time: f64,
    /// How wide each stitch is for contact \[m\], while nothing is welded.
    widths: Vec<f64>,
    /// Stitches that have broken, ascending.
    broken: Vec<u32>,
    /// Edges that are torn, ascending.
    torn: Vec<u32>,
}

impl Stage {
    /// Frame 0 of a scene without phases.
    pub(crate) fn start(scene: &CompiledScene) -> Self {
        let weld = scene.welds.start().cloned();
        let mut stage = Self { weld, ..Self::default() };
        stage.widths_set(scene, &scene.model.initial_state());
        stage
    }

    /// What a run is at whose last frame ended with `state`, and in which these stitches are broken, and these edges torn.
    ///
    /// # Errors
    /// What cannot be welded.
    pub(crate) fn of_state(
        scene: &CompiledScene,
        frame: u64,
        state: &State,
        (broken, torn): (&[u32], &[u32]),
    ) -> Result<Self> {
        let time = frame as f64 / scene.frames_per_second;
        let phase = frame.checked_sub(1).and_then(|last| phase_at(scene, last));
        let seams = scene.model.seams();
        let open = seams.open_in(state);
        // Where seams are welded few are left.
        let is_welded = scene.welds.sewn().is_some() && 2 * open.len() < seams.to_weld().count();
        let open = if is_welded { open } else { Vec::new() };
        let weld = scene.welds.at(Welding { sews: is_welded, open: &open, torn })?;
        let (broken, torn, widths) = (broken.to_vec(), torn.to_vec(), Vec::new());
        let mut stage = Self { is_welded, open, weld, phase, time, widths, broken, torn };
        stage.widths_set(scene, state);
        Ok(stage)
    }

    /// Stitches that have broken, ascending.
    pub(crate) fn broken(&self) -> &[u32] {
        &self.broken
    }

    /// Edges that are torn, ascending.
    pub(crate) fn torn(&self) -> &[u32] {
        &self.torn
    }

    /// Whether another stage can follow in `frame`.
    pub(crate) fn may_end(&self, scene: &CompiledScene, frame: u64) -> bool {
        let sews = self.time.to_bits() != self.time_of(scene, frame).to_bits()
            && !scene.model.seams().is_empty();
        let may_change = |width: &f64| *width > 0.0 && *width < BROKEN;
        sews || scene.model.seams().can_break()
            || !scene.model.tears().is_empty()
            || self.widths.iter().any(may_change)
            || phase_at(scene, frame) != self.phase
    }

    fn time_of(&self, scene: &CompiledScene, frame: u64) -> f64 {
        let ends = scene.model.seams().ranges().iter().map(|seam| seam.closing[1]);
        let closed = ends.fold(0.0, f64::max);
        let end = (frame + 1) as f64 / scene.frames_per_second;
        // Nothing changes any more once all are closed and welded.
        let waits = scene.welds.sewn().is_some() && !self.is_sewn();
        if waits { end } else { end.min(closed.max(self.time)) }
    }

    /// The stage of `frame`, which starts at `state`.
    ///
    /// # Errors
    /// What cannot be welded.
    pub(crate) fn next(&self, scene: &CompiledScene, frame: u64, state: &State) -> Result<Self> {
        let start_frame = frame as f64 + ROUNDING;
        let seams = scene.model.seams();
        let first = seams.weld_time().map(|time| time * scene.frames_per_second);
        let is_turn = |first: f64| {
            let late = frame.saturating_sub((first - ROUNDING).ceil() as u64);
            late < ATTEMPTS || late.is_multiple_of(ATTEMPTS)
        };
        let is_time = first.is_some_and(|first| first <= start_frame && is_turn(first));
        let waits = scene.welds.sewn().is_some() && !self.is_sewn();
        let mut open = self.open.clone();
        let mut is_welded = self.is_welded;
        if waits && is_time {
            // All that are close, those that were left before too.
            let is_wide = |&stitch: &u32| seams.gap(stitch, &state.positions) > WELD_GAP;
            let wide: Vec<u32> = seams.to_weld().filter(is_wide).collect();
            if wide.len() as f64 <= OPEN_MAX * seams.to_weld().count() as f64 {
                (is_welded, open) = (true, wide);
            }
        }
        let mut next = Self {
            is_welded,
            open,
            phase: phase_at(scene, frame),
            time: self.time_of(scene, frame),
            ..self.clone()
        };
        if seams.can_break() {
            let now = (frame as f64 + ROUNDING) / scene.frames_per_second;
            next.broken.extend(scene.model.stitches_that_break(&state.positions, now));
            next.broken.sort_unstable();
            next.broken.dedup();
        }
        next.weld_set(scene, state)?;
        Ok(next)
    }

    fn weld_set(&mut self, scene: &CompiledScene, state: &State) -> Result<()> {
        let Self { is_welded: sews, open, torn, .. } = &*self;
        self.weld = scene.welds.at(Welding { sews: *sews, open, torn })?;
        self.widths_set(scene, state);
        Ok(())
    }

    /// This stage at `state` with these edges torn as well.
    ///
    /// # Errors
    /// What cannot be welded.
    pub(crate) fn torn_too(
        &self,
        scene: &CompiledScene,
        state: &State,
        edges: &[u32],
    ) -> Result<Self> {
        let mut next = self.clone();
        next.torn.extend(edges);
        next.torn.sort_unstable();
        next.weld_set(scene, state)?;
        Ok(next)
    }

    /// Whether seams are welded between this stage and the next one.
    pub(crate) const fn welds(&self, next: &Self) -> bool {
        next.is_welded && (!self.is_welded || next.open.len() < self.open.len())
    }

    /// The same stage of a scene at `state`, where no more is welded than in `before`.
    ///
    /// # Errors
    /// What cannot be welded.
    pub(crate) fn unwelded(
        &self,
        scene: &CompiledScene,
        state: &State,
        before: &Self,
    ) -> Result<Self> {
        let (is_welded, open) = (before.is_welded, before.open.clone());
        let mut stage = Self { is_welded, open, ..self.clone() };
        stage.weld_set(scene, state)?;
        Ok(stage)
    }

    /// The same stage without the stitches at any of these particles, whose number comes with it. What is welded in `before` stays so: its sides are in one
    /// place, and would go through each other from there.
    ///
    /// # Errors
    /// What cannot be welded.
    pub(crate) fn without(
        &self,
        scene: &CompiledScene,
        (before, state): (&Self, &State),
        particles: &[u32],
    ) -> Result<(Self, usize)> {
        let mut stage = self.clone();
        let seams = scene.model.seams();
        if let Some(weld) = &self.weld {
            let became = |i: &u32| weld.map.get(*i as usize).copied();
            let places: Vec<u32> = particles.iter().filter_map(became).collect();
            let meets = |&stitch: &u32| {
                let ends = seams.stitches()[stitch as usize];
                ends.iter().filter_map(became).any(|place| places.contains(&place))
            };
            let is_new = |stitch: &u32| !before.is_welded || before.open.contains(stitch);
            stage.open.extend(seams.to_weld().filter(is_new).filter(meets));
            stage.open.sort_unstable();
            stage.open.dedup();
            stage.weld_set(scene, state)?;
        }
        let left = stage.open.len() - self.open.len();
        Ok((stage, left))
    }

    /// Whether the solver of this stage cannot go on in `next`.
    pub(crate) fn needs_solver(&self, scene: &CompiledScene, next: &Self) -> bool {
        self.is_welded != next.is_welded
            || self.open != next.open
            || self.torn != next.torn
            || self.phase != next.phase
            || self.widths != next.widths
            || scene.model.is_sewn_between([self.time, next.time], is_implicit(scene))
    }

    /// Whether a solver of this stage may be able to go on in `next`.
    pub(crate) fn differs_in_stitches_alone(&self, next: &Self) -> bool {
        self.is_same_weld(next) && self.phase == next.phase
    }

    /// What a solver of this stage gets.
    pub(crate) fn model_and_config(&self, scene: &CompiledScene) -> (Arc<Model>, SolverConfig) {
        let phase = self.phase.and_then(|phase| scene.phases.get(phase));
        let config = self.config(scene).clone();
        let base = self.weld().map_or(&scene.model, |weld| &weld.model);
        let gravity = phase.and_then(|phase| phase.gravity);
        let bending = phase.map_or(1.0, |phase| phase.bending);
        let is_own = gravity.is_none() && bending == 1.0 && base.seams().is_empty();
        if is_own {
            return (Arc::clone(base), config);
        }
        let model = base.sewn_at(&Stitching {
            time: self.time,
            pulls: is_implicit(scene),
            widths: &self.widths,
            torn: &[],
        });
        let own = model.gravity();
        let model = model.with_gravity(gravity.unwrap_or(own));
        let model = if bending == 1.0 { model } else { model.with_bending(bending) };
        (Arc::new(model), config)
    }

    pub(crate) fn config<'a>(&self, scene: &'a CompiledScene) -> &'a SolverConfig {
        let phase = self.phase.and_then(|phase| scene.phases.get(phase));
        phase.map_or(&scene.config, |phase| &phase.config)
    }

    /// What is simulated instead of the model of the scene.
    pub(crate) const fn weld(&self) -> Option<&Arc<Weld>> {
        self.weld.as_ref()
    }

    /// Whether the same particles are one in `next`.
    pub(crate) fn is_same_weld(&self, next: &Self) -> bool {
        self.is_welded == next.is_welded && self.open == next.open && self.torn == next.torn
    }

    /// Whether all seams are welded that are to be.
    pub(crate) const fn is_sewn(&self) -> bool {
        self.is_welded && self.open.is_empty()
    }

    /// How many stitches of a scene are welded.
    pub(crate) fn welded(&self, scene: &CompiledScene) -> usize {
        if self.is_welded { scene.model.seams().to_weld().count() - self.open.len() } else { 0 }
    }

    /// Zero for all stitches of a model but those that are open, which are as wide as they are `now`.
    pub(super) fn open_alone(&self, model: &Model, now: impl Fn() -> Vec<f64>) -> Vec<f64> {
        let mut widths = vec![0.0; model.seams().stitches().len()];
        let all = if self.open.is_empty() { Vec::new() } else { now() };
        for &stitch in &self.open {
            if let (Some(width), Some(&own)) =
                (widths.get_mut(stitch as usize), all.get(stitch as usize))
            {
                *width = own;
            }
        }
        widths
    }

    /// Sets how wide the stitches of what is simulated are: [`Model::stitch_widths`], or nothing once seams are welded, as those that are held are
    /// closed then. Those that are broken have no end.
    fn widths_set(&mut self, scene: &CompiledScene, state: &State) {
        let model = &scene.model;
        let now = || model.stitch_widths(&state.positions, is_implicit(scene));
        let mut widths = match self.is_welded {
            true if self.broken.is_empty() && self.open.is_empty() => Vec::new(),
            true => self.open_alone(model, now),
            false => now(),
        };
        for &stitch in &self.broken {
            if let Some(width) = widths.get_mut(stitch as usize) {
                *width = BROKEN;
            }
        }
        if let Some(weld) = self.weld.as_ref().filter(|_| !widths.is_empty()) {
            // Stitches between the same two particles are one: as wide as the widest, and broken with any.
            let mut by_ends = BTreeMap::new();
            for (stitch, width) in model.seams().stitches().iter().zip(widths) {
                let [a, b] = stitch.map(|i| weld.map[i as usize]);
                let own: &mut f64 = by_ends.entry([a.min(b), a.max(b)]).or_default();
                *own = own.max(width);
            }
            let stitches = weld.model.seams().stitches().iter();
            widths = stitches.map(|ends| by_ends.get(ends).copied().unwrap_or_default()).collect();
        }
        self.widths = widths;
    }
}

/// Whether steps are implicit, in all phases.
pub(super) const fn is_implicit(scene: &CompiledScene) -> bool {
    matches!(scene.config.integrator, Integrator::Implicit(_))
}

fn phase_at(scene: &CompiledScene, frame: u64) -> Option<usize> {
    scene.phases.iter().position(|phase| frame < phase.end)
}

#[cfg(test)]
mod tests {
    use cloth_scene::{CompileOptions, Scene};

    use super::*;

    /// Two strips of a cloth, three stitches between them.
    fn scene() -> CompiledScene {
        let folder = tempfile::tempdir().unwrap();
        let mut mesh = String::new();
        for (row, y) in [0.0, 0.1, 0.1, 0.2].into_iter().enumerate() {
            for x in [0.0, 0.1, 0.2] {
                mesh += &format!("v {x} {y} 0\nvt {x} {}\n", row as f64);
            }
        }
        for first in [1, 2, 7, 8] {
            let [a, b, c, d] = [first, first + 1, first + 4, first + 3];
            mesh += &format!("f {a}/{a} {b}/{b} {c}/{c}\nf {a}/{a} {c}/{c} {d}/{d}\n");
        }
        std::fs::write(folder.path().join("strips.obj"), mesh).unwrap();
        let text = r#"
name = "strips"
simulation.solver = "implicit"
cloth = [{ name = "strips", material.preset = "cotton", geometry.mesh.file = "strips.obj", pattern.from = "uv" }]
seam = [{ name = "seam", close = [0.0, 0.1], stitches = [[3, 6], [4, 7], [5, 8]] }]
"#;
        let mut scene = Scene::from_toml(text, "strips.toml").unwrap();
        scene.origin.directory = folder.path().to_owned();
        scene.compile(&CompileOptions::default()).unwrap()
    }

    /// Sides that are at one place would go through each other from there.
    #[test]
    fn what_is_welded_is_not_opened_again_for_what_is_caught_beside_it() {
        let scene = scene();
        let mut state = scene.model.initial_state();
        state.positions[7][2] = 2e-3;
        let before = Stage::of_state(&scene, 9, &state, (&[], &[])).unwrap();
        assert_eq!((before.is_welded, &*before.open), (true, &[1][..]));
        state.positions[7][2] = 0.0;
        let all = Stage::of_state(&scene, 10, &state, (&[], &[])).unwrap();
        assert!(all.open.is_empty() && before.welds(&all));
        let caught = [3, 4];
        let (fewer, left) = all.without(&scene, (&before, &state), &caught).unwrap();
        assert_eq!((&*fewer.open, left), (&[1][..], 1));
        let (fewer, left) = all.without(&scene, (&Stage::start(&scene), &state), &caught).unwrap();
        assert_eq!((&*fewer.open, left), (&[0, 1][..], 2), "where nothing is welded yet");
    }
}
