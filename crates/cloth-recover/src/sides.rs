//! Which sheet of a contour goes to which side of the other one.

use std::collections::HashMap;

use glam::DVec3;

use crate::{
    Cloth,
    contours::Link,
    mesh::{Mesh, Surfaces, normal},
};

/// What is done at a contour.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    /// The sheet that goes there.
    pub(crate) mover: usize,
    /// 1 for the side of the other sheet where its triangles are seen counterclockwise, -1 for that behind.
    pub(crate) side: f64,
}

/// A sheet: its surface, and its piece of cloth by the first particle of that.
pub(crate) type Sheet = (usize, u32);

/// What was decided for two pieces before: the first one goes, or the second one, and to which side. Without it what is nearly in balance would go back
/// and forth.
pub(crate) type Memory = HashMap<[Sheet; 2], Side>;

/// Decides for every contour. A body is left; of two layers the higher one goes in front of the lower one; of two other pieces the smallest part that
/// is cut off goes back through the other one: they meet in any number of contours, and all of these have one answer, as one piece is in front of the other one
/// everywhere. `None` where a piece goes through itself. `crossed` has the numbers of all crossed edges of the cloth, ascending.
pub(crate) fn sides(
    scene: (&Surfaces<'_>, &Cloth<'_>),
    at: &[DVec3],
    contours: &[Vec<Link>],
    crossed: &[usize],
    memory: &mut Memory,
) -> Vec<Option<Side>> {
    let sheets: Vec<[Sheet; 2]> = contours.iter().map(|contour| sheets(scene.0, contour)).collect();
    let mut one = |&[first, second]: &[Sheet; 2]| {
        if first == second {
            return None;
        }
        // The pieces in their order, which that of the sheets need not be.
        let is_turned = second < first;
        let key = if is_turned { [second, first] } else { [first, second] };
        if let Some(side) = given(scene, [first, second]) {
            return Some(side);
        }
        let known = memory.get(&key).copied().or_else(|| {
            let same = |[a, b]: [Sheet; 2]| [a, b] == key || [b, a] == key;
            let all = contours.iter().zip(&sheets).filter(|(_, sheets)| same(**sheets));
            let links: Vec<_> =
                all.flat_map(|(all, [a, b])| all.iter().map(move |link| (link, b < a))).collect();
            smallest(scene.0, at, &links, key, crossed)
        });
        let Side { mover, side } = known?;
        memory.insert(key, Side { mover, side });
        Some(Side { mover: mover ^ usize::from(is_turned), side })
    };
    sheets.iter().map(&mut one).collect()
}

/// The two sheets of a contour.
fn sheets(surfaces: &Surfaces<'_>, contour: &[Link]) -> [Sheet; 2] {
    let mut sheets = [(0, 0); 2];
    for Link { crossing, sheet, .. } in contour.iter().take(1) {
        let sheet_of = |surface: usize, particle: u32| {
            (surface, if surface == 0 { surfaces.cloth.piece_of(particle) } else { 0 })
        };
        let corner = match crossing.surface {
            0 => surfaces.cloth.triangles[crossing.triangle][0],
            _ => 0,
        };
        sheets[*sheet] = sheet_of(crossing.edge_surface, crossing.edge[0]);
        sheets[1 - sheet] = sheet_of(crossing.surface, corner);
    }
    sheets
}

/// What bodies and layers say. A piece has one layer.
fn given((surfaces, cloth): (&Surfaces<'_>, &Cloth<'_>), [a, b]: [Sheet; 2]) -> Option<Side> {
    let layer = |(surface, piece): Sheet| {
        let layer = cloth.layers.get(piece as usize).copied().flatten();
        layer.filter(|_| surface == 0)
    };
    [(a, b), (b, a)].into_iter().enumerate().find_map(|(mover, (own, other))| {
        let outside = other.0.checked_sub(1).map_or(0.0, |body| surfaces.bodies[body].outside);
        if outside != 0.0 {
            return Some(Side { mover, side: outside });
        }
        let is_above = layer(own)? > layer(other)?;
        is_above.then_some(Side { mover, side: 1.0 })
    })
}

/// The way of the smallest part that is cut off one of two sheets. `links` are those of all their contours, with whether they name the sheets in the
/// other order.
fn smallest(
    surfaces: &Surfaces<'_>,
    at: &[DVec3],
    links: &[(&Link, bool)],
    sheets: [Sheet; 2],
    crossed: &[usize],
) -> Option<Side> {
    let of_cloth = (0..2).filter(|&sheet| sheets[sheet].0 == 0);
    let cut_off = of_cloth.filter_map(|mover| {
        let own = links.iter().filter(|(link, turned)| link.sheet ^ usize::from(*turned) == mover);
        let [behind, front] = sources(surfaces, at, own.map(|(link, _)| *link));
        let sizes = flood(&surfaces.cloth, at.len(), [&behind, &front], crossed)?;
        let side = if sizes[0] <= sizes[1] { 1.0 } else { -1.0 };
        Some((sizes[0].min(sizes[1]), Side { mover, side }))
    });
    cut_off.min_by_key(|(size, _)| *size).map(|(_, side)| side)
}

/// The ends of the edges of a sheet behind the other sheet, and in front of it.
fn sources<'a>(
    surfaces: &Surfaces<'_>,
    at: &[DVec3],
    links: impl Iterator<Item = &'a Link>,
) -> [Vec<u32>; 2] {
    let mut ends = [vec![], vec![]];
    for Link { crossing, .. } in links {
        let corners = surfaces.corners(at, crossing.surface, crossing.triangle);
        let normal = normal(corners);
        let [a, b] = crossing.edge;
        let heights = [a, b].map(|end| normal.dot(at[end as usize] - corners[0]));
        let (low, high) = if heights[0] <= heights[1] { (a, b) } else { (b, a) };
        ends[0].push(low);
        ends[1].push(high);
    }
    ends
}

/// How many particles are reached first from either side, along edges that nothing crosses. A contour that divides the sheet leaves to each side what is
/// its own; one that ends within it leaves less to the side of the nearer border. `None` without any source.
fn flood(
    mesh: &Mesh<'_>,
    particles: usize,
    sources: [&[u32]; 2],
    crossed: &[usize],
) -> Option<[usize; 2]> {
    if sources[0].is_empty() {
        return None;
    }
    let mut is_reached = vec![false; particles];
    let mut sizes = [0; 2];
    let mut fronts = [vec![], vec![]];
    for (side, ends) in sources.into_iter().enumerate() {
        for &end in ends {
            if !std::mem::replace(&mut is_reached[end as usize], true) {
                fronts[side].push(end);
            }
        }
    }
    while !fronts[0].is_empty() || !fronts[1].is_empty() {
        for side in 0..2 {
            sizes[side] += fronts[side].len();
            let mut next = vec![];
            for &particle in &fronts[side] {
                for (number, other) in mesh.around(particle) {
                    if !is_reached[other as usize] && crossed.binary_search(&number).is_err() {
                        is_reached[other as usize] = true;
                        next.push(other);
                    }
                }
            }
            fronts[side] = next;
        }
    }
    Some(sizes)
}
