//! From names of pins to indices.

use cloth_core::{TriangleMesh, VertexAttribute, VertexGroup};

use crate::{SceneError, ScenePin, ScenePinAttribute, error::SceneUnknown};

use super::Check;

/// The names that sets of particles of one cloth have.
pub(super) enum PinSets {
    /// Those of a grid of so many columns and rows, and how many particles it has with those in the middle of its cells.
    Grid([u32; 2], u32),
    /// What a mesh or network with so many vertices has.
    Mesh(u32, MeshSets),
    /// Those of a cloth whose triangles have vertices of their own, with the corners at each vertex that these sets are of.
    Split(Box<Self>, Vec<Vec<u32>>),
}

/// The names that a mesh file gives to vertices.
#[derive(Default)]
pub(super) struct MeshSets {
    groups: Vec<VertexGroup>,
    attributes: Vec<VertexAttribute>,
}

impl MeshSets {
    /// Takes them out of `mesh`: the model has no use for them.
    pub(super) fn take(mesh: &mut TriangleMesh) -> Self {
        Self {
            groups: std::mem::take(&mut mesh.groups),
            attributes: std::mem::take(&mut mesh.attributes),
        }
    }

    fn group(&self, name: &str) -> Option<Vec<u32>> {
        let group = self.groups.iter().find(|group| group.name == name)?;
        Some(group.vertices.clone())
    }

    /// The vertices whose attribute is larger than a bound.
    fn above(&self, pin: &ScenePinAttribute) -> Option<Vec<u32>> {
        let attribute = self.attributes.iter().find(|found| found.name == pin.attribute)?;
        let numbered = (0..).zip(&attribute.values);
        let large = numbered.filter(|&(_, &value)| f64::from(value) > pin.above);
        Some(large.map(|(vertex, _)| vertex).collect())
    }
}

/// Names of sets that every grid has, beside `column-7` and `row-7`.
const GRID_NAMES: [&str; 11] = [
    "all",
    "border",
    "bottom",
    "bottom-left",
    "bottom-right",
    "corners",
    "left",
    "right",
    "top",
    "top-left",
    "top-right",
];

/// Most particles that the pins of a cloth name together, each as often as it is named, and so for all events: a
/// scene can name one set after the other.
pub(super) const NAMED_MAX: u64 = 1 << 24;

impl PinSets {
    /// The particles that `pin` names, as indices within the cloth. An index that does not exist is
    /// left to the caller.
    pub(super) fn resolve(
        &self,
        check: &Check<'_>,
        key: &str,
        pin: &ScenePin,
    ) -> Result<Vec<u32>, SceneError> {
        if let Self::Split(before, corners) = self {
            let mut found = Vec::new();
            for vertex in before.resolve(check, key, pin)? {
                let Some(corners) = corners.get(vertex as usize) else {
                    let count = corners.len();
                    let problem = format!("names vertex {vertex} of {count}: they count from 0");
                    return Err(check.error(key, &problem));
                };
                found.extend(corners);
            }
            return Ok(found);
        }
        let name = match pin {
            ScenePin::Index(index) => return Ok(vec![*index]),
            ScenePin::Name(name) => name,
            ScenePin::Attribute(pin) => return self.attribute(check, key, pin),
        };
        let found = match self {
            Self::Grid(_, particles) if name == "all" => Some((0..*particles).collect()),
            Self::Grid(counts, _) => grid_set(*counts, name),
            Self::Mesh(vertices, sets) => {
                sets.group(name).or_else(|| (name == "all").then(|| (0..*vertices).collect()))
            }
            Self::Split(..) => None,
        };
        found.ok_or_else(|| {
            SceneUnknown::error(check.place(key), "set of particles", name, self.known())
        })
    }

    /// The particles of the set called `name` while the groups of a mesh are still with it. `more` are names that would do as well.
    pub(super) fn of_mesh(
        &self,
        (check, key): (&Check<'_>, &str),
        mesh: &TriangleMesh,
        name: &str,
        more: impl Iterator<Item = String>,
    ) -> Result<Vec<u32>, SceneError> {
        match (self, mesh.group(name)) {
            (Self::Grid(..) | Self::Split(..), _) => {
                self.resolve(check, key, &ScenePin::Name(name.to_owned()))
            }
            (Self::Mesh(..), Some(group)) => Ok(group.vertices.clone()),
            (Self::Mesh(vertices, _), None) if name == "all" => Ok((0..*vertices).collect()),
            (Self::Mesh(..), None) => {
                let groups = mesh.groups.iter().map(|group| group.name.clone());
                let known = std::iter::once("all".to_owned()).chain(groups).chain(more).collect();
                Err(SceneUnknown::error(check.place(key), "set of particles", name, known))
            }
        }
    }

    /// The attribute of each vertex of a mesh called `name`.
    pub(super) fn values(
        &self,
        check: &Check<'_>,
        key: &str,
        name: &str,
    ) -> Result<Vec<f32>, SceneError> {
        let known: &[VertexAttribute] = match self {
            Self::Grid(..) => &[],
            Self::Mesh(_, sets) => &sets.attributes,
            Self::Split(before, corners) => {
                let values = before.values(check, key, name)?;
                let count = corners.iter().map(Vec::len).sum();
                let mut found = vec![0.0; count];
                for (value, corner) in values.iter().zip(corners).flat_map(|(value, corners)| {
                    corners.iter().map(move |&corner| (*value, corner))
                }) {
                    found[corner as usize] = value;
                }
                return Ok(found);
            }
        };
        let found = known.iter().find(|attribute| attribute.name == name);
        found.map(|attribute| attribute.values.clone()).ok_or_else(|| {
            let known = known.iter().map(|attribute| attribute.name.clone()).collect();
            SceneUnknown::error(check.place(key), "attribute", name, known)
        })
    }

    /// The particles that have a large attribute: at least one, as a bound that none reaches is a slip.
    fn attribute(
        &self,
        check: &Check<'_>,
        key: &str,
        pin: &ScenePinAttribute,
    ) -> Result<Vec<u32>, SceneError> {
        check.finite(key, &[pin.above])?;
        // A split cloth has asked its sets before.
        let Self::Mesh(_, sets) = self else {
            let problem = "asks for an attribute: only meshes of PLY and glTF files have them";
            return Err(check.error(key, problem));
        };
        let Some(particles) = sets.above(pin) else {
            let known = sets.attributes.iter().map(|attribute| attribute.name.clone()).collect();
            let place = check.place(key);
            return Err(SceneUnknown::error(place, "attribute", &pin.attribute, known));
        };
        if particles.is_empty() {
            let ScenePinAttribute { attribute, above } = pin;
            let problem = format!("finds no vertex whose `{attribute}` is above {above}: lower it");
            return Err(check.error(key, &problem));
        }
        Ok(particles)
    }

    fn known(&self) -> Vec<String> {
        match self {
            Self::Grid([columns, rows], _) => GRID_NAMES
                .iter()
                .map(|&name| name.to_owned())
                .chain([
                    format!("column-{}", columns.saturating_sub(1)),
                    format!("row-{}", rows.saturating_sub(1)),
                ])
                .collect(),
            Self::Mesh(_, sets) => std::iter::once("all".to_owned())
                .chain(sets.groups.iter().map(|group| group.name.clone()))
                .collect(),
            Self::Split(before, _) => before.known(),
        }
    }
}

/// The particles of a set, found without a look at those outside of it: a scene can name any number of sets.
fn grid_set([columns, rows]: [u32; 2], name: &str) -> Option<Vec<u32>> {
    let [last_column, last_row] = [columns.checked_sub(1)?, rows.checked_sub(1)?];
    let column = |column: u32| (0..rows).map(move |row| row * columns + column);
    let row = |row: u32| (0..columns).map(move |column| row * columns + column);
    let corner = |column: u32, row: u32| row * columns + column;
    let corners = [[0, 0], [last_column, 0], [0, last_row], [last_column, last_row]];
    let mut set: Vec<u32> = match name {
        "left" => column(0).collect(),
        "right" => column(last_column).collect(),
        "bottom" => row(0).collect(),
        "top" => row(last_row).collect(),
        "border" => {
            let sides = column(0).chain(column(last_column));
            sides.chain(row(0)).chain(row(last_row)).collect()
        }
        "bottom-left" => vec![corner(0, 0)],
        "bottom-right" => vec![corner(last_column, 0)],
        "top-left" => vec![corner(0, last_row)],
        "top-right" => vec![corner(last_column, last_row)],
        "corners" => corners.map(|[i, j]| corner(i, j)).to_vec(),
        _ => {
            // One way to write each number, so that a set has one name.
            let number = |prefix: &str| {
                let digits = name.strip_prefix(prefix)?;
                digits.parse::<u32>().ok().filter(|number| number.to_string() == digits)
            };
            match number("column-").filter(|&number| number < columns) {
                Some(number) => column(number).collect(),
                None => row(number("row-").filter(|&number| number < rows)?).collect(),
            }
        }
    };
    set.sort_unstable();
    set.dedup();
    Some(set)
}

#[cfg(test)]
mod tests {
    use super::grid_set;

    #[test]
    fn sets_of_a_grid_of_four_by_three() {
        let set = |name| grid_set([4, 3], name).unwrap();
        assert_eq!(set("left"), [0, 4, 8]);
        assert_eq!(set("right"), [3, 7, 11]);
        assert_eq!(set("bottom"), [0, 1, 2, 3]);
        assert_eq!(set("top"), [8, 9, 10, 11]);
        assert_eq!(set("corners"), [0, 3, 8, 11]);
        assert_eq!(set("border"), [0, 1, 2, 3, 4, 7, 8, 9, 10, 11]);
        assert_eq!(set("top-left"), [8]);
        assert_eq!(set("bottom-right"), [3]);
        assert_eq!(set("row-1"), [4, 5, 6, 7]);
        assert_eq!(set("column-3"), [3, 7, 11]);
        for name in ["row-01", "row-+1", "row-3", "column-4", "row-", "row--1", "middle", ""] {
            assert_eq!(grid_set([4, 3], name), None, "{name}");
        }
    }
}
