//! The table of forms: every special form of the kernel of explicit frames, with the features that it takes.
//!
//! A form serves a model if it lists all features of the model and the sizes fit; the first one of the table that does is taken. What
//! is not listed goes to the general form, so that a feature that is new is never left out silently.

use cloth_core::{Feature, FeatureSet, FormChoice};

use crate::{
    layout::{CudaReal, Real4},
    patch::Patch,
};

/// A form of the kernel of explicit frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FrameForm {
    /// One patch of many tiles that is in contact with itself.
    PatchFlat,
    /// One pass makes a substep.
    Pass,
    /// Every model: other stages follow the pass.
    Stages,
}

/// What is computed by all forms of this table.
const PHASE: &str = "explicit_substep";

/// Features of a patch that touches itself.
const PENALTY: [Feature; 4] =
    [Feature::Springs, Feature::Colliders, Feature::ProceduralFields, Feature::PenaltyContact];

/// Sizes of a model and a device that forms depend on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameSizes {
    pub(crate) particles: usize,
    /// If the model is one whose springs are in a table of shared memory.
    pub(crate) patch: Option<Patch>,
    /// Whether entries of springs are packed into one word.
    pub(crate) is_packed: bool,
    pub(crate) multiprocessors: usize,
}

/// Threads of a block, where nothing else is said.
const THREADS: usize = 256;
/// Tiles for each multiprocessor from which on the forms for many tiles are faster.
const TILES_MIN: usize = 4;
/// Tiles of a patch with contact whose list of groups blocks build by comparing their runs, at most: with longer runs they have more in
/// common than that saves.
const TILES_MAX: usize = 1 << 16;
impl FrameSizes {
    /// What is handed out to blocks: tiles of a patch, or particles.
    pub(crate) fn items(&self) -> usize {
        self.patch.map_or(self.particles, |patch| patch.tiles())
    }

    /// Whether a block for each multiprocessor has all of it.
    pub(crate) fn is_small(&self) -> bool {
        let unit = if self.patch.is_some() { 1 } else { THREADS };
        self.items() <= self.multiprocessors * unit
    }

    fn many_tiles(&self) -> Result<(), String> {
        let least = TILES_MIN * self.multiprocessors;
        if self.patch.is_some() && self.items() >= least {
            return Ok(());
        }
        Err(format!("{} tiles, fewer than {least}", self.items()))
    }
}

impl FrameForm {
    /// All forms, the fastest first.
    pub(crate) const TABLE: [Self; 3] = [Self::PatchFlat, Self::Pass, Self::Stages];

    /// The features that it takes.
    pub(crate) const fn takes(self) -> FeatureSet {
        match self {
            Self::PatchFlat => FeatureSet::of(&PENALTY),
            Self::Pass => FeatureSet::all_but(&[
                Feature::Fabric,
                Feature::ImpulseContact,
                Feature::StrainLimit,
            ]),
            Self::Stages => FeatureSet::all_but(&[]),
        }
    }

    /// The feature that it is made for, without which another form is faster.
    const fn is_for(self) -> Option<Feature> {
        match self {
            Self::PatchFlat => Some(Feature::PenaltyContact),
            Self::Pass | Self::Stages => None,
        }
    }

    /// Why a model of such sizes is too small or too large for it.
    fn fits(self, sizes: &FrameSizes) -> Result<(), String> {
        match self {
            Self::PatchFlat => {
                sizes.many_tiles()?;
                let (tiles, most) = (sizes.items(), TILES_MAX);
                if tiles > most { Err(format!("{tiles} tiles, more than {most}")) } else { Ok(()) }
            }
            Self::Pass | Self::Stages => Ok(()),
        }
    }

    /// It in words.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::PatchFlat => "one patch of many tiles, with contact",
            Self::Pass => "general, one pass",
            Self::Stages => "general, all stages",
        }
    }

    /// The module of its kernel.
    pub(crate) const fn module(self) -> &'static str {
        match self {
            Self::PatchFlat => "explicit_substep_flat",
            Self::Pass => "explicit_substep",
            Self::Stages => "explicit_substep_stages",
        }
    }

    /// Why it is not taken, or nothing if it is.
    fn objection(self, features: FeatureSet, sizes: &FrameSizes) -> Option<String> {
        if let Some(feature) = features.first_beyond(self.takes()) {
            return Some(feature.name().to_owned());
        }
        if let Some(feature) = self.is_for().filter(|&feature| !features.has(feature)) {
            return Some(format!("no {}", feature.name()));
        }
        self.fits(sizes).err()
    }

    /// The first form of the table that takes a model.
    pub(crate) fn choose(features: FeatureSet, sizes: &FrameSizes) -> Self {
        let found = Self::TABLE.into_iter().find(|form| form.objection(features, sizes).is_none());
        found.unwrap_or(Self::Stages)
    }

    /// The same, with what rules out those before it.
    pub(crate) fn choice(features: FeatureSet, sizes: &FrameSizes) -> FormChoice {
        let chosen = Self::choose(features, sizes);
        let faster = Self::TABLE.into_iter().take_while(|&form| form != chosen);
        let ruled_out = faster.filter_map(|form| {
            form.objection(features, sizes).map(|objection| (form.name(), objection))
        });
        FormChoice { phase: PHASE, form: chosen.name(), ruled_out: ruled_out.collect() }
    }

    /// Whether it leaves the state that a frame begins with as it is.
    pub(crate) const fn keeps_first(self) -> bool {
        matches!(self, Self::PatchFlat)
    }

    /// How often it writes to the other motion in a substep that has such parts.
    pub(crate) const fn motions(self, has_impulses: bool, sweeps: u32, has_regions: bool) -> u32 {
        match self {
            // In place, and once more for colliders; or once for each sweep.
            Self::Stages => {
                let limits = if sweeps == 0 {
                    0
                } else if has_regions {
                    sweeps
                } else {
                    1
                };
                1 + has_impulses as u32 + limits
            }
            _ => 1,
        }
    }
}

/// Bytes of shared memory of a block of `explicit_substep_stages.cu` for regions of so many particles, with the velocities of their own.
pub(crate) const fn limit_shared_bytes<T: CudaReal>(particles: usize, owned: usize) -> usize {
    (particles + owned) * size_of::<Real4<T>>()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LARGE: FrameSizes = FrameSizes {
        particles: 1 << 20,
        patch: Some(Patch { columns: 1 << 10, rows: 1 << 10 }),
        is_packed: false,
        multiprocessors: 132,
    };
    const SMALL: FrameSizes = FrameSizes {
        particles: 160 * 160,
        patch: Some(Patch { columns: 160, rows: 160 }),
        ..LARGE
    };
    const MESH: FrameSizes = FrameSizes { patch: None, is_packed: true, ..LARGE };

    #[test]
    fn a_large_patch_that_touches_itself_has_a_form_of_its_own() {
        let penalty = FeatureSet::of(&PENALTY);
        assert_eq!(FrameForm::choose(penalty, &LARGE), FrameForm::PatchFlat);
        // Where patches are not looked for.
        let hidden = FrameSizes { patch: None, ..LARGE };
        for sizes in [SMALL, MESH, hidden] {
            assert_eq!(FrameForm::choose(penalty, &sizes), FrameForm::Pass);
        }
        let plain = FeatureSet::of(&[Feature::Springs]);
        assert_eq!(FrameForm::choose(plain, &LARGE), FrameForm::Pass);
    }

    /// Each feature that a form does not list sends a model to a form that lists it, whatever else the model has.
    #[test]
    fn a_form_never_serves_a_feature_that_it_does_not_list() {
        for sizes in [SMALL, LARGE, MESH] {
            for set in 0..1_u32 << Feature::ALL.len() {
                let features: Vec<Feature> = Feature::ALL
                    .into_iter()
                    .enumerate()
                    .filter(|(k, _)| set >> k & 1 == 1)
                    .map(|(_, feature)| feature)
                    .collect();
                let features = FeatureSet::of(&features);
                let form = FrameForm::choose(features, &sizes);
                assert_eq!(features.first_beyond(form.takes()), None, "{form:?}");
            }
        }
    }

    /// The page about this backend has this table.
    #[test]
    fn the_page_has_the_table() {
        let names = |set: FeatureSet| set.iter().map(Feature::name).collect::<Vec<_>>().join(", ");
        let lacks = |set: FeatureSet| {
            let all = Feature::ALL.into_iter().filter(move |&feature| !set.has(feature));
            all.map(Feature::name).collect::<Vec<_>>()
        };
        let rows = FrameForm::TABLE.map(|form| {
            let takes = match &lacks(form.takes())[..] {
                [] => "everything".to_owned(),
                few if few.len() <= 3 => format!("all but {}", few.join(", ")),
                _ => names(form.takes()),
            };
            format!("| {} | `{}` | {takes} |\n", form.name(), form.module())
        });
        let page = include_str!("../BACKEND.md");
        assert!(page.contains(&rows.concat()), "{}", rows.concat());
    }

    #[test]
    fn what_rules_a_faster_form_out_is_said() {
        let windy = FeatureSet::of(&[Feature::Springs, Feature::Air]);
        let choice = FrameForm::choice(windy, &LARGE);
        assert_eq!(choice.form, FrameForm::Pass.name());
        assert_eq!(choice.ruled_out.len(), 1);
        assert_eq!(choice.ruled_out[0].1, Feature::Air.name());
        let fabric = FeatureSet::of(&[Feature::Fabric, Feature::AnyMesh]);
        let choice = FrameForm::choice(fabric, &MESH);
        assert_eq!(choice.form, FrameForm::Stages.name());
        assert!(
            choice.ruled_out.iter().all(|(_, why)| why == Feature::Fabric.name()),
            "{choice:?}"
        );
        let limited = FeatureSet::of(&[Feature::Springs, Feature::StrainLimit]);
        assert_eq!(FrameForm::choose(limited, &SMALL), FrameForm::Stages);
    }
}
