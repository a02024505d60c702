//! What pictures show on cloth, as the command line says it.

use clap::Args;
use cloth::{
    Model, StrainMeasure,
    io::{PictureOverlays, PictureStrain},
};
use serde::{Deserialize, Serialize};

/// What pictures of a run show on cloth.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct OverlayArguments {
    /// Show on cloth in pictures, in place of what the scene says, separated by commas: `strain` colours it by how far it is
    /// stretched, `strain-warp`, `strain-weft` and `strain-shear` by the size of one component of the Green strain of fabric, `threads` draws lines along warp (dark) and weft (light) on fabric; or `none`.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) overlay: Vec<Overlay>,
    /// Strain that is red, in place of the scene's; 0.1 if neither gives one.
    #[arg(long, value_name = "SHARE", value_parser = strain_scale)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) strain_scale: Option<f64>,
}

/// Something that is shown on cloth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Overlay {
    /// The heat map of stretch.
    Strain,
    /// That of E11.
    StrainWarp,
    /// That of E22.
    StrainWeft,
    /// That of E12.
    StrainShear,
    /// Lines along warp and weft.
    Threads,
    /// Nothing.
    None,
}

impl Overlay {
    /// The strain that it shows.
    const fn measure(self) -> Option<StrainMeasure> {
        match self {
            Self::Strain => Some(StrainMeasure::Stretch),
            Self::StrainWarp => Some(StrainMeasure::Warp),
            Self::StrainWeft => Some(StrainMeasure::Weft),
            Self::StrainShear => Some(StrainMeasure::Shear),
            Self::Threads | Self::None => None,
        }
    }
}

impl OverlayArguments {
    /// These, and where they say nothing what an `earlier` part of the run had.
    pub(crate) fn or(&self, earlier: Option<&Self>) -> Self {
        let overlay = match earlier {
            Some(earlier) if self.overlay.is_empty() => &earlier.overlay,
            _ => &self.overlay,
        };
        let strain_scale = self.strain_scale.or(earlier.and_then(|earlier| earlier.strain_scale));
        Self { overlay: overlay.clone(), strain_scale }
    }

    /// What pictures of `model` show, where its scene says `scene`.
    pub(crate) fn apply(&self, model: &Model, scene: PictureOverlays) -> PictureOverlays {
        if *self == Self::default() {
            return scene;
        }
        let has = |overlay| self.overlay.contains(&overlay);
        let of_scene = scene.strain.as_ref().map(|strain| strain.scale);
        let scale = self.strain_scale.or(of_scene).unwrap_or(PictureStrain::SCALE);
        let (strain, threads) = if self.overlay.is_empty() {
            (scene.strain.as_ref().map(|strain| strain.measure), scene.threads.is_some())
        } else {
            (self.overlay.iter().find_map(|overlay| overlay.measure()), has(Overlay::Threads))
        };
        PictureOverlays::new(model, strain.map(|measure| (measure, scale)), threads)
    }
}

/// A relative elongation above 0.
pub(super) fn strain_scale(text: &str) -> Result<f64, String> {
    let scale = text.parse().ok().filter(|scale: &f64| scale.is_finite() && *scale > 0.0);
    scale.ok_or_else(|| "give a relative elongation above 0, such as 0.1 for 10 %".to_owned())
}

#[cfg(test)]
mod tests {
    use cloth::{Cloth, GridPatch, MaterialPreset, ModelBuilder};

    use super::*;

    fn said(overlay: &[Overlay], strain_scale: Option<f64>) -> OverlayArguments {
        OverlayArguments { overlay: overlay.to_vec(), strain_scale }
    }

    #[test]
    fn the_command_line_goes_before_the_scene() {
        let cloth = Cloth::grid("a", GridPatch::new([3, 3], 0.1), &MaterialPreset::DENIM);
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        let scene = || PictureOverlays::new(&model, Some((StrainMeasure::Weft, 0.03)), true);
        let shown = |arguments: OverlayArguments, scene: PictureOverlays| {
            let overlays = arguments.apply(&model, scene);
            let strain = overlays.strain.map(|strain| (strain.measure, strain.scale));
            (strain, overlays.threads.is_some())
        };
        let none = PictureOverlays::default;
        let [stretch, weft] = [StrainMeasure::Stretch, StrainMeasure::Weft];
        assert_eq!(shown(said(&[], None), scene()), (Some((weft, 0.03)), true));
        assert_eq!(shown(said(&[], Some(0.5)), scene()), (Some((weft, 0.5)), true));
        assert_eq!(shown(said(&[Overlay::None], None), scene()), (None, false));
        let strain = said(&[Overlay::Strain], None);
        assert_eq!(shown(strain.clone(), scene()), (Some((stretch, 0.03)), false));
        assert_eq!(shown(strain, none()), (Some((stretch, 0.1)), false));
        let shear = said(&[Overlay::StrainShear], None);
        assert_eq!(shown(shear, none()), (Some((StrainMeasure::Shear, 0.1)), false));
        assert_eq!(shown(said(&[Overlay::Threads], Some(0.5)), none()), (None, true));
        assert_eq!(shown(said(&[], Some(0.5)), none()), (None, false), "it is only a scale");
    }

    #[test]
    fn a_run_that_goes_on_shows_what_it_did() {
        let earlier = said(&[Overlay::Strain], Some(0.2));
        assert_eq!(said(&[], None).or(Some(&earlier)), earlier);
        let other = said(&[Overlay::Threads], None).or(Some(&earlier));
        assert_eq!(other, said(&[Overlay::Threads], Some(0.2)));
    }

    #[test]
    fn scales_are_above_zero() {
        assert_eq!(strain_scale("0.05"), Ok(0.05));
        for wrong in ["0", "-1", "inf", "nan", "red", ""] {
            assert!(strain_scale(wrong).unwrap_err().contains("above 0"), "{wrong}");
        }
    }
}
