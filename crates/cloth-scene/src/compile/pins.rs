//! From names of pins to indices.

use cloth_core::{TriangleMesh, VertexAttribute, VertexGroup};

use crate::{SceneError, ScenePin, ScenePinAttribute, error::SceneUnknown};

use super::Check;

/// The names that sets of particles of one cloth have.
pub(super) enum PinSets {
    /// Those of a grid of so many columns and rows.
    Grid([u32; 2]),
    /// What a mesh or network with so many vertices has.
    Mesh(u32, MeshSets),
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

impl PinSets {
    /// The particles that `pin` names, as indices within the cloth. An index that does not exist is
    /// left to the caller.
    pub(super) fn resolve(
        &self,
        check: &Check<'_>,
        key: &str,
        pin: &ScenePin,
    ) -> Result<Vec<u32>, SceneError> {
        let name = match pin {
            ScenePin::Index(index) => return Ok(vec![*index]),
            ScenePin::Name(name) => name,
            ScenePin::Attribute(pin) => return self.attribute(check, key, pin),
        };
        let found = match self {
            Self::Grid(counts) => grid_set(*counts, name),
            Self::Mesh(vertices, sets) => {
                sets.group(name).or_else(|| (name == "all").then(|| (0..*vertices).collect()))
            }
        };
        found.ok_or_else(|| {
            SceneUnknown::error(check.place(key), "set of particles", name, self.known())
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
            Self::Grid([columns, rows]) => GRID_NAMES
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
        }
    }
}

fn grid_set([columns, rows]: [u32; 2], name: &str) -> Option<Vec<u32>> {
    let [last_column, last_row] = [columns.checked_sub(1)?, rows.checked_sub(1)?];
    let set = |wanted: &dyn Fn(u32, u32) -> bool| {
        let mut particles = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                if wanted(column, row) {
                    particles.push(row * columns + column);
                }
            }
        }
        Some(particles)
    };
    match name {
        "all" => set(&|_, _| true),
        "left" => set(&|i, _| i == 0),
        "right" => set(&|i, _| i == last_column),
        "bottom" => set(&|_, j| j == 0),
        "top" => set(&|_, j| j == last_row),
        "border" => set(&|i, j| i == 0 || j == 0 || i == last_column || j == last_row),
        "bottom-left" => set(&|i, j| i == 0 && j == 0),
        "bottom-right" => set(&|i, j| i == last_column && j == 0),
        "top-left" => set(&|i, j| i == 0 && j == last_row),
        "top-right" => set(&|i, j| i == last_column && j == last_row),
        "corners" => set(&|i, j| (i == 0 || i == last_column) && (j == 0 || j == last_row)),
        _ => {
            let number = |prefix| name.strip_prefix(prefix)?.parse::<u32>().ok();
            if let Some(column) = number("column-").filter(|&column| column < columns) {
                set(&|i, _| i == column)
            } else {
                let row = number("row-").filter(|&row| row < rows)?;
                set(&|_, j| j == row)
            }
        }
    }
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
        assert_eq!(set("all").len(), 12);
        for name in ["row-3", "column-4", "row-", "row--1", "middle", ""] {
            assert_eq!(grid_set([4, 3], name), None, "{name}");
        }
    }
}
