//! What the panel can change.
//!
//! Settings are values in SI units, as they are in force. A scene under changed settings says only what is different from before,
//! so that a preset stays a preset and a value that was chosen for the scene stays chosen.

mod fabric;
mod surroundings;

use cloth::{
    LinearMethod, Preconditioner,
    scene::{CompiledScene, Scene, SceneContact, SceneSolver, SceneWind},
};

pub use self::{fabric::ClothSettings, surroundings::SurfaceSettings};

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
    /// What each cloth is made of.
    pub cloths: Vec<ClothSettings>,
    /// Gravity \[m/s^2\].
    pub gravity: [f64; 3],
    /// The air and its wind; `None` for a vacuum.
    pub air: Option<SceneWind>,
    /// Contact of cloths with themselves and each other; `None` for off.
    pub contact: Option<SceneContact>,
    /// Surfaces of the colliders of the scene, then of its rigid bodies.
    pub surfaces: Vec<SurfaceSettings>,
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
    /// The settings that a scene comes with; `compiled` is what it compiles to.
    #[must_use]
    pub fn of_scene(scene: &Scene, compiled: &CompiledScene, backend: &str) -> Self {
        let simulation = &scene.simulation;
        Self {
            backend: backend.to_owned(),
            solver: compiled.choice.solver,
            linear: simulation.implicit.linear,
            preconditioner: simulation.implicit.preconditioner,
            iterations: simulation.implicit.iterations,
            time_step: compiled.config.time_step,
            cloths: scene
                .cloths
                .iter()
                .zip(&compiled.cloths)
                .map(|(cloth, compiled)| ClothSettings::new(cloth, compiled))
                .collect(),
            gravity: scene.gravity,
            air: scene.wind,
            contact: scene.contact_chosen().map(|contact| SceneContact {
                distance: compiled.model.self_contact().map(|contact| contact.distance),
                ..contact
            }),
            surfaces: surroundings::surfaces(scene),
            stage_times: false,
        }
    }

    /// How to get from `self` to `next`.
    pub(super) fn change_to(&self, next: &Self) -> SettingsChange {
        if self == next {
            return SettingsChange::None;
        }
        match (&self.air, &next.air) {
            (Some(air), Some(wanted)) => {
                let air = SceneWind { velocity: wanted.velocity, ..*air };
                let only_velocity = Self { air: Some(air), ..self.clone() } == *next;
                if only_velocity { SettingsChange::Live } else { SettingsChange::Rebuilt }
            }
            _ => SettingsChange::Rebuilt,
        }
    }

    /// `scene` under these settings; `original` are those that it comes with.
    pub(super) fn apply(&self, scene: &Scene, original: &Self) -> Scene {
        let mut scene = scene.clone();
        let simulation = &mut scene.simulation;
        if self.solver != original.solver {
            simulation.solver = Some(self.solver);
        }
        simulation.implicit.linear = self.linear;
        simulation.implicit.preconditioner = self.preconditioner;
        simulation.implicit.iterations = self.iterations;
        if self.time_step != original.time_step {
            simulation.solver = Some(self.solver);
            simulation.time_step_set(self.time_step);
        }
        for (cloth, (wanted, original)) in
            scene.cloths.iter_mut().zip(self.cloths.iter().zip(&original.cloths))
        {
            wanted.apply(original, cloth);
        }
        scene.gravity = self.gravity;
        scene.wind = self.air;
        // What nobody changed may have been chosen, and stays so.
        if self.contact != original.contact {
            scene.contact = Some(self.contact.clone().unwrap_or(SceneContact::NONE));
        }
        surroundings::surfaces_apply(&self.surfaces, &mut scene);
        scene
    }
}

#[cfg(test)]
mod tests {
    use cloth::scene::{CompileOptions, builtin_scenes};

    use super::*;

    fn settings(scene: &Scene) -> Settings {
        Settings::of_scene(scene, &scene.compile(&CompileOptions::default()).unwrap(), "cpu")
    }

    /// What a user has not touched is written as it was: presets, values that are not given, all.
    #[test]
    fn settings_that_nobody_changed_leave_a_scene_as_it_is() {
        for builtin in builtin_scenes() {
            let scene = Scene::builtin(builtin.name).unwrap();
            let settings = settings(&scene);
            assert_eq!(settings.apply(&scene, &settings), scene, "{}", builtin.name);
        }
    }

    #[test]
    fn a_scene_with_changed_settings_has_these_settings() {
        for builtin in builtin_scenes() {
            let scene = Scene::builtin(builtin.name).unwrap();
            let original = settings(&scene);
            let mut wanted = original.clone();
            wanted.time_step *= 0.5;
            wanted.gravity = [0.0, 0.1, -1.62];
            wanted.air = Some(SceneWind { velocity: [1.0, 2.0, 3.0], density: 0.9, gust: None });
            for (number, cloth) in wanted.cloths.iter_mut().enumerate() {
                let factor = 1.0 + 0.1 * (number + 1) as f64;
                cloth.material.stretch.stiffness *= factor;
                cloth.material.bend.damping = 0.003 * factor;
                cloth.material.thickness *= factor;
            }
            for surface in &mut wanted.surfaces {
                surface.friction = 0.77;
            }
            let changed = wanted.apply(&scene, &original);
            let text = changed.to_toml().unwrap();
            let read = Scene::from_toml(&text, "changed.toml").unwrap();
            let read = Scene { origin: scene.origin.clone(), ..read };
            let found = settings(&read);
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
            for (found, wanted) in found.cloths.iter().zip(&wanted.cloths) {
                assert!(near(found.material.thickness, wanted.material.thickness));
                // Fabric has no springs.
                if wanted.is_fabric {
                    continue;
                }
                let [found, wanted] = [found.material, wanted.material];
                assert!(near(found.stretch.stiffness, wanted.stretch.stiffness), "{found:?}");
                assert!(near(found.shear.stiffness, wanted.shear.stiffness), "{found:?}");
            }
            let exact = |settings: Settings| Settings { cloths: Vec::new(), ..settings };
            assert_eq!(exact(found), exact(wanted), "{}", builtin.name);
        }
    }

    #[test]
    fn the_velocity_of_the_wind_alone_is_live() {
        let scene = Scene::builtin("flag").unwrap();
        let old = settings(&scene);
        let with = |change: &dyn Fn(&mut SceneWind)| {
            let mut settings = old.clone();
            change(settings.air.as_mut().unwrap());
            old.change_to(&settings)
        };
        assert_eq!(old.change_to(&old), SettingsChange::None);
        assert_eq!(with(&|air| air.velocity[0] += 1.0), SettingsChange::Live);
        assert_eq!(with(&|air| air.density = 1.0), SettingsChange::Rebuilt);
        assert_eq!(with(&|air| air.gust = None), SettingsChange::Rebuilt);
        assert_eq!(old.change_to(&Settings { air: None, ..old.clone() }), SettingsChange::Rebuilt);
    }
}
