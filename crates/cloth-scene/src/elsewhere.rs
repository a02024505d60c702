//! Words that other programs have for what scenes call otherwise, or keep at another place.

/// What to write in place of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mend {
    /// A key that is known there.
    Key(&'static str),
    /// A sentence.
    Note(&'static str),
}

/// Words, a key that is known where they mean this, and what to write.
const WORDS: [(&[&str], &str, Mend); 10] = [
    (&["fps", "frame_rate", "framerate"], "frames_per_second", Mend::Key("frames_per_second")),
    (&["dt", "step", "timestep"], "time_step", Mend::Key("time_step")),
    (
        &["position", "location", "center", "centre", "origin"],
        "translation",
        Mend::Key("translation"),
    ),
    (&["path", "filename", "obj"], "file", Mend::Key("file")),
    (
        &["substeps", "sub_steps"],
        "time_step",
        Mend::Note("give the length of a substep: `time_step = 0.005`"),
    ),
    (
        &["gravity"],
        "frames_per_second",
        Mend::Note("write `gravity = [0, 0, -9.81]` at the top of the file, before all tables"),
    ),
    (
        &["position", "location", "center", "centre", "origin", "translation", "rotation", "scale"],
        "pins",
        Mend::Note(
            "where a cloth is belongs to its geometry: `geometry.mesh = { file = \"sheet.obj\", translation = [0, 0, 1] }`, or `geometry.grid` with `origin`",
        ),
    ),
    (
        &["mesh", "grid", "file", "path", "obj"],
        "pins",
        Mend::Note("write `geometry.mesh = { file = \"sheet.obj\" }`, or `geometry.grid`"),
    ),
    (
        &["fabric", "preset"],
        "pins",
        Mend::Note("write `material.preset = \"cotton\"`; `cloth fabrics` lists them"),
    ),
    (
        &["solver", "integrator", "frames", "fps", "time_step", "dt"],
        "simulation",
        Mend::Note(
            "that belongs to `[simulation]`: `solver`, `frames`, `frames_per_second`, `time_step`",
        ),
    ),
];

/// What a word stands for where these are known, if it is one of another program.
pub(crate) fn mend(word: &str, known: &[String]) -> Option<Mend> {
    let word = word.to_lowercase();
    let fits = |(words, key, _): &&(&[&str], &str, Mend)| {
        words.contains(&word.as_str()) && known.iter().any(|known| known == key)
    };
    WORDS.iter().find(fits).map(|(.., mend)| *mend)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_means_what_is_known_at_its_place() {
        let known = |words: &[&str]| words.iter().map(|&word| word.to_owned()).collect::<Vec<_>>();
        let of_solid = known(&["name", "shape", "translation", "motion"]);
        assert_eq!(mend("Position", &of_solid), Some(Mend::Key("translation")));
        assert!(matches!(mend("position", &known(&["pins", "geometry"])), Some(Mend::Note(_))));
        assert_eq!(mend("position", &known(&["frames"])), None);
        assert_eq!(mend("shape", &of_solid), None);
    }
}
