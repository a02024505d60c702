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
    /// Everyday words for it, by which it can be chosen, too.
    pub also: Vec<String>,
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

/// All fabrics that come with the engine, in the order of the data file.
#[must_use]
pub fn measured_fabrics() -> &'static [MeasuredFabric] {
    &FABRICS.fabrics
}

impl MeasuredFabric {
    /// The fabric called `name`, which may be one of the words of [`Self::also`].
    ///
    /// # Errors
    /// There is none; the error has the most similar name, or those of fabrics as heavy as what the word usually means.
    pub fn find(name: &str) -> Result<&'static Self, SceneError> {
        let is_it =
            |fabric: &&Self| fabric.name == name || fabric.also.iter().any(|word| word == name);
        let found = FABRICS.fabrics.iter().find(is_it);
        found.ok_or_else(|| Self::unknown(ScenePlace::default(), "fabric", name))
    }

    /// The error for a `name` that no fabric has.
    pub(crate) fn unknown(place: ScenePlace, what: &'static str, name: &str) -> SceneError {
        let Library { fabrics, unmeasured } = &*FABRICS;
        if let Some(&weight) = unmeasured.get(&name.to_lowercase()) {
            let known = as_heavy(fabrics, weight);
            let note = format!(
                "its numbers are not here; as heavy as that usually is, {:.0} to {:.0} g/m^2, are `{}`; or give the sheet of your own",
                weight[0],
                weight[1],
                known.join("`, `")
            );
            let name = name.to_owned();
            return SceneError::Unknown(Box::new(SceneUnknown {
                place,
                what,
                name,
                note: Some(note),
                suggestion: None,
                known,
            }));
        }
        // Words that say something first: only so many are shown.
        let words = fabrics.iter().flat_map(|fabric| fabric.also.iter().cloned());
        let names = fabrics.iter().map(|fabric| fabric.name.clone());
        let known = words.chain(names).collect();
        SceneUnknown::error(place, what, name, known)
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

/// Names of the fabrics whose mass per area is within bounds \[g/m^2\], no more than a line can hold.
fn as_heavy(fabrics: &[MeasuredFabric], [least, most]: [f64; 2]) -> Vec<String> {
    let grams =
        |fabric: &MeasuredFabric| 1e3 * fabric.fit().map_or(f64::NAN, |(law, _)| law.area_density);
    let is_near = |fabric: &&MeasuredFabric| (least..=most).contains(&grams(fabric));
    fabrics.iter().filter(is_near).map(|fabric| fabric.name.clone()).take(6).collect()
}

/// What the data file has.
#[derive(Debug)]
struct Library {
    fabrics: Vec<MeasuredFabric>,
    /// Words for cloths that were not measured, and how heavy these usually are \[g/m^2\].
    unmeasured: BTreeMap<String, [f64; 2]>,
}

static FABRICS: LazyLock<Library> = LazyLock::new(|| {
    #[allow(clippy::expect_used, reason = "the text is part of the program, and a test reads it")]
    fabrics_read(include_str!("../../fabrics.toml")).expect("the fabrics of the program are valid")
});

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    unmeasured: BTreeMap<String, [f64; 2]>,
    sources: BTreeMap<String, FabricSource>,
    fabrics: Vec<Row>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    name: String,
    #[serde(default)]
    also: Vec<String>,
    description: String,
    source: String,
    wang: Option<Wang>,
    feng: Option<Feng>,
    sheet: Option<SheetFile>,
}

fn fabrics_read(text: &str) -> Result<Library, String> {
    let File { unmeasured, sources, fabrics } =
        toml::from_str(text).map_err(|error| error.to_string())?;
    let read = |row: Row| {
        let Row { name, also, description, source, wang, feng, sheet } = row;
        let source = sources.get(&source).cloned();
        let source =
            source.ok_or_else(|| format!("fabric {name} has a source that is not listed"))?;
        let data = match (wang, feng, sheet) {
            (Some(wang), None, None) => Data::Wang(wang),
            (None, Some(feng), None) => Data::Sheet(feng.sheet()),
            (None, None, Some(sheet)) => Data::Sheet(sheet.sheet(|_| Err("a file".to_owned()))?),
            _ => return Err(format!("fabric {name} has none or several kinds of data")),
        };
        Ok(MeasuredFabric { name, also, description, source, data })
    };
    let fabrics = fabrics.into_iter().map(read).collect::<Result<_, String>>()?;
    Ok(Library { fabrics, unmeasured })
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
    fn words_mean_one_thing_and_what_was_not_measured_has_others_as_heavy() {
        let Library { fabrics, unmeasured } = &*FABRICS;
        let mut words: Vec<_> = fabrics.iter().flat_map(|fabric| &fabric.also).collect();
        words.extend(fabrics.iter().map(|fabric| &fabric.name));
        words.extend(unmeasured.keys());
        let count = words.len();
        words.sort();
        words.dedup();
        assert_eq!(words.len(), count);
        for (word, &weight) in unmeasured {
            assert!(!as_heavy(fabrics, weight).is_empty(), "{word}");
        }
    }

    #[test]
    fn data_without_source_or_kind_are_refused() {
        let row = "sources = {}\n[[fabrics]]\nname = 'a'\ndescription = ''\nsource = 'b'\n";
        assert!(fabrics_read(row).unwrap_err().contains("not listed"));
        assert!(fabrics_read("fabrics = 1").is_err());
    }
}
