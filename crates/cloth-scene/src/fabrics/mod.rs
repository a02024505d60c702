//! Fabrics that were measured, and fabrics by the sheet of a laboratory.

mod feng;
mod sheet_file;
mod wang;

use std::{collections::BTreeMap, sync::LazyLock};

use cloth_core::fabric::{BendingSheet, Fabric, FabricError, FabricSheet, FitReport};
use serde::Deserialize;

use crate::{SceneError, ScenePlace, error::SceneUnknown};

pub use sheet_file::{SheetError, fabric_sheet_read};

use feng::Feng;
use sheet_file::SheetFile;
use wang::Wang;

/// A fabric that was measured, as its source gives it.
#[derive(Clone, Debug)]
pub struct MeasuredFabric {
    /// Name by which it is chosen.
    pub name: String,
    /// What it is.
    pub description: String,
    /// Where the numbers come from.
    pub source: FabricSource,
    data: Data,
}

/// Where the numbers of a fabric come from.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FabricSource {
    /// The publication.
    pub citation: String,
    /// Its address.
    pub url: String,
    /// What was read, if it is not the publication itself.
    pub read_from: String,
    /// How its numbers become those of the engine.
    pub conversion: String,
}

#[derive(Clone, Debug)]
enum Data {
    Sheet(FabricSheet),
    Wang(Wang),
}

/// Names of presets for springs, and the same fabrics here.
const PRESETS: [(&str, &str); 5] = [
    ("denim", "11oz-black-denim"),
    ("jersey", "gray-interlock"),
    ("jet-set", "tango-red-jet-set"),
    ("ponte-roma", "camel-ponte-roma"),
    ("rib-knit", "ivory-rib-knit"),
];

/// All fabrics that come with the engine, in the order of the data file.
#[must_use]
pub fn measured_fabrics() -> &'static [MeasuredFabric] {
    &FABRICS
}

impl MeasuredFabric {
    /// The fabric called `name`, which may be that of a preset for springs.
    ///
    /// # Errors
    /// There is none; the error has the most similar name.
    pub fn find(name: &str) -> Result<&'static Self, SceneError> {
        let own = PRESETS.iter().find(|(preset, _)| *preset == name).map_or(name, |(_, own)| own);
        FABRICS.iter().find(|fabric| fabric.name == own).ok_or_else(|| {
            let known = FABRICS.iter().map(|fabric| fabric.name.clone()).collect();
            SceneUnknown::error(ScenePlace::default(), "fabric", name, known)
        })
    }

    /// The fabric in the engine's units, with what was fitted and assumed.
    ///
    /// # Errors
    /// Numbers that no cloth has; those that come with the engine have been checked.
    pub fn fit(&self) -> Result<(Fabric, FitReport), FabricError> {
        match &self.data {
            Data::Sheet(sheet) => sheet.fit(&self.name),
            Data::Wang(wang) => wang.fit(&self.name),
        }
    }
}

static FABRICS: LazyLock<Vec<MeasuredFabric>> = LazyLock::new(|| {
    #[allow(clippy::expect_used, reason = "the text is part of the program, and a test reads it")]
    fabrics_read(include_str!("../../fabrics.toml")).expect("the fabrics of the program are valid")
});

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    sources: BTreeMap<String, FabricSource>,
    fabrics: Vec<Row>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    name: String,
    description: String,
    source: String,
    wang: Option<Wang>,
    feng: Option<Feng>,
    sheet: Option<SheetFile>,
}

fn fabrics_read(text: &str) -> Result<Vec<MeasuredFabric>, String> {
    let File { sources, fabrics } = toml::from_str(text).map_err(|error| error.to_string())?;
    let read = |row: Row| {
        let Row { name, description, source, wang, feng, sheet } = row;
        let source = sources.get(&source).cloned();
        let source =
            source.ok_or_else(|| format!("fabric {name} has a source that is not listed"))?;
        let data = match (wang, feng, sheet) {
            (Some(wang), None, None) => Data::Wang(wang),
            (None, Some(feng), None) => Data::Sheet(feng.sheet()),
            (None, None, Some(sheet)) => Data::Sheet(sheet.sheet(|_| Err("a file".to_owned()))?),
            _ => return Err(format!("fabric {name} has none or several kinds of data")),
        };
        Ok(MeasuredFabric { name, description, source, data })
    };
    fabrics.into_iter().map(read).collect()
}

/// A rigidity that was measured.
fn rigidity(value: f64) -> Option<BendingSheet> {
    Some(BendingSheet::Rigidity(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_for_springs_are_fabrics_too() {
        for preset in cloth_core::MaterialPreset::ALL {
            let fabric = MeasuredFabric::find(preset.name).unwrap();
            assert!(fabric.description.contains(preset.fabric.split(',').next().unwrap()));
            assert_eq!(fabric.fit().unwrap().0.area_density, preset.mass_per_area);
        }
    }

    #[test]
    fn data_without_source_or_kind_are_refused() {
        let row = "sources = {}\n[[fabrics]]\nname = 'a'\ndescription = ''\nsource = 'b'\n";
        assert!(fabrics_read(row).unwrap_err().contains("not listed"));
        assert!(fabrics_read("fabrics = 1").is_err());
    }
}
