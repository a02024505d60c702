//! Where the threads of fabric run on its triangles.

use std::collections::HashMap;

use cloth_core::Model;

/// Lines that a cloth has along its longer side, at least.
const LINES: f64 = 12.0;

/// Lines along the warp and along the weft of all fabric of a model, evenly apart in its pattern. They follow from the pattern alone, so that
/// they move with the cloth: where they part, it is stretched, and where they lean, it is sheared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ThreadMap {
    /// Of each triangle of the model its corners in the pattern, along warp and weft, counted in distances of lines; `None` for those of springs.
    places: Vec<Option<[[f64; 2]; 3]>>,
}

/// A piece of a line on one triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThreadSegment {
    /// The triangle, among those of the model.
    pub triangle: u32,
    /// Which way the line runs.
    pub direction: ThreadDirection,
    /// Weights of the corners of the triangle at both ends.
    pub ends: [[f64; 3]; 2],
}

/// Which way a thread runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ThreadDirection {
    /// Along the warp.
    Warp,
    /// Along the weft.
    Weft,
}

impl ThreadDirection {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Warp, Self::Weft];

    /// How its lines are drawn, as sRGB: the warp dark and the weft light, which can be told apart on the colour of a cloth and on those of strain.
    #[must_use]
    pub const fn colour(self) -> [u8; 3] {
        match self {
            Self::Warp => [20, 20, 26],
            Self::Weft => [246, 245, 238],
        }
    }

    /// The coordinate that is the same along a line: lines along the warp lie side by side along the weft.
    pub(super) const fn across(self) -> usize {
        match self {
            Self::Warp => 1,
            Self::Weft => 0,
        }
    }
}

impl ThreadMap {
    /// The lines of a model; none if it has no fabric.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let mut places = local_places(model);
        for cloth in model.cloths() {
            let range = cloth.triangles.start as usize..cloth.triangles.end as usize;
            let triangles = &model.triangles()[range.clone()];
            let islands = join(triangles, &mut places[range.clone()]);
            spread(&mut places[range], &islands);
        }
        if places.iter().all(Option::is_none) {
            places.clear();
        }
        Self { places }
    }

    /// Whether there are no lines.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Number of triangles of the model, or 0 without lines.
    pub(super) fn triangle_count(&self) -> usize {
        self.places.len()
    }

    /// The corners of a triangle along warp and weft, counted in distances of lines, which lie in the middle between whole numbers.
    pub(super) fn place(&self, triangle: usize) -> Option<[[f64; 2]; 3]> {
        *self.places.get(triangle)?
    }

    /// All lines, cut at the edges of triangles.
    pub fn segments(&self) -> impl Iterator<Item = ThreadSegment> + '_ {
        let numbered = (0..).zip(&self.places);
        numbered.flat_map(|(triangle, place)| {
            let both = place.iter().flat_map(|corners| {
                ThreadDirection::ALL.map(|direction| (direction, corners)).into_iter()
            });
            both.flat_map(move |(direction, corners)| {
                let levels = corners.map(|corner| corner[direction.across()]);
                lines_across(levels).map(move |level| ThreadSegment {
                    triangle,
                    direction,
                    ends: crossing(levels, level),
                })
            })
        })
    }
}

/// The lines between the lowest and the highest corner of a triangle.
fn lines_across(levels: [f64; 3]) -> impl Iterator<Item = f64> {
    let least = levels.into_iter().fold(f64::INFINITY, f64::min);
    let largest = levels.into_iter().fold(f64::NEG_INFINITY, f64::max);
    // A line through the lowest corners alone is left to the neighbour, through the highest ones it is not.
    let first = (least - 0.5).floor() as i64 + 1;
    let last = (largest - 0.5).floor() as i64;
    (first..=last).map(|number| number as f64 + 0.5)
}

/// Where the line at `level` enters and leaves a triangle whose corners are at `levels`, some of them below it and some not.
fn crossing(levels: [f64; 3], level: f64) -> [[f64; 3]; 2] {
    let mut ends = [[0.0; 3]; 2];
    let mut found = 0;
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        if (levels[from] < level) != (levels[to] < level) && found < 2 {
            let share = (level - levels[from]) / (levels[to] - levels[from]);
            ends[found][from] = 1.0 - share;
            ends[found][to] = share;
            found += 1;
        }
    }
    ends
}

/// Corners of each triangle of fabric in its pattern \[m\], its first corner at the origin.
fn local_places(model: &Model) -> Vec<Option<[[f64; 2]; 3]>> {
    let mut elements = model.elements().triangles().iter().peekable();
    let place = |particles: &[u32; 3]| {
        // Elements are in the order of the triangles, of which those of springs are not among them.
        let element = elements.next_if(|element| element.particles == *particles)?;
        let [[a, b], [c, d]] = element.rest.inverse;
        let determinant = a * d - b * c;
        let [first, second] = [[d, -b], [-c, a]].map(|row| row.map(|x| x / determinant));
        // Columns of the matrix are the sides.
        let corners = [[0.0; 2], [first[0], second[0]], [first[1], second[1]]];
        corners.as_flattened().iter().all(|x| x.is_finite()).then_some(corners)
    };
    model.triangles().iter().map(place).collect()
}

/// Moves triangles that share an edge together, so that lines run on from one to the next; the triangles of each island that comes of it. Where the
/// directions of two neighbours differ, as on a mesh without a flat pattern, the middles of their edges meet.
fn join(triangles: &[[u32; 3]], places: &mut [Option<[[f64; 2]; 3]>]) -> Vec<Vec<usize>> {
    let mut at_edge: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
    for (number, triangle) in triangles.iter().enumerate() {
        for edge in edges(triangle) {
            at_edge.entry(edge).or_default().push(number);
        }
    }
    let mut is_placed = vec![false; triangles.len()];
    let mut islands = Vec::new();
    for start in 0..triangles.len() {
        if is_placed[start] || places[start].is_none() {
            continue;
        }
        is_placed[start] = true;
        let mut island = vec![start];
        let mut next = 0;
        while next < island.len() {
            let own = island[next];
            next += 1;
            for edge in edges(&triangles[own]) {
                for &other in at_edge.get(&edge).into_iter().flatten() {
                    if is_placed[other] {
                        continue;
                    }
                    let middle = |number: usize| middle(&triangles[number], places[number]?, edge);
                    let (Some(to), Some(from)) = (middle(own), middle(other)) else { continue };
                    for corner in places[other].iter_mut().flatten() {
                        for axis in 0..2 {
                            corner[axis] += to[axis] - from[axis];
                        }
                    }
                    is_placed[other] = true;
                    island.push(other);
                }
            }
        }
        islands.push(island);
    }
    islands
}

fn edges(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)])
}

/// The middle of an edge of a triangle in the pattern.
fn middle(triangle: &[u32; 3], corners: [[f64; 2]; 3], edge: [u32; 2]) -> Option<[f64; 2]> {
    let corner = |particle: u32| {
        let place = triangle.iter().position(|&own| own == particle)?;
        Some(corners[place])
    };
    let (a, b) = (corner(edge[0])?, corner(edge[1])?);
    Some([0, 1].map(|axis| 0.5 * (a[axis] + b[axis])))
}

/// Counts the places of a cloth in distances of lines from the corner of each island.
fn spread(places: &mut [Option<[[f64; 2]; 3]>], islands: &[Vec<usize>]) {
    let bounds: Vec<[[f64; 2]; 2]> = islands
        .iter()
        .map(|island| {
            let corners = island.iter().filter_map(|&number| places[number]).flatten();
            let start = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
            corners.fold(start, |[least, largest], corner| {
                [0, 1].map(|end| {
                    [0, 1].map(|axis| match end {
                        0 => least[axis].min(corner[axis]),
                        _ => largest[axis].max(corner[axis]),
                    })
                })
            })
        })
        .collect();
    let extents = bounds.iter().flat_map(|[least, largest]| [0, 1].map(|k| largest[k] - least[k]));
    let distance = round_distance(extents.fold(0.0, f64::max) / LINES);
    for (island, [least, _]) in islands.iter().zip(bounds) {
        for &number in island {
            for corner in places[number].iter_mut().flatten() {
                *corner = [0, 1].map(|axis| (corner[axis] - least[axis]) / distance);
            }
        }
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is not above `distance` \[m\], so that lines tell the size of a cloth.
fn round_distance(distance: f64) -> f64 {
    let power = 10_f64.powf(distance.max(1e-9).log10().floor());
    let steps = [5.0, 2.0, 1.0].map(|step| step * power);
    steps.into_iter().find(|&step| step <= distance * (1.0 + 1e-9)).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use cloth_core::{
        Cloth, GridPatch, MaterialPreset, ModelBuilder,
        fabric::{BendingSheet, Fabric, FabricSheet, TensileSheet},
    };

    use super::*;

    fn fabric() -> Fabric {
        let sheet = FabricSheet {
            area_density: 0.15,
            tensile: [Some(TensileSheet::Slope(800.0)), Some(TensileSheet::Slope(300.0))],
            shear: Some(40.0),
            bending: [Some(BendingSheet::Rigidity(1e-5)), None, None],
            ..FabricSheet::default()
        };
        sheet.fit("sheet").unwrap().0
    }

    #[test]
    fn distances_are_round() {
        for (distance, round) in [(0.083, 0.05), (0.05, 0.05), (0.0499, 0.02), (1.3, 1.0)] {
            assert!((round_distance(distance) / round - 1.0).abs() < 1e-9, "{distance}");
        }
    }

    /// A sheet of 0.6 m by 0.4 m has 12 lines along the weft and 8 along the warp, straight from border to border.
    #[test]
    fn lines_run_through_a_sheet_from_border_to_border() {
        let patch = GridPatch::new([13, 9], 0.05);
        let springs = Cloth::grid("springs", patch, &MaterialPreset::DENIM);
        let sheet = Cloth::fabric("sheet", patch, fabric());
        let model = ModelBuilder::new().cloth(springs).cloth(sheet).build().unwrap();
        let map = ThreadMap::new(&model);
        let first = model.cloths()[1].triangles.start;
        let mut lengths: HashMap<(bool, i64), f64> = HashMap::new();
        for segment in map.segments() {
            assert!(segment.triangle >= first, "springs have no threads");
            let corners = model.triangles()[segment.triangle as usize]
                .map(|particle| model.positions()[particle as usize]);
            let [a, b] = segment.ends.map(|weights| {
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                [0, 1].map(|k| (0..3).map(|i| weights[i] * corners[i][k]).sum::<f64>())
            });
            let is_warp = segment.direction == ThreadDirection::Warp;
            // The grid has its warp along the columns, which is x.
            let (along, across) = if is_warp { (0, 1) } else { (1, 0) };
            assert!((a[across] - b[across]).abs() < 1e-12);
            let line = (a[across] / 0.05 * 2.0).round() as i64;
            *lengths.entry((is_warp, line)).or_default() += (a[along] - b[along]).abs();
        }
        let of = |is_warp: bool| lengths.iter().filter(move |((warp, _), _)| *warp == is_warp);
        assert_eq!((of(true).count(), of(false).count()), (8, 12));
        assert!(of(true).all(|(_, length)| (length - 0.6).abs() < 1e-9), "{lengths:?}");
        assert!(of(false).all(|(_, length)| (length - 0.4).abs() < 1e-9), "{lengths:?}");
    }

    #[test]
    fn a_model_of_springs_has_no_threads() {
        let springs = Cloth::grid("springs", GridPatch::new([4, 4], 0.1), &MaterialPreset::DENIM);
        let model = ModelBuilder::new().cloth(springs).build().unwrap();
        let map = ThreadMap::new(&model);
        assert!(map.is_empty() && map.segments().next().is_none());
    }
}
