use cloth_audit::Intersections;
use glam::DQuat;

use super::*;

#[derive(Clone, Default)]
struct Sheets {
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Sheets {
    /// Adds a square of so many cells, each triangle counterclockwise as seen from `turn` of +z.
    fn square(mut self, cells: u32, side: f64, turn: DQuat, middle: [f64; 3]) -> Self {
        let (first, line) = (self.positions.len() as u32, cells + 1);
        let along = |i: u32| side * (f64::from(i) / f64::from(cells) - 0.5);
        for j in 0..line {
            for i in 0..line {
                let place = turn * DVec3::new(along(i), along(j), 0.0) + DVec3::from(middle);
                self.positions.push(place.to_array());
            }
        }
        for (j, i) in (0..cells).flat_map(|j| (0..cells).map(move |i| (j, i))) {
            let a = first + j * line + i;
            self.triangles.push([a, a + 1, a + line]);
            self.triangles.push([a + 1, a + line + 1, a + line]);
        }
        self
    }

    fn cloth(&self) -> Cloth<'_> {
        Cloth { triangles: &self.triangles, is_held: &[], layers: &[] }
    }

    /// What intersects, by the audit alone.
    fn found(&self, bodies: &[Body]) -> Intersections {
        let own = Surface::cloth(&self.positions, &self.triangles);
        let others = bodies.iter().map(|body| Surface::body(&body.positions, &body.triangles));
        cloth_audit::intersections(&std::iter::once(own).chain(others).collect::<Vec<_>>())
    }

    /// The largest share by which the length of an edge is not what it was.
    fn stretch(&self, before: &Self) -> f64 {
        let mesh = mesh::Mesh::new(&self.triangles, self.positions.len());
        let length = |sheets: &Self, [a, b]: [u32; 2]| {
            let [a, b] = [a, b].map(|i| DVec3::from(sheets.positions[i as usize]));
            a.distance(b)
        };
        let of_edge = |edge: &mesh::Edge| length(self, edge.ends) / length(before, edge.ends);
        mesh.edges.iter().map(of_edge).map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max)
    }
}

fn degrees(axis: DVec3, angle: f64) -> DQuat {
    DQuat::from_axis_angle(axis, angle.to_radians())
}

/// A cube around the origin, whose triangles are seen counterclockwise from outside.
fn cube(half: f64) -> Body {
    let corner = |k: usize| std::array::from_fn(|axis| [-half, half][k >> (2 - axis) & 1]);
    let quads =
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Body { positions: (0..8).map(corner).collect(), triangles }
}

/// Two sheets that cross, ever steeper, and one that dips a border through the other.
#[test]
fn sheets_are_parted() {
    let flat = Sheets::default().square(20, 0.4, DQuat::IDENTITY, [0.0; 3]);
    let turns = [5.0, 15.0, 30.0].map(|angle| (degrees(DVec3::Y, angle), [0.013, 0.007, 0.004]));
    let dip = degrees(DVec3::Y, 12.0) * degrees(DVec3::X, 6.0);
    for (turn, middle) in turns.into_iter().chain([(dip, [0.17, 0.12, 0.002])]) {
        let turn = turn * degrees(DVec3::Z, 20.0);
        let before = flat.clone().square(15, 0.3, turn, middle);
        let mut after = before.clone();
        let found = recover(&mut after.positions, &before.cloth(), &[], 4e-3);
        assert!(found.before as u64 == before.found(&[]).crossings && found.before > 20);
        assert!(found.after == 0 && after.found(&[]).is_clean(), "{turn}: {found:?}");
        assert!(found.rounds < 200 && found.moved < 0.12, "{turn}: {found:?}");
        assert!(after.stretch(&before) < 0.25, "{turn}: {}", after.stretch(&before));
        let mut again = before.clone();
        recover(&mut again.positions, &before.cloth(), &[], 4e-3);
        assert_eq!(again.positions, after.positions, "the same bits");
    }
}

/// A strip that is bent through itself, as a Greek alpha.
#[test]
fn a_sheet_that_goes_through_itself_is_parted() {
    let mut before = Sheets::default().square(30, 0.6, DQuat::IDENTITY, [0.0; 3]);
    for place in &mut before.positions {
        let (x, y) = (place[0] / 0.3, place[1]);
        // The ends cross at the bottom of the loop; one is a little turned.
        let angle = 3.9 * x;
        *place = [0.08 * angle.sin() + 0.02 * x, y * 0.3 + 0.01 * x, 0.08 * (1.0 - angle.cos())];
        place[0] += 0.03 * (x * x * x);
    }
    let mut after = before.clone();
    let found = recover(&mut after.positions, &before.cloth(), &[], 4e-3);
    assert!(found.before > 10, "{found:?}");
    assert!(found.after == 0 && after.found(&[]).is_clean(), "{found:?}");
}

/// Cloth leaves a closed body, whichever way its faces look; an open one is a sheet that does not move.
#[test]
fn bodies_are_left() {
    let mut inside_out = cube(0.1);
    inside_out.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    let mut open = cube(0.1);
    open.triangles.truncate(2);
    for body in [cube(0.1), inside_out, open] {
        let turn = degrees(DVec3::Y, 20.0);
        let before = Sheets::default().square(24, 0.4, turn, [-0.093, 0.012, 0.013]);
        let mut after = before.clone();
        let bodies = [body.clone()];
        let found = recover(&mut after.positions, &before.cloth(), &bodies, 4e-3);
        assert!(found.before > 10, "{found:?}");
        assert!(found.after == 0 && after.found(&bodies).is_clean(), "{found:?}");
    }
}

/// Most of the higher layer is behind the lower one, and comes to its front all the same.
#[test]
fn layers_say_which_is_in_front() {
    let flat = Sheets::default().square(20, 0.4, DQuat::IDENTITY, [0.0; 3]);
    let turn = degrees(DVec3::Y, 8.0);
    let before = flat.square(15, 0.3, turn, [0.0, 0.0, -8e-3]);
    let own = |of: &Sheets| of.positions[441..].iter().map(|x| x[2]).sum::<f64>() / 256.0;
    for (layers, is_above) in [([None; 2], false), ([Some(0), Some(1)], true)] {
        let layers: Vec<_> = (0..697).map(|i| layers[usize::from(i >= 441)]).collect();
        let mut after = before.clone();
        let cloth = Cloth { layers: &layers, ..before.cloth() };
        let found = recover(&mut after.positions, &cloth, &[], 4e-3);
        assert!(found.before > 20 && found.after == 0, "{found:?}");
        assert_eq!(own(&after) > own(&before) + 4e-3, is_above, "{}", own(&after));
    }
}

/// What is held cannot be parted: nothing is said to be done, and it stays where it is. What is free of it is left alone as well.
#[test]
fn held_particles_stay() {
    let flat = Sheets::default().square(10, 0.4, DQuat::IDENTITY, [0.0; 3]);
    let crossing = flat.square(10, 0.3, degrees(DVec3::Y, 30.0), [0.0; 3]);
    let before = crossing.square(2, 0.1, DQuat::IDENTITY, [2.0, 0.0, 0.0]);
    let held = vec![true; 242];
    let mut after = before.clone();
    let cloth = Cloth { is_held: &held, ..before.cloth() };
    let found = recover(&mut after.positions, &cloth, &[], 4e-3);
    assert!(found.after == found.before && found.moved == 0.0, "{found:?}");
    assert_eq!(after.positions, before.positions);
}

#[test]
fn what_makes_no_sense_is_left_out() {
    let mut before = Sheets::default().square(6, 0.4, DQuat::IDENTITY, [0.0; 3]).square(
        6,
        0.3,
        degrees(DVec3::Y, 20.0),
        [0.01, 0.0, 0.0],
    );
    before.positions[3] = [f64::NAN; 3];
    before.positions[60] = [f64::INFINITY, 0.0, 0.0];
    before.triangles.extend([[0, 1, 999], [4, 4, 5], [u32::MAX; 3]]);
    let mut after = before.clone();
    let mut body = cube(0.01);
    body.triangles.extend([[0, 1, 77], [2, 2, 2]]);
    let found = recover(&mut after.positions, &before.cloth(), &[body], 4e-3);
    assert!(found.before > 0 && found.after < found.before, "{found:?}");
    assert_eq!(recover(&mut [], &Sheets::default().cloth(), &[], 1.0), Recovered::default());
}
