//! What a cloth is made of, as the panel shows it.

use cloth::{
    BendModel, ClothMaterial, FabricMaterial, Mass, Material, MaterialPreset, SpringCoefficients,
    scene::{
        CompiledCloth, SceneAerodynamics, SceneBend, SceneCloth, SceneGeometry, SceneMass,
        SceneMaterial, SceneSpring, SceneSpringClass,
    },
};

/// What one cloth is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct ClothSettings {
    /// Its name.
    pub name: String,
    /// The preset that its values come from, if any.
    pub preset: Option<String>,
    /// Whether it is made of triangles: then mass, thickness and air are its values, and springs mean nothing.
    pub is_fabric: bool,
    /// Its values. Of a network whose springs have values of their own, those of the first spring of each class.
    pub material: Material,
    /// Mean distance of its particles \[m\], at which a preset gives the values of its springs.
    pub spacing: f64,
}

impl ClothSettings {
    pub(super) fn new(cloth: &SceneCloth, compiled: &CompiledCloth) -> Self {
        let mut material = match compiled.material {
            ClothMaterial::Springs(material) => material,
            ClothMaterial::Fabric(FabricMaterial { fabric, aerodynamics, .. }) => Material {
                mass: Mass::PerArea(fabric.area_density),
                thickness: fabric.thickness,
                aerodynamics,
                ..MaterialPreset::DENIM.material(compiled.spacing)
            },
        };
        if let SceneGeometry::Network(network) = &cloth.geometry {
            let prototypes = network.prototypes.iter().map(|p| (p.class, p.stiffness, p.damping));
            let joints = network.joints.iter().map(|j| (j.class, j.stiffness, j.damping));
            let own: Vec<_> = prototypes.chain(joints).collect();
            for (class, coefficients) in classes(&mut material) {
                let first = own.iter().find_map(|&(of, stiffness, damping)| {
                    (of == class).then_some((stiffness?, damping.unwrap_or_default()))
                });
                if let Some((stiffness, damping)) = first {
                    *coefficients = SpringCoefficients { stiffness, damping };
                }
            }
        }
        Self {
            name: cloth.name.clone(),
            preset: cloth.material.preset.clone(),
            is_fabric: compiled.material.springs().is_none(),
            material,
            spacing: compiled.spacing,
        }
    }

    /// Takes all values from a preset.
    pub fn preset_choose(&mut self, preset: &MaterialPreset) {
        self.preset = Some(preset.name.into());
        // A fabric of that name has more than these, and brings them itself.
        if !self.is_fabric {
            self.material = preset.material(self.spacing);
        }
    }

    /// Writes down what differs from `original`, the settings that `cloth` comes with.
    pub(super) fn apply(&self, original: &Self, cloth: &mut SceneCloth) {
        let mut base = original.material;
        if self.is_fabric {
            if self.preset != original.preset {
                cloth.material.preset.clone_from(&self.preset);
                cloth.material.sheet = None;
            }
            let own = Material {
                mass: self.material.mass,
                thickness: self.material.thickness,
                aerodynamics: self.material.aerodynamics,
                ..base
            };
            material_change(&base, &own, &mut cloth.material);
            return;
        }
        if self.preset != original.preset
            && let Some(preset) = self.preset.as_deref().and_then(MaterialPreset::find)
        {
            base = preset.material(self.spacing);
            cloth.material = SceneMaterial { preset: self.preset.clone(), ..Default::default() };
        }
        material_change(&base, &self.material, &mut cloth.material);
        if let SceneGeometry::Network(network) = &mut cloth.geometry {
            let (mut from, mut to) = (original.material, self.material);
            let pairs = classes(&mut from).into_iter().zip(classes(&mut to));
            for ((class, from), (_, to)) in pairs.filter(|((_, from), (_, to))| from != to) {
                let change = |stiffness: &mut Option<f64>, damping: &mut Option<f64>| {
                    // Springs without values of their own follow the material.
                    if let Some(stiffness) = stiffness {
                        *stiffness *= to.stiffness / from.stiffness;
                        let old = damping.unwrap_or_default();
                        let ratio = to.damping / from.damping;
                        let scaled = if from.damping > 0.0 { old * ratio } else { to.damping };
                        *damping = Some(scaled);
                    }
                };
                for prototype in network.prototypes.iter_mut().filter(|p| p.class == class) {
                    change(&mut prototype.stiffness, &mut prototype.damping);
                }
                for joint in network.joints.iter_mut().filter(|j| j.class == class) {
                    change(&mut joint.stiffness, &mut joint.damping);
                }
            }
        }
    }
}

/// The springs of each class.
fn classes(material: &mut Material) -> [(SceneSpringClass, &mut SpringCoefficients); 3] {
    [
        (SceneSpringClass::Stretch, &mut material.stretch),
        (SceneSpringClass::Shear, &mut material.shear),
        (SceneSpringClass::Bend, &mut material.bend),
    ]
}

/// Puts what differs between two materials into what a scene says.
fn material_change(from: &Material, to: &Material, scene: &mut SceneMaterial) {
    let changed = |from: f64, to: f64| (from != to).then_some(to);
    let masses_differ = from.mass != to.mass;
    if masses_differ {
        scene.mass = Some(match to.mass {
            Mass::PerArea(value) => SceneMass::PerArea(value),
            Mass::PerParticle(value) => SceneMass::PerParticle(value),
        });
    }
    scene.thickness = changed(from.thickness, to.thickness).or(scene.thickness);
    // Without a preset a damping that nobody gave follows from stiffness and mass, so it is written down where one of them changed.
    let follows = scene.preset.is_none();
    let spring = |from: SpringCoefficients, to: SpringCoefficients, given: Option<SceneSpring>| {
        let old = given.unwrap_or_default();
        let stiffness = changed(from.stiffness, to.stiffness);
        let implied = follows && (stiffness.is_some() || masses_differ);
        let damping = changed(from.damping, to.damping).or(old.damping);
        let new = SceneSpring {
            stiffness: stiffness.or(old.stiffness),
            damping: damping.or(implied.then_some(to.damping)),
        };
        // An empty table says no more than none.
        if new == old { given } else { Some(new) }
    };
    scene.stretch = spring(from.stretch, to.stretch, scene.stretch);
    scene.shear = spring(from.shear, to.shear, scene.shear);
    let bend =
        scene.bend.map(|bend| SceneSpring { stiffness: bend.stiffness, damping: bend.damping });
    let bend = spring(from.bend, to.bend, bend);
    let rigidity = scene.bend.and_then(|bend| bend.rigidity);
    let rigidity = match to.bend_model {
        BendModel::ImmediateBuckling { rigidity } if from.bend_model != to.bend_model => {
            Some(rigidity)
        }
        _ => rigidity,
    };
    if bend.is_some() || rigidity.is_some() {
        let bend = bend.unwrap_or_default();
        let SceneSpring { stiffness, damping } = bend;
        scene.bend = Some(SceneBend { stiffness, damping, rigidity });
    }
    let old = scene.aerodynamics.unwrap_or_default();
    let (from, to) = (from.aerodynamics, to.aerodynamics);
    let air = SceneAerodynamics {
        pressure: changed(from.pressure, to.pressure).or(old.pressure),
        friction: changed(from.friction, to.friction).or(old.friction),
    };
    if air != old {
        scene.aerodynamics = Some(air);
    }
}

#[cfg(test)]
mod tests {
    use cloth::scene::{CompileOptions, Scene};

    use super::*;

    /// A flag of springs.
    const FLAG: &str = r#"
        name = "flag"
        [[cloth]]
        name = "flag"
        geometry.grid = { columns = 61, rows = 41, spacing = 0.025 }
        material = { preset = "jet-set", mass.per_area = 0.2, stretch.stiffness = 80, shear.stiffness = 40, bend = { stiffness = 25, damping = 0.015 } }
    "#;

    fn flag() -> (Scene, ClothSettings) {
        let scene = Scene::from_toml(FLAG, "flag.toml").unwrap();
        let compiled = scene.compile(&CompileOptions::default()).unwrap();
        let settings = ClothSettings::new(&scene.cloths[0], &compiled.cloths[0]);
        (scene, settings)
    }

    #[test]
    fn values_are_those_of_the_scene_in_si_units() {
        let (_, settings) = flag();
        assert_eq!(settings.preset.as_deref(), Some("jet-set"));
        assert_eq!(settings.material.mass, Mass::PerArea(0.2));
        assert_eq!(settings.material.stretch.stiffness, 80.0);
        assert_eq!(settings.material.bend, SpringCoefficients { stiffness: 25.0, damping: 0.015 });
        // Nobody says this one but the preset.
        assert_eq!(settings.material.thickness, 0.3e-3);
        assert!((settings.spacing - 0.025).abs() < 1e-12);
    }

    #[test]
    fn only_what_changed_is_written() {
        let (scene, original) = flag();
        let mut wanted = original.clone();
        wanted.material.shear.damping = 0.02;
        wanted.material.thickness = 1e-3;
        let mut cloth = scene.cloths[0].clone();
        wanted.apply(&original, &mut cloth);
        let mut expected = scene.cloths[0].clone();
        expected.material.shear.as_mut().unwrap().damping = Some(0.02);
        expected.material.thickness = Some(1e-3);
        assert_eq!(cloth, expected);
    }

    #[test]
    fn another_preset_replaces_what_the_scene_said() {
        let (scene, original) = flag();
        let mut wanted = original.clone();
        let jersey = MaterialPreset::find("jersey").unwrap();
        wanted.preset_choose(jersey);
        let mut cloth = scene.cloths[0].clone();
        wanted.apply(&original, &mut cloth);
        let plain = SceneMaterial { preset: Some("jersey".into()), ..Default::default() };
        assert_eq!(cloth.material, plain);
        // And a change on top of it.
        wanted.material.stretch.stiffness = 99.0;
        wanted.apply(&original, &mut cloth);
        assert_eq!(cloth.material.stretch.unwrap().stiffness, Some(99.0));
        assert_eq!(cloth.material.preset.as_deref(), Some("jersey"));
    }

    /// Springs of a network with values of their own keep their ratio.
    #[test]
    fn springs_of_a_network_change_together() {
        let text = r#"
            name = "net"
            [[cloth]]
            name = "net"
            material = { thickness = 1e-3, mass.per_particle = 1e-3, stretch = { stiffness = 5 }, shear = { stiffness = 5 }, bend = { stiffness = 5 } }
            [cloth.geometry.network]
            width = 2
            height = 2
            positions = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
            prototype = [{ class = "stretch", stiffness = 10, damping = 0.1 }, { class = "shear" }]
            joint = [{ from = 0, to = 3, class = "stretch", stiffness = 30, damping = 0.2 }]
        "#;
        let scene = Scene::from_toml(text, "net.toml").unwrap();
        let compiled = scene.compile(&CompileOptions::default()).unwrap();
        let original = ClothSettings::new(&scene.cloths[0], &compiled.cloths[0]);
        assert_eq!(original.material.stretch, SpringCoefficients { stiffness: 10.0, damping: 0.1 });
        assert_eq!(original.material.shear.stiffness, 5.0);
        let mut wanted = original.clone();
        wanted.material.stretch = SpringCoefficients { stiffness: 20.0, damping: 0.1 };
        wanted.material.shear.stiffness = 7.0;
        let mut cloth = scene.cloths[0].clone();
        wanted.apply(&original, &mut cloth);
        let SceneGeometry::Network(network) = &cloth.geometry else { panic!("no network") };
        assert_eq!(network.prototypes[0].stiffness, Some(20.0));
        assert_eq!(network.joints[0].stiffness, Some(60.0));
        assert_eq!(network.joints[0].damping, Some(0.2));
        assert_eq!(network.prototypes[1].stiffness, None);
        assert_eq!(cloth.material.shear.unwrap().stiffness, Some(7.0));
        // Nobody gave a damping, and it stays what it was when the stiffness changed.
        assert_eq!(cloth.material.shear.unwrap().damping, Some(original.material.shear.damping));
        assert_eq!(cloth.material.bend.unwrap().damping, None);
    }
}
