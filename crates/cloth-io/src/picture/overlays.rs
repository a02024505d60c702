//! What pictures show on cloth in place of its colour.

use std::sync::Arc;

use cloth_core::{Model, StrainMeasure};

use super::{PictureLegend, StrainMap, ThreadMap};

/// Heat map and threads on the cloths of one model; none of them by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PictureOverlays {
    /// Colours by how far cloth is stretched.
    pub strain: Option<PictureStrain>,
    /// Lines along warp and weft.
    pub threads: Option<Arc<ThreadMap>>,
}

/// The heat map of pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureStrain {
    /// What measures it.
    pub map: Arc<StrainMap>,
    /// Which strain is shown.
    pub measure: StrainMeasure,
    /// That which is red, above 0.
    pub scale: f64,
}

impl PictureStrain {
    /// Strain in red if nobody says another.
    pub const SCALE: f64 = 0.1;
}

impl PictureOverlays {
    /// Those of `model`: the heat map if `strain` says of what, and how much of it is red, and the threads if they are wanted.
    #[must_use]
    pub fn new(model: &Model, strain: Option<(StrainMeasure, f64)>, threads: bool) -> Self {
        let map = || StrainMap::new(model).into();
        let strain = strain.map(|(measure, scale)| PictureStrain { map: map(), measure, scale });
        Self { strain, threads: threads.then(|| ThreadMap::new(model).into()) }
    }

    /// What explains them.
    #[must_use]
    pub fn legend(&self) -> PictureLegend {
        PictureLegend {
            strain: self.strain.as_ref().map(|strain| (strain.measure, strain.scale)),
            threads: self.threads.as_ref().is_some_and(|map| !map.is_empty()),
        }
    }

    /// Whether there is nothing to show.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.strain.is_none() && self.threads.is_none()
    }
}
