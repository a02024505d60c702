//! What the panel can change.

use cloth::{
    LinearMethod, Model, Preconditioner, SpringClass,
    scene::{
        Scene, SceneBend, SceneContact, SceneContactResponse, SceneSolver, SceneSpring, SceneWind,
    },
};

/// Settings of a running scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Name of the backend.
    pub backend: String,
    /// The integrator.
    pub solver: SceneSolver,
    /// Method for the linear systems of the implicit integrator.
    pub linear: LinearMethod,
    /// Preconditioner of conjugate gradients.
    pub preconditioner: Preconditioner,
    /// Cap on the iterations of each linear solve.
    pub iterations: u32,
    /// Length of a substep \[s\] of the integrator in use.
    pub time_step: f64,
    /// Stiffness of stretch, shear and bend springs in units of that of the scene.
    pub stiffness: [f64; 3],
    /// Damping of all springs in units of that of the scene.
    pub damping: f64,
    /// Wind velocity \[m/s\].
    pub wind: [f64; 3],
    /// Distance of self-contact \[m\]; `None` for off.
    pub contact: Option<f64>,
    /// Whether the backend `wgpu` takes the time of every stage, which costs speed; others take it
    /// always.
    pub stage_times: bool,
}

/// How a change of settings was carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SettingsChange {
    /// Nothing was different.
    None,
    /// From the next frame on, in the same solver.
    Live,
    /// With a new solver that took over the state.
    Rebuilt,
}

impl Settings {
    /// The settings that a scene comes with.
    #[must_use]
    pub fn of_scene(scene: &Scene, backend: &str) -> Self {
        let simulation = &scene.simulation;
        Self {
            backend: backend.to_owned(),
            solver: simulation.solver,
            linear: simulation.implicit.linear,
            preconditioner: simulation.implicit.preconditioner,
            iterations: simulation.implicit.iterations,
            time_step: simulation.solver_time_step(),
            stiffness: [1.0; 3],
            damping: 1.0,
            wind: scene.wind.map_or([0.0; 3], |wind| wind.velocity),
            contact: scene.contact.map(|contact| contact.distance),
            stage_times: false,
        }
    }

    /// How to get from `self` to `next` in a model that has air or not.
    pub(super) fn change_to(&self, next: &Self, has_air: bool) -> SettingsChange {
        if self == next {
            return SettingsChange::None;
        }
        let only_wind = Self { wind: next.wind, ..self.clone() } == *next;
        if only_wind && has_air { SettingsChange::Live } else { SettingsChange::Rebuilt }
    }

    /// `scene` under these settings; `model` is what it compiles to without them.
    pub(super) fn apply(&self, scene: &Scene, model: &Model) -> Scene {
        let mut scene = scene.clone();
        let simulation = &mut scene.simulation;
        simulation.solver = self.solver;
        simulation.implicit.linear = self.linear;
        simulation.implicit.preconditioner = self.preconditioner;
        simulation.implicit.iterations = self.iterations;
        *simulation.solver_time_step_mut() = self.time_step;
        if self.stiffness != [1.0; 3] || self.damping != 1.0 {
            self.apply_springs(&mut scene, model);
        }
        match &mut scene.wind {
            Some(wind) => wind.velocity = self.wind,
            None if self.wind != [0.0; 3] => {
                scene.wind = Some(SceneWind { velocity: self.wind, density: 1.204, gust: None });
            }
            None => {}
        }
        scene.contact = self.contact.map(|distance| {
            let response = scene.contact.map_or(
                SceneContactResponse::Impulse { restitution: 0.0, friction: 0.3 },
                |contact| contact.response,
            );
            SceneContact { distance, response }
        });
        scene
    }

    fn apply_springs(&self, scene: &mut Scene, model: &Model) {
        for (number, cloth) in scene.cloths.iter_mut().enumerate() {
            let coefficients = |class, factor: f64| {
                let kind = spring_kind(model, number, class)?;
                Some((kind.stiffness * factor, kind.damping * self.damping))
            };
            let material = &mut cloth.material;
            let [stretch, shear, bend] = self.stiffness;
            let spring = |class, factor| {
                let (stiffness, damping) = coefficients(class, factor)?;
                Some(SceneSpring { stiffness: Some(stiffness), damping: Some(damping) })
            };
            material.stretch = spring(SpringClass::Stretch, stretch).or(material.stretch);
            material.shear = spring(SpringClass::Shear, shear).or(material.shear);
            if let Some((stiffness, damping)) = coefficients(SpringClass::Bend, bend) {
                let rigidity = spring_kind(model, number, SpringClass::Bend)
                    .and_then(|kind| kind.rigidity)
                    .map(|rigidity| rigidity * bend);
                material.bend = Some(SceneBend {
                    stiffness: Some(stiffness),
                    damping: Some(damping),
                    rigidity,
                });
            }
        }
    }
}

/// The first spring of a class in a cloth; all of a class are alike but for their length.
fn spring_kind(model: &Model, cloth: usize, class: SpringClass) -> Option<cloth::SpringKind> {
    let range = &model.cloths().get(cloth)?.particles;
    let springs = model.springs();
    let mut of_cloth = range.clone().flat_map(|particle| springs.row(particle as usize));
    of_cloth.find_map(|spring| {
        let kind = springs.kinds()[springs.kind_indices()[spring] as usize];
        (kind.class == class).then_some(kind)
    })
}
