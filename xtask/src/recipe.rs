//! The recipe “add an interaction” of `crates/cloth/EXTENDING.md`, followed: what is there went through every place that it names, and
//! what is new is missed in each.

use std::{collections::BTreeMap, fs};

use crate::command::root;

const RECIPE: &str = include_str!("../../crates/cloth/EXTENDING.md");

/// An interaction by the names that the recipe uses.
#[derive(Clone, Copy)]
struct Kind<'a> {
    kind: &'a str,
    forces: &'a str,
    tangents: Option<&'a str>,
}

/// Files among which something is to be found, and what.
struct Place<'a> {
    files: Vec<&'a str>,
    text: &'a str,
}

/// Sources as they are, with some of them changed.
#[derive(Clone, Default)]
struct Sources(BTreeMap<String, String>);

impl Sources {
    fn read(&self, file: &str) -> String {
        let changed = self.0.get(file).cloned();
        changed.unwrap_or_else(|| {
            fs::read_to_string(root().join(file))
                .unwrap_or_else(|error| panic!("the recipe names {file}: {error}"))
        })
    }
}

/// Cells of the rows of the recipe's tables that have so many.
fn rows(cells: usize) -> impl Iterator<Item = Vec<&'static str>> {
    let recipe = RECIPE.split("## Add an interaction").nth(1).unwrap_or_default();
    let recipe = recipe.split("\n## ").next().unwrap_or_default();
    let rows = recipe.lines().filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |"));
    rows.map(|row| row.split(" | ").collect::<Vec<_>>()).filter(move |row| row.len() == cells)
}

fn kinds() -> Vec<Kind<'static>> {
    let rows = rows(3).skip(1);
    let kind = |row: Vec<&'static str>| Kind {
        kind: row[0],
        forces: row[1],
        tangents: (row[2] != "-").then_some(row[2]),
    };
    rows.map(kind).collect()
}

fn places() -> Vec<Place<'static>> {
    let rows = rows(4).skip(1);
    let place = |row: Vec<&'static str>| {
        let text = row[2].strip_prefix("`` ").and_then(|text| text.strip_suffix(" ``"));
        Place {
            files: row[1].split(", ").map(|file| file.trim_matches('`')).collect(),
            text: text.unwrap_or(row[2].trim_matches('`')),
        }
    };
    rows.map(place).collect()
}

/// What a place has of a kind; nothing if it is of its derivative, and there is none.
fn wanted(place: &Place, kind: Kind) -> Option<String> {
    let text = place.text.replace("{Kind}", kind.kind).replace("{forces}", kind.forces);
    match kind.tangents {
        Some(tangents) => Some(text.replace("{tangents}", tangents)),
        None => (!text.contains("{tangents}")).then_some(text),
    }
}

/// The places that a kind has not gone through.
fn missing(sources: &Sources, kind: Kind) -> Vec<usize> {
    let places = places();
    let is_missing = |(_, place): &(usize, &Place)| {
        wanted(place, kind)
            .is_some_and(|text| !place.files.iter().any(|file| sources.read(file).contains(&text)))
    };
    places.iter().enumerate().filter(is_missing).map(|(number, _)| number).collect()
}

#[test]
fn every_interaction_is_in_every_place() {
    let (kinds, places) = (kinds(), places());
    assert!(places.len() > 20, "{} places", places.len());
    let list = Sources::default().read("crates/cloth-core/src/model/interactions/mod.rs");
    let all = list.split("pub const ALL: [Self; ").nth(1).unwrap();
    let all = all.split_once('=').unwrap().1.trim().trim_start_matches('[');
    let all = all.split("];").next().unwrap();
    let all: Vec<_> = all.split("Self::").map(|name| name.trim_matches([',', ' ', '\n'])).collect();
    let all: Vec<_> = all.into_iter().filter(|name| !name.is_empty()).collect();
    assert_eq!(all, kinds.iter().map(|kind| kind.kind).collect::<Vec<_>>(), "the table of kinds");
    let lacks = |kind: Kind<'static>| {
        missing(&Sources::default(), kind).into_iter().map(move |number| (kind.kind, number))
    };
    let lacks = kinds.into_iter().flat_map(lacks);
    let lacks = lacks.map(|(kind, number)| {
        let Place { files, text } = &places[number];
        format!("{kind}: {} does not have {text}", files.join(" or "))
    });
    let lacks: Vec<_> = lacks.collect();
    assert!(lacks.is_empty(), "{}", lacks.join("\n"));
}

/// A kind that is new is missed everywhere, and in each place until it is there.
#[test]
fn a_new_interaction_goes_through_every_place() {
    let fixture =
        Kind { kind: "Fixture", forces: "fixture_forces", tangents: Some("fixture_linearise") };
    let mut sources = Sources::default();
    let places = places();
    for (number, place) in places.iter().enumerate() {
        let left: Vec<_> = (number..places.len()).collect();
        assert_eq!(missing(&sources, fixture), left);
        let file = place.files[0].to_owned();
        let text = sources.read(&file) + "\n" + &wanted(place, fixture).unwrap();
        sources.0.insert(file, text);
    }
    assert_eq!(missing(&sources, fixture), Vec::<usize>::new());
    // Without a derivative it need not be where derivatives are.
    let plain = Kind { tangents: None, ..fixture };
    assert!(missing(&Sources::default(), plain).len() < places.len());
}
