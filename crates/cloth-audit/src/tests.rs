//! Cases with a known answer, and every pair of random triangles judged by another method.

use std::time::Instant;

use proptest::{collection::vec, prelude::*};

use super::*;

type Whole = [i128; 3];

const FLAT: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

/// Two triangles of two cloths.
fn two(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> Intersections {
    intersections(&[Surface::cloth(&a, &[[0, 1, 2]]), Surface::cloth(&b, &[[0, 1, 2]])])
}

#[test]
fn two_triangles() {
    let upright = |x: f64, z: f64| [[x, 1.0, z], [x + 0.5, 1.0, z + 2.0], [x, 1.5, z + 2.0]];
    assert_eq!(two(FLAT, upright(1.0, -1.0)).between, 1);
    assert_eq!(two(FLAT, upright(5.0, -1.0)).between, 0, "beside it");
    assert_eq!(two(FLAT, upright(1.0, 1e-300)).between, 0, "above it");
    assert_eq!(two(FLAT, upright(1.0, 0.0)).between, 1, "a corner on it");
    let shifted = |x: f64, z: f64| FLAT.map(|[a, b, c]| [a + x, b, c + z]);
    assert_eq!(two(FLAT, shifted(1.0, 0.0)).between, 1, "in one plane");
    assert_eq!(two(FLAT, shifted(4.0, 0.0)).between, 1, "a corner on a corner");
    assert_eq!(two(FLAT, shifted(4.0 + 1e-15, 0.0)).between, 0);
    assert_eq!(two(FLAT, shifted(0.0, 1e-300)).between, 0, "above itself");
    assert_eq!(two(FLAT, FLAT).between, 1);
    let inside = [[0.5, 0.5, 0.0], [1.0, 0.5, 0.0], [0.5, 1.0, 0.0]];
    assert_eq!(two(FLAT, inside).between, 1, "one within the other");
    let found = two(FLAT, upright(1.0, -1.0)).first.unwrap();
    assert_eq!((found.surfaces, found.triangles), ([0, 1], [0, 0]));
    assert!(found.place[2].abs() < 1e-12 && found.place[0] > 0.9 && found.place[0] < 1.6);
}

/// Plain arithmetic says of an edge that only just misses that it meets, or the other way round; this does not.
#[test]
fn the_last_bit_decides() {
    let plain = |[a, b, c]: [[f64; 3]; 3], d: [f64; 3]| -> f64 {
        let [u, v, w] = [a, b, c].map(|p| -> [f64; 3] { std::array::from_fn(|k| p[k] - d[k]) });
        u[0] * (v[1] * w[2] - v[2] * w[1])
            + u[1] * (v[2] * w[0] - v[0] * w[2])
            + u[2] * (v[0] * w[1] - v[1] * w[0])
    };
    // Corners on the plane x + y + z = 1.5 and points on it, some of them one unit in the last place above or below.
    let triangle = [[0.5, 0.5, 0.5], [12.0, 12.0, -22.5], [24.0, -12.0, -10.5]];
    let mut wrong = 0;
    for i in 0..64_u32 {
        let x = f64::from(i).mul_add(2.0_f64.powi(-53), 8.0);
        let y = 0.5 + f64::from(i) * f64::EPSILON;
        let point = [x, y, 1.5 - x - y];
        // Exactly 1.5 - x - y, as fractions of 2^-53.
        let whole = |value: f64| (value * 2.0_f64.powi(53)) as i128;
        let exact = point.iter().map(|value| whole(*value)).sum::<i128>() - whole(1.5);
        let sign = predicate::side(triangle[0], triangle[1], triangle[2], point);
        let above = [9.0, 1.0, 1.0];
        let of_above = predicate::side(triangle[0], triangle[1], triangle[2], above);
        let expected = exact.signum() as i8 * of_above;
        assert_eq!(sign, expected, "{i}");
        let rounded = plain(triangle, point);
        wrong += u32::from((rounded > 0.0) != (sign > 0) || (rounded < 0.0) != (sign < 0));
    }
    assert!(wrong > 0, "plain arithmetic is never wrong here: the test shows nothing");
}

#[test]
fn neighbours_are_no_intersection() {
    // A strip of triangles, flat, then folded up, then onto itself.
    let strip = |tip: [f64; 3]| {
        let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], tip];
        intersections(&[Surface::cloth(&positions, &[[0, 1, 2], [1, 3, 2]])])
    };
    for tip in [[1.0, 1.0, 0.0], [0.5, 0.5, 1.0], [0.1, 0.1, 1e-300]] {
        assert_eq!(strip(tip), Intersections::default(), "{tip:?}");
    }
    assert_eq!(strip([0.1, 0.1, 0.0]).within, 1, "folded onto itself");
    assert_eq!(strip([-9.0, 3.0, 0.0]).within, 1, "folded onto itself, edges cross");
    // Two that share a corner: a fan, then the edge opposite to it of one through the other.
    let fan = |far: [f64; 3]| {
        let positions = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.5, 0.5, 1.0], far];
        intersections(&[Surface::cloth(&positions, &[[0, 1, 2], [0, 3, 4]])])
    };
    assert_eq!(fan([0.5, 0.6, 1.0]).pairs(), 0);
    let through = fan([0.5, 0.6, -1.0]);
    assert_eq!((through.within, through.crossings), (1, 1));
}

/// A sheet of n x n squares, its height given.
fn sheet(n: u32, height: impl Fn(f64, f64) -> f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let at = |i: u32| f64::from(i) / f64::from(n);
    let positions = (0..=n).flat_map(|j| (0..=n).map(move |i| (at(i), at(j))));
    let positions = positions.map(|(x, y)| [x, y, height(x, y)]).collect();
    let squares = (0..n).flat_map(|j| (0..n).map(move |i| j * (n + 1) + i));
    let triangles =
        squares.flat_map(|a| [[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]]).collect();
    (positions, triangles)
}

#[test]
fn sheets_that_cross_along_a_line_and_bodies() {
    let (flat, triangles) = sheet(32, |_, _| 0.0);
    let (tilted, _) = sheet(32, |x, _| x - 0.51);
    let [a, b] = [Surface::cloth(&flat, &triangles), Surface::cloth(&tilted, &triangles)];
    assert_eq!(intersections(&[a]), Intersections::default());
    let found = intersections(&[a, b]);
    assert_eq!((found.within, found.bodies), (0, 0));
    // The line x = 0.51 goes through 32 squares of each, two triangles a square, which meet those of the same square and some of the next.
    assert!((64..=200).contains(&found.between), "{found:?}");
    let body = Surface::body(&tilted, &triangles);
    let with_body = intersections(&[body, a]);
    assert_eq!((with_body.between, with_body.bodies), (0, found.between));
    assert_eq!(with_body.crossings, found.crossings);
    // Bodies among themselves do not count.
    assert_eq!(intersections(&[body, Surface::body(&flat, &triangles)]).pairs(), 0);
}

#[test]
fn what_cannot_be_looked_at_is_counted() {
    let positions = [[0.0; 3], [1.0, 0.0, 0.0], [f64::NAN, 1.0, 0.0], [1e200, 0.0, 0.0]];
    let surface = Surface::cloth(&positions, &[[0, 1, 2], [0, 1, 9], [0, 1, 3]]);
    let found = intersections(&[surface]);
    assert_eq!((found.unusable, found.pairs(), found.is_clean()), (3, 0, false));
    assert!(intersections(&[]).is_clean());
}

/// Much more than any cloth that is looked at frame by frame: time in proportion to triangles.
#[test]
fn many_triangles_take_a_moment() {
    let time = |n: u32| {
        let (positions, triangles) = sheet(n, |x, y| 0.1 * (20.0 * x).sin() * (17.0 * y).cos());
        let start = Instant::now();
        assert!(intersections(&[Surface::cloth(&positions, &triangles)]).is_clean());
        println!("{} triangles: {:?}", triangles.len(), start.elapsed());
        start.elapsed().as_secs_f64()
    };
    let (small, large) = (time(40), time(160));
    // 16 times as many; squared it would be 256.
    assert!(large < 80.0 * small.max(1e-3), "{small} s, {large} s");
}

fn minus(a: Whole, b: Whole) -> Whole {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: Whole, b: Whole) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Whole, b: Whole) -> Whole {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Whether two convex hulls meet, by whole numbers: two that do not are separated by the direction of a closest pair of points, which
/// joins two corners, or is at right angles to an edge, to an edge of each, or to a triangle.
fn meet(a: &[Whole], b: &[Whole]) -> bool {
    let edges = |of: &[Whole]| -> Vec<Whole> {
        let pairs = (0..of.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        pairs.map(|(i, j)| minus(of[i], of[j])).collect()
    };
    let (of_a, of_b) = (edges(a), edges(b));
    let differences: Vec<Whole> = a.iter().flat_map(|p| b.iter().map(|q| minus(*p, *q))).collect();
    let mut axes = differences.clone();
    for edge in of_a.iter().chain(&of_b) {
        let square = dot(*edge, *edge);
        axes.extend(differences.iter().map(|d| -> Whole {
            let along = dot(*d, *edge);
            std::array::from_fn(|k| square * d[k] - along * edge[k])
        }));
    }
    let all: Vec<Whole> = of_a.iter().chain(&of_b).copied().collect();
    axes.extend(all.iter().flat_map(|e| all.iter().map(|f| cross(*e, *f))));
    !axes.iter().any(|axis| {
        let mut sides = differences.iter().map(|d| dot(*d, *axis));
        let first = sides.next().unwrap_or(0).signum();
        first != 0 && sides.all(|side| side.signum() == first)
    })
}

/// Whether two triangles intersect beyond the particles that they share.
fn intersect(points: &[Whole], first: [u32; 3], second: [u32; 3]) -> bool {
    let at =
        |corners: &[u32]| -> Vec<Whole> { corners.iter().map(|&i| points[i as usize]).collect() };
    let without = |of: [u32; 3], other: [u32; 3]| -> Vec<u32> {
        of.into_iter().filter(|i| !other.contains(i)).collect()
    };
    let (own, others) = (without(first, second), without(second, first));
    match own.len() {
        3 => meet(&at(&first), &at(&second)),
        2 => meet(&at(&own), &at(&second)) || meet(&at(&others), &at(&first)),
        1 => {
            let shared: Vec<u32> = first.into_iter().filter(|i| second.contains(i)).collect();
            let [p, q, a, b] = [shared[0], shared[1], own[0], others[0]];
            meet(&at(&[a]), &at(&second))
                || meet(&at(&[b]), &at(&first))
                || meet(&at(&[p, a]), &at(&[q, b]))
                || meet(&at(&[q, a]), &at(&[p, b]))
        }
        _ => true,
    }
}

fn points(side: i128) -> impl Strategy<Value = Vec<Whole>> {
    vec([-side..=side, -side..=side, -side..=side], 9..=9)
}

fn triangles() -> impl Strategy<Value = Vec<[u32; 3]>> {
    let distinct = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    vec([0..9_u32, 0..9_u32, 0..9_u32].prop_filter("three corners", distinct), 2..10)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Small numbers, so that points, edges and planes coincide often; and larger ones.
    #[test]
    fn counts_are_those_of_every_pair(
        points in prop_oneof![points(2), points(5), points(1000)],
        triangles in triangles(),
        scale in prop_oneof![Just(1.0), Just(2.0_f64.powi(-40)), Just(2.0_f64.powi(60))],
    ) {
        let positions: Vec<[f64; 3]> =
            points.iter().map(|point| point.map(|x| x as f64 * scale)).collect();
        let pairs = (0..triangles.len()).flat_map(|i| (0..i).map(move |j| (j, i)));
        let expected: Vec<_> =
            pairs.filter(|&(i, j)| intersect(&points, triangles[i], triangles[j])).collect();
        let found = intersections(&[Surface::cloth(&positions, &triangles)]);
        prop_assert_eq!(found.within, expected.len() as u64, "{:?}", expected);
        let first = expected.iter().min();
        prop_assert_eq!(found.first.map(|pair| (pair.triangles[0], pair.triangles[1])), first.copied());
        // The same as cloths of one triangle each, which share nothing.
        let surfaces: Vec<_> =
            triangles.iter().map(|t| Surface::cloth(&positions, std::slice::from_ref(t))).collect();
        let as_hull = |t: [u32; 3]| t.map(|i| points[i as usize]);
        let pairs = (0..triangles.len()).flat_map(|i| (0..i).map(move |j| (j, i)));
        let expected = pairs.filter(|&(i, j)| meet(&as_hull(triangles[i]), &as_hull(triangles[j]))).count();
        prop_assert_eq!(intersections(&surfaces).between, expected as u64);
    }
}
