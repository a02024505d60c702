//! What a model asks of a kernel: the one list by which special forms of kernels are allowed.

use super::{ContactResponse, InteractionKind, Model, RegularPatch};
use crate::{Error, Integrator, Precision, SolverConfig};

/// One thing that a model and its settings ask of a kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Feature {
    /// Springs between particles.
    Springs,
    /// Bend springs that buckle.
    Buckling,
    /// Triangles of fabric that stretch and bend.
    Fabric,
    /// The force of the air on triangles.
    Air,
    /// Contact of cloth with cloth by penalty forces.
    PenaltyContact,
    /// Contact of cloth with cloth by impulses.
    ImpulseContact,
    /// Contact of the triangles of cloth.
    TriangleContact,
    /// Springs that are shortened after each substep.
    StrainLimit,
    /// Colliders.
    Colliders,
    /// What colliders do to cloth is summed up.
    ColliderImpulses,
    /// Fields that are given as expressions.
    ProceduralFields,
    /// Double precision.
    DoublePrecision,
    /// Springs that are not those of one regular patch.
    AnyMesh,
    /// Springs of a patch that are not those to 12 neighbours, alike in each direction.
    UnlikeSprings,
}

impl Feature {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Springs,
        Self::Buckling,
        Self::Fabric,
        Self::Air,
        Self::PenaltyContact,
        Self::ImpulseContact,
        Self::TriangleContact,
        Self::StrainLimit,
        Self::Colliders,
        Self::ColliderImpulses,
        Self::ProceduralFields,
        Self::DoublePrecision,
        Self::AnyMesh,
        Self::UnlikeSprings,
    ];

    /// It in words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Springs => "springs",
            Self::Buckling => "buckling of bend springs",
            Self::Fabric => "triangles of fabric",
            Self::Air => "the force of the air",
            Self::PenaltyContact => "contact by penalty forces",
            Self::ImpulseContact => "contact by impulses",
            Self::TriangleContact => "contact of triangles",
            Self::StrainLimit => "a strain limit",
            Self::Colliders => "colliders",
            Self::ColliderImpulses => "the sum of what colliders do to cloth",
            Self::ProceduralFields => "fields given as expressions",
            Self::DoublePrecision => "double precision",
            Self::AnyMesh => "springs that are not those of one regular patch",
            Self::UnlikeSprings => {
                "springs of a patch that are not those to 12 neighbours, alike in each direction"
            }
        }
    }

    const fn bit(self) -> u32 {
        1 << self as u32
    }
}

/// A set of features.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct FeatureSet(u32);

impl FeatureSet {
    /// These features.
    #[must_use]
    pub const fn of(features: &[Feature]) -> Self {
        let (mut set, mut at) = (0, 0);
        while at < features.len() {
            set |= features[at].bit();
            at += 1;
        }
        Self(set)
    }

    /// All but these features.
    #[must_use]
    pub const fn all_but(features: &[Feature]) -> Self {
        Self(Self::of(&Feature::ALL).0 & !Self::of(features).0)
    }

    /// Whether it has a feature.
    #[must_use]
    pub const fn has(self, feature: Feature) -> bool {
        self.0 & feature.bit() != 0
    }

    /// The features, in the order of [`Feature::ALL`].
    pub fn iter(self) -> impl Iterator<Item = Feature> {
        Feature::ALL.into_iter().filter(move |&feature| self.has(feature))
    }

    /// The first of its features that `allowed` does not have.
    #[must_use]
    pub fn first_beyond(self, allowed: Self) -> Option<Feature> {
        self.iter().find(|&feature| !allowed.has(feature))
    }
}

/// What a model and its settings ask for, computed once. A kernel's special form lists the features that it takes; a feature
/// that it does not list rules it out, and so does one that is added here later.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModelFeatures {
    /// Kinds of interactions that there are.
    pub interactions: Vec<InteractionKind>,
    /// Whether some bend spring buckles.
    pub buckling: bool,
    /// How cloth responds to cloth, if it does.
    pub contact: Option<ContactFeature>,
    /// Whether springs are limited.
    pub strain_limit: bool,
    /// Whether there are colliders.
    pub colliders: bool,
    /// Whether what they do is summed up.
    pub collider_impulses: bool,
    /// Whether a field is given as an expression.
    pub procedural_fields: bool,
    /// Precision of the solver.
    pub precision: Precision,
    /// How regular the springs are.
    pub shape: ModelShape,
}

/// How regular the springs of a model are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelShape {
    /// One [`RegularPatch`] with the springs of its [`stencil`](RegularPatch::stencil).
    AlikePatch,
    /// Another [`RegularPatch`].
    Patch,
    /// Any other model.
    Mesh,
}

/// How cloth responds to cloth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactFeature {
    /// [`ContactResponse::Penalty`].
    Penalty,
    /// [`ContactResponse::Impulse`].
    Impulse,
    /// [`ContactResponse::Triangles`].
    Triangles,
}

impl Model {
    /// Checks, for a backend, that the integrator is not asked for what none of its backends has: contact of triangles in the
    /// midpoint one.
    ///
    /// # Errors
    /// `Unsupported`, with the integrators that take it.
    pub fn check_integrator(
        &self,
        config: &SolverConfig,
        backend: &'static str,
    ) -> Result<(), Error> {
        if self.has_triangle_contact() && matches!(config.integrator, Integrator::Midpoint(_)) {
            let with = "the midpoint integrator (explicit, implicit and semi-implicit have it)";
            return Err(Error::Unsupported {
                backend,
                feature: format!("contact of triangles with {with}"),
            });
        }
        Ok(())
    }
}

impl ModelFeatures {
    /// What `model` asks for when it is solved by these settings.
    #[must_use]
    pub fn new(model: &Model, config: &SolverConfig) -> Self {
        let interactions = model.interactions();
        Self {
            interactions: interactions.lists().iter().map(|list| list.kind()).collect(),
            buckling: model.springs().kinds().iter().any(|kind| kind.buckling().is_some()),
            contact: model.self_contact().map(|contact| match contact.response {
                ContactResponse::Penalty { .. } => ContactFeature::Penalty,
                ContactResponse::Impulse { .. } => ContactFeature::Impulse,
                ContactResponse::Triangles { .. } => ContactFeature::Triangles,
            }),
            strain_limit: config.strain_limit.is_some(),
            colliders: !model.colliders().is_empty(),
            collider_impulses: model.collider_impulses() && !model.colliders().is_empty(),
            procedural_fields: model.has_procedural_fields(),
            precision: config.precision,
            shape: match RegularPatch::of(model) {
                Some(patch) if patch.stencil(model).is_some() => ModelShape::AlikePatch,
                Some(_) => ModelShape::Patch,
                None => ModelShape::Mesh,
            },
        }
    }

    /// The same as a set. Every field of this struct and every kind of interaction has to be named here.
    #[must_use]
    pub fn set(&self) -> FeatureSet {
        let Self {
            interactions,
            buckling,
            contact,
            strain_limit,
            colliders,
            collider_impulses,
            procedural_fields,
            precision,
            shape,
        } = self;
        let mut found: Vec<Feature> = interactions
            .iter()
            .map(|kind| match kind {
                InteractionKind::Spring => Feature::Springs,
                InteractionKind::Membrane | InteractionKind::Bending | InteractionKind::Fold => {
                    Feature::Fabric
                }
                InteractionKind::AirTriangle => Feature::Air,
            })
            .collect();
        match contact {
            Some(ContactFeature::Penalty) => found.push(Feature::PenaltyContact),
            Some(ContactFeature::Impulse) => found.push(Feature::ImpulseContact),
            Some(ContactFeature::Triangles) => found.push(Feature::TriangleContact),
            None => {}
        }
        match precision {
            Precision::F32 => {}
            Precision::F64 => found.push(Feature::DoublePrecision),
        }
        match shape {
            ModelShape::AlikePatch => {}
            ModelShape::Patch => found.push(Feature::UnlikeSprings),
            ModelShape::Mesh => found.extend([Feature::AnyMesh, Feature::UnlikeSprings]),
        }
        let flags = [
            (*buckling, Feature::Buckling),
            (*strain_limit, Feature::StrainLimit),
            (*colliders, Feature::Colliders),
            (*collider_impulses, Feature::ColliderImpulses),
            (*procedural_fields, Feature::ProceduralFields),
        ];
        found.extend(
            flags.into_iter().filter(|(is_asked, _)| *is_asked).map(|(_, feature)| feature),
        );
        FeatureSet::of(&found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Air, Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder, SelfContact, Stencil,
        StrainLimit,
    };

    fn features(stencil: Stencil, edit: impl FnOnce(ModelBuilder) -> ModelBuilder) -> FeatureSet {
        let patch = GridPatch { stencil, ..GridPatch::horizontal(12, 0.02, 0.0) };
        let cloth = Cloth {
            name: "cloth".into(),
            geometry: Geometry::Grid(patch),
            material: MaterialPreset::JERSEY.material(0.02).into(),
            pins: vec![],
            velocity: [0.0; 3],
        };
        let model = edit(ModelBuilder::new().cloth(cloth)).build().unwrap();
        ModelFeatures::new(&model, &SolverConfig::default()).set()
    }

    #[test]
    fn what_a_model_has_is_in_its_set() {
        let plain = features(Stencil::Neighbours12, |builder| builder);
        assert_eq!(plain.iter().collect::<Vec<_>>(), [Feature::Springs]);
        let unlike = features(Stencil::Neighbours24, |builder| builder);
        assert_eq!(unlike.first_beyond(plain), Some(Feature::UnlikeSprings));
        let windy = features(Stencil::Neighbours12, |builder| {
            builder.air(Air { density: 1.2, wind_velocity: [1.0, 0.0, 0.0], gust: None })
        });
        assert_eq!(windy.first_beyond(plain), Some(Feature::Air));
        let touching = features(Stencil::Neighbours12, |builder| {
            let response = ContactResponse::Impulse { restitution: 0.0, friction: 0.3 };
            builder.self_contact(SelfContact { distance: 0.01, response })
        });
        assert_eq!(touching.first_beyond(plain), Some(Feature::ImpulseContact));
        let but = FeatureSet::all_but(&[Feature::ImpulseContact]);
        assert_eq!(touching.first_beyond(but), Some(Feature::ImpulseContact));
        assert_eq!(windy.first_beyond(but), None);
    }

    #[test]
    fn settings_are_features_too() {
        let cloth = Cloth {
            name: "cloth".into(),
            geometry: Geometry::Grid(GridPatch::horizontal(12, 0.02, 0.0)),
            material: MaterialPreset::JERSEY.material(0.02).into(),
            pins: vec![],
            velocity: [0.0; 3],
        };
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        let config = SolverConfig {
            precision: Precision::F64,
            strain_limit: Some(StrainLimit::default()),
            ..SolverConfig::default()
        };
        let set = ModelFeatures::new(&model, &config).set();
        let expected = [Feature::Springs, Feature::StrainLimit, Feature::DoublePrecision];
        assert!(set.iter().eq(expected), "{set:?}");
    }
}
