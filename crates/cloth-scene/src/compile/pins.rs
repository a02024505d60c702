//! From names of pins to indices.

use cloth_core::VertexGroup;

use crate::{SceneError, ScenePin, error::SceneUnknown};

use super::Check;

/// The names that sets of particles of one cloth have.
pub(super) enum PinSets {
    /// Those of a grid of so many columns and rows.
    Grid([u32; 2]),
    /// The vertex groups of a mesh with so many vertices.
    Mesh(u32, Vec<VertexGroup>),
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
        };
        let found = match self {
            Self::Grid(counts) => grid_set(*counts, name),
            Self::Mesh(vertices, groups) => groups
                .iter()
                .find(|group| group.name == *name)
                .map(|group| group.vertices.clone())
                .or_else(|| (name == "all").then(|| (0..*vertices).collect())),
        };
        found.ok_or_else(|| {
            SceneUnknown::error(check.place(key), "set of particles", name, self.known())
        })
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
            Self::Mesh(_, groups) => std::iter::once("all".to_owned())
                .chain(groups.iter().map(|group| group.name.clone()))
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
