//! Solvers of later stages, and how what is welded comes together.

use std::{collections::BTreeMap, sync::Arc};

use cloth_core::{
    Backend, Control, Error, Frame, Model, PinAction, PinControl, Pinch, Pulls, Result, Solver,
    SolverConfig, State, Stitching, TimeStepControl, VertexClasses,
};
use cloth_scene::CompiledScene;

use super::stage::{Stage, is_implicit};

/// How long what is to be welded takes to come together \[s\]: nothing else moves in it.
const GATHERING: f64 = 1e-6;

type Factory<S> = Box<dyn Fn(Arc<Model>, &SolverConfig) -> Result<S> + Send>;

/// Makes the solvers of later stages.
pub(crate) struct Sewing<S> {
    factory: Option<Factory<S>>,
    backend: &'static str,
    stage: Stage,
}

impl<S> Default for Sewing<S> {
    fn default() -> Self {
        Self { factory: None, backend: "given", stage: Stage::default() }
    }
}

impl Sewing<Box<dyn Solver>> {
    pub(crate) fn new(backend: &dyn Backend, stage: Stage) -> Self {
        let of = |backend: Box<dyn Backend>| -> Factory<Box<dyn Solver>> {
            Box::new(move |model, config| backend.create_solver(model, config))
        };
        Self { factory: backend.share().map(of), backend: backend.info().name, stage }
    }
}

impl<S> Sewing<S> {
    pub(crate) const fn stage(&self) -> &Stage {
        &self.stage
    }

    pub(crate) fn stage_set(&mut self, stage: Stage) {
        self.stage = stage;
    }

    /// Brings what becomes one in a weld to one place, past all else by the certificate of contact, which carries along what is in its way. Velocities
    /// stay.
    ///
    /// # Errors
    /// Those of the solver.
    pub(crate) fn gathered(
        &self,
        (scene, next): (&CompiledScene, &Stage),
        (config, state): (&SolverConfig, &State),
    ) -> Result<Gathered>
    where
        S: Solver,
    {
        let model = &scene.model;
        let (time, torn) = (state.time, next.torn());
        let now = || model.stitch_widths(&state.positions, is_implicit(scene));
        let widths = &next.open_alone(model, now);
        let joined = model.sewn_at(&Stitching { time, pulls: Pulls::None, widths, torn });
        let config = SolverConfig {
            time_step: GATHERING,
            time_step_control: TimeStepControl::Fixed,
            pinch: Pinch::Refuse,
            ..config.clone()
        };
        let mut solver = self.solver(Arc::new(joined), &config)?;
        let still = vec![[0.0; 3]; state.velocities.len()];
        solver.upload(&State { velocities: still, slips: Vec::new(), ..state.clone() })?;
        solver.set_control(&gathering((&next.classes(model), model.masses()), state))?;
        let moved = solver.advance(Frame { duration: GATHERING });
        match moved.and_then(|_| solver.synchronize()) {
            Ok(_) => {}
            Err(Error::Pinched { all, place, .. } | Error::PinchedByBody { all, place, .. }) => {
                return Ok(Gathered::Caught(Caught { particles: all, place }));
            }
            Err(error) => return Err(error),
        }
        let mut gathered = State::default();
        solver.download(&mut gathered)?;
        Ok(Gathered::At(State { positions: gathered.positions, ..state.clone() }))
    }

    /// A solver for another stage.
    pub(crate) fn solver(&self, model: Arc<Model>, config: &SolverConfig) -> Result<S> {
        let Some(factory) = &self.factory else {
            let feature = "seams that close and phases here, where its solver was made elsewhere (cpu, reference, wgpu and cuda do by `cloth run`)";
            return Err(Error::Unsupported { backend: self.backend, feature: feature.into() });
        };
        factory(model, config)
    }
}

/// What came of it to bring particles together.
pub(crate) enum Gathered {
    /// The state in which they are.
    At(State),
    /// What is in the way.
    Caught(Caught),
}

/// What is caught between stitches.
pub(crate) struct Caught {
    /// Particles that are in each other's way, and those that push them; others than those of the model are left out.
    pub(crate) particles: Vec<u32>,
    /// Where one of them is \[m\].
    pub(crate) place: [f64; 3],
}

/// Moves the particles of each class to the centre of their mass. What is held already is left alone, and what is one place is held there.
fn gathering((classes, masses): (&VertexClasses, &[f64]), state: &State) -> Control {
    let mut members: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for particle in 0..masses.len() {
        members.entry(classes.of(particle as u32)).or_default().push(particle);
    }
    let mut pins = Vec::new();
    for of_class in members.values().filter(|of_class| of_class.len() > 1) {
        let (place, ..) = state.joined(of_class, masses);
        let free = of_class.iter().filter(|particle| state.held[**particle] == 0);
        let action = PinAction::MoveTo(place);
        pins.extend(free.map(|particle| PinControl { particle: *particle as u32, action }));
    }
    pins.sort_unstable_by_key(|pin| pin.particle);
    Control { pins, ..Control::default() }
}

/// Gives a control for particles to those that they became. Of several that are one now the control of the first counts.
pub(crate) fn control_map(control: &mut Control, map: &[u32]) {
    fn is_first(particle: &mut u32, map: &[u32], firsts: &mut BTreeMap<u32, u32>) -> bool {
        let own = *particle;
        *particle = map.get(own as usize).copied().unwrap_or(own);
        *firsts.entry(*particle).or_insert(own) == own
    }
    let mut firsts = BTreeMap::new();
    control.pins.retain_mut(|pin| is_first(&mut pin.particle, map, &mut firsts));
    if let Some(forces) = &mut control.forces {
        firsts.clear();
        forces.retain_mut(|force| is_first(&mut force.particle, map, &mut firsts));
    }
}
