//! Scenes as TOML.

use std::path::Path;

use cloth_io::file_read;
use serde::Deserialize;
use toml::{
    Table,
    de::{DeTable, Deserializer},
};

use crate::{Scene, SceneError, SceneOrigin, ScenePlace, error::SceneUnknown};

use super::{
    lines::Lines,
    names::names_fill,
    toml_arity::misfit,
    toml_places::{Places, key_at},
};

/// A scene of ten thousand pins has a few hundred kilobytes.
const FILE_SIZE_MAX: u64 = 64 << 20;

/// Extensions of files that are read as FYSL; all others are TOML.
pub(crate) const FYSL_EXTENSIONS: &[&str] = &["fysl", "xml"];

impl Scene {
    /// Reads a scene from the file `path`: FYSL if its extension is `fysl` or `xml`, else TOML. Meshes are looked for in the folder of the file.
    ///
    /// # Errors
    /// [`SceneError::Read`], [`SceneError::Size`], and those of [`Scene::from_toml`] and
    /// [`Scene::from_fysl`].
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let file = path.display().to_string();
        let bytes = file_read(path, FILE_SIZE_MAX + 1)
            .map_err(|source| SceneError::Read { file: file.clone(), source })?;
        if bytes.len() as u64 > FILE_SIZE_MAX {
            return Err(SceneError::Size { file, limit: FILE_SIZE_MAX });
        }
        let text = String::from_utf8(bytes).map_err(|error| {
            let valid = error.utf8_error().valid_up_to();
            let text = String::from_utf8_lossy(error.as_bytes());
            SceneError::Syntax {
                place: ScenePlace {
                    file: file.clone(),
                    position: Some(Lines::new(&text).position(valid)),
                },
                problem: "the text is not UTF-8".into(),
            }
        })?;
        let is_fysl = path.extension().is_some_and(|extension| {
            FYSL_EXTENSIONS.iter().any(|known| extension.eq_ignore_ascii_case(known))
        });
        let mut scene = if is_fysl {
            // Editors put a mark there that says what UTF-8 need not say.
            Self::from_fysl(text.strip_prefix('\u{feff}').unwrap_or(&text), &file)?
        } else {
            Self::from_toml(&text, &file)?
        };
        scene.origin.directory = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Ok(scene)
    }

    /// Reads a scene from TOML text. `file` is its name in messages, and meshes are looked for in
    /// the folder of that name.
    ///
    /// # Errors
    /// [`SceneError::Syntax`] for text that is not TOML or values of the wrong kind,
    /// [`SceneError::Unknown`] for keys and words that do not exist, [`SceneError::Value`] for
    /// numbers that are NaN or infinite; each with line and column, and with the key if it is about
    /// a value.
    pub fn from_toml(text: &str, file: &str) -> Result<Self, SceneError> {
        let lines = Lines::new(text);
        let table =
            DeTable::parse(text).map_err(|error| parse_error(&error, None, file, &lines))?;
        let places = Places::of(table.get_ref(), &lines);
        if let Some(number) = places.non_finite {
            return Err(SceneError::Value {
                place: ScenePlace { file: file.into(), position: Some(number.position) },
                problem: format!("`{}` is {}: give a finite number", number.key, number.text),
            });
        }
        let keys = places.keys;
        let written = table.clone();
        let mut scene = Self::deserialize(Deserializer::from(table)).map_err(|error| {
            // Parsed once more: the table is used up, and keeping the key of every value would
            // make each scene pay for the errors of a few.
            let table = DeTable::parse(text).ok();
            let key =
                table.zip(error.span()).and_then(|(table, span)| key_at(table.get_ref(), &span));
            parse_error(&error, key, file, &lines)
        })?;
        let understood = Table::try_from(&scene).map_err(|error| scene.unwritable(&error))?;
        if let Some(misfit) = misfit(written.get_ref(), &understood) {
            return Err(SceneError::Syntax {
                place: ScenePlace {
                    file: file.into(),
                    position: Some(lines.position(misfit.offset)),
                },
                problem: misfit.to_string(),
            });
        }
        names_fill(&mut scene, &keys, file);
        scene.origin = SceneOrigin {
            file: file.into(),
            directory: Path::new(file).parent().map(Path::to_path_buf).unwrap_or_default(),
            places: keys,
        };
        Ok(scene)
    }

    /// The scene as TOML; [`Scene::from_toml`] gives an equal scene back.
    ///
    /// # Errors
    /// [`SceneError::Write`] for a value that TOML cannot hold.
    pub fn to_toml(&self) -> Result<String, SceneError> {
        toml::to_string(self).map_err(|error| self.unwritable(&error))
    }

    fn unwritable(&self, error: &toml::ser::Error) -> SceneError {
        SceneError::Write { name: self.name.clone(), problem: error.to_string() }
    }
}

/// `key` is the value that the error is about, if it is about one.
fn parse_error(
    error: &toml::de::Error,
    key: Option<String>,
    file: &str,
    lines: &Lines<'_>,
) -> SceneError {
    let position = error.span().map(|span| lines.position(span.start));
    let place = ScenePlace { file: file.into(), position };
    match unknown_word(error.message()) {
        Some((what, name, known)) => SceneUnknown::error(place, what, name, known),
        None => {
            // One sentence: parsers put what they expected on a second line.
            let mut problem = error.message().trim_end().replace('\n', ", ");
            if problem.starts_with("invalid mantissa") {
                problem.push_str(" (numbers begin with a digit: 0.5, not .5)");
            }
            let problem = match key {
                Some(key) => {
                    let table = word_for_table(error, &key, lines);
                    format!("`{key}`: {}", table.unwrap_or(problem))
                }
                None => problem,
            };
            SceneError::Syntax { place, problem }
        }
    }
}

/// What to write where a choice stands as a word but has settings, `shape = "plane"`: serde speaks of variants there.
fn word_for_table(error: &toml::de::Error, key: &str, lines: &Lines<'_>) -> Option<String> {
    let is_word = error.message().starts_with("invalid type: unit variant, expected ");
    let word = lines.text().get(error.span()?).filter(|_| is_word)?.trim_matches(['"', '\'']);
    let name = key.rsplit('.').next()?;
    Some(format!("`{word}` has settings, in a table: write `{name}.{word} = {{ ... }}`"))
}

/// Takes serde's message for an unknown key or variant apart: kind of word, the word, and what is
/// known there. Serde hands this on in words only.
fn unknown_word(message: &str) -> Option<(&'static str, &str, Vec<String>)> {
    let (what, rest) = [("key", "unknown field `"), ("word", "unknown variant `")]
        .into_iter()
        .find_map(|(what, start)| message.strip_prefix(start).map(|rest| (what, rest)))?;
    // The word is the writer's and can hold anything; what is known are plain names.
    let (name, expected) =
        rest.rsplit_once("`, expected ").or_else(|| rest.rsplit_once("`, there are no "))?;
    let known = expected.split('`').skip(1).step_by(2).map(str::to_owned).collect();
    Some((what, name, known))
}
