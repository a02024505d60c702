//! What is simulated at a time: seams that close, seams that are welded, edges that are torn, phases.
//!
//! A model never changes, and neither does the one of a solver. Where a scene changes, another solver goes on from the state of the one before:
//! every backend can do that.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use cloth_core::{
    BROKEN, Integrator, Model, Pulls, Result, SolverConfig, State, Stitching, VertexClasses, Weld,
    Welding,
};
use cloth_scene::CompiledScene;
use glam::DVec3;

use super::sewing::Caught;

/// Stitches wider than this \[m\] are not welded: their vertices would jump.
const WELD_GAP: f64 = 1e-3;

/// Share of the stitches that may be wider when others are welded.
const OPEN_MAX: f64 = 0.1;

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

    /// The stage of `frame`, which starts at `state`. What is simulated in it is not made yet if it [`Self::welds`] anything.
    ///
    /// # Errors
    /// What cannot be welded.
    pub(crate) fn next(&self, scene: &CompiledScene, frame: u64, state: &State) -> Result<Self> {
        let start_frame = frame as f64 + ROUNDING;
        let seams = scene.model.seams();
        let first = seams.weld_time().map(|time| time * scene.frames_per_second);
        // Something may be caught between, mostly for long, and each try takes longer than some frames.
        let is_turn = |first: f64| {
            let late = frame.saturating_sub((first - ROUNDING).ceil() as u64);
            late == 0 || late.is_power_of_two()
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
        // To make a model takes longer than a frame.
        if self.is_same_weld(&next) {
            next.widths_set(scene, state);
        } else if !self.welds(&next) {
            next.weld_set(scene, state)?;
        }
        Ok(next)
    }

    /// Makes what is simulated at `state`.
    ///
    /// # Errors
    /// What cannot be welded.
    pub(crate) fn weld_set(&mut self, scene: &CompiledScene, state: &State) -> Result<()> {
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

    /// The same stage of a scene at `state`, where no more is welded than in `before`, and as much torn.
    pub(crate) fn unwelded(&self, scene: &CompiledScene, state: &State, before: &Self) -> Self {
        let (is_welded, open, weld) = (before.is_welded, before.open.clone(), before.weld.clone());
        let mut stage = Self { is_welded, open, weld, ..self.clone() };
        stage.widths_set(scene, state);
        stage
    }

    /// The stitches that are welded between this stage and `next`, ascending.
    pub(crate) fn welds_of(&self, scene: &CompiledScene, next: &Self) -> Vec<u32> {
        let is_welded = |stage: &Self, stitch: &u32| {
            stage.is_welded && stage.open.binary_search(stitch).is_err()
        };
        let stitches = scene.model.seams().to_weld();
        stitches.filter(|stitch| is_welded(next, stitch) && !is_welded(self, stitch)).collect()
    }

    /// The same stage in which these stitches are open as well. What is simulated in it is not made yet.
    pub(crate) fn without(&self, stitches: impl IntoIterator<Item = u32>) -> Self {
        let mut stage = self.clone();
        stage.open.extend(stitches);
        stage.open.sort_unstable();
        stage.open.dedup();
        stage
    }

    /// Which particles are one in this stage.
    pub(crate) fn classes(&self, model: &Model) -> VertexClasses {
        model.welded_classes(&self.open, &self.torn)
    }

    /// Which of these stitches have something of what is caught at their ends in this stage, or the nearest one if none has; ascending.
    pub(crate) fn caught_among(
        &self,
        model: &Model,
        state: &State,
        (stitches, caught): (&[u32], &Caught),
    ) -> Vec<u32> {
        let classes = self.classes(model);
        let own = caught.particles.iter().filter(|i| (**i as usize) < model.particle_count());
        let places: BTreeSet<u32> = own.map(|i| classes.of(*i)).collect();
        let ends = |stitch: u32| model.seams().stitches()[stitch as usize];
        let meets = |stitch: &u32| ends(*stitch).iter().any(|i| places.contains(&classes.of(*i)));
        let found: Vec<u32> = stitches.iter().copied().filter(meets).collect();
        if !found.is_empty() {
            return found;
        }
        let at = |i: u32| DVec3::from(state.positions[i as usize]);
        let way = |stitch: &u32| at(ends(*stitch)[0]).distance_squared(caught.place.into());
        let nearest = stitches.iter().copied().min_by(|a, b| way(a).total_cmp(&way(b)));
        nearest.into_iter().collect()
    }

    /// Whether the solver of this stage cannot go on in `next`.
    pub(crate) fn needs_solver(&self, scene: &CompiledScene, next: &Self) -> bool {
        self.is_welded != next.is_welded
            || self.open != next.open
            || self.torn != next.torn
            || self.phase != next.phase
            || self.widths != next.widths
            || scene.model.is_sewn_between([self.time, next.time], self.pulls(scene))
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
            pulls: self.pulls(scene),
            widths: &self.widths,
            torn: &[],
        });
        let own = model.gravity();
        let model = model.with_gravity(gravity.unwrap_or(own));
        let model = if bending == 1.0 { model } else { model.with_bending(bending) };
        (Arc::new(model), config)
    }

    /// Which stitches that are late become stiffer. Once the first are welded, something is caught between those that are left but nearest to each other: they
    /// would press it against the certificate, and iterations of Newton's method would find no end.
    fn pulls(&self, scene: &CompiledScene) -> Pulls {
        match is_implicit(scene) {
            true if self.is_welded => Pulls::Wide,
            true => Pulls::All,
            false => Pulls::None,
        }
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

    #[test]
    fn what_is_caught_is_left_open_or_the_nearest_stitch() {
        let scene = scene();
        let mut state = scene.model.initial_state();
        state.positions[7][2] = 2e-3;
        let before = Stage::of_state(&scene, 9, &state, (&[], &[])).unwrap();
        assert_eq!((before.is_welded, &*before.open), (true, &[1][..]));
        state.positions[7][2] = 0.0;
        let all = Stage::of_state(&scene, 10, &state, (&[], &[])).unwrap();
        assert!(all.open.is_empty() && before.welds(&all));
        assert_eq!(before.welds_of(&scene, &all), [1], "the others are welded already");
        let new = Stage::start(&scene).welds_of(&scene, &all);
        assert_eq!(new, [0, 1, 2]);
        let caught =
            |particles: &[u32]| Caught { particles: particles.to_vec(), place: [0.19, 0.1, 0.0] };
        let among = |particles| all.caught_among(&scene.model, &state, (&new, &caught(particles)));
        assert_eq!(among(&[3, 4]), [0, 1]);
        assert_eq!(among(&[99]), [2], "the nearest one to a body");
        let fewer = all.without([1, 0]);
        assert_eq!((&*fewer.open, fewer.welded(&scene)), (&[0, 1][..], 1));
    }

    /// Particles are one by classes as they are in the model that is simulated.
    #[test]
    fn classes_are_those_of_the_weld() {
        let scene = scene();
        for open in [&[][..], &[1]] {
            let welding = Welding { sews: true, open, torn: &[] };
            let map = scene.welds.at(welding).unwrap().unwrap().map.clone();
            let classes = scene.model.welded_classes(open, &[]);
            for (a, b) in (0..12).flat_map(|a| (0..12).map(move |b| (a, b))) {
                let is_one = map[a as usize] == map[b as usize];
                assert_eq!(classes.of(a) == classes.of(b), is_one, "{a} {b}");
            }
        }
    }
}
