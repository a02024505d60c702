//! Mannequins of many measures, in many poses.

use std::{
    collections::{HashMap, HashSet},
    thread,
};

use cloth_mannequin::{Mannequin, MannequinError, Measures, Pose, Swing, girth};

fn slim() -> Measures {
    Measures { height: 1.85, neck: 0.34, chest: 0.85, waist: 0.66, hips: 0.88, shoulders: 0.41 }
}

fn stout() -> Measures {
    Measures { height: 1.6, neck: 0.4, chest: 1.15, waist: 1.1, hips: 1.2, shoulders: 0.38 }
}

fn bodies() -> [Measures; 4] {
    [Measures::default(), Measures::of_height(1.5), slim(), stout()]
}

fn corners(positions: &[[f64; 3]], triangle: [u32; 3]) -> [[f64; 3]; 3] {
    triangle.map(|vertex| positions[vertex as usize])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn volume(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let part = |&triangle: &[u32; 3]| {
        let [a, b, c] = corners(positions, triangle);
        dot(a, cross(b, c)) / 6.0
    };
    triangles.iter().map(part).sum()
}

/// The least angle of all triangles \[degrees\].
fn angle_min(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let angle = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        let [u, v] = [minus(b, a), minus(c, a)];
        let n = cross(u, v);
        dot(n, n).sqrt().atan2(dot(u, v)).to_degrees()
    };
    let least = |&triangle: &[u32; 3]| {
        let [a, b, c] = corners(positions, triangle);
        angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b))
    };
    triangles.iter().map(least).fold(f64::MAX, f64::min)
}

#[test]
fn a_tape_reads_what_was_asked() {
    for measures in bodies() {
        let mannequin = Mannequin::new(&measures, 0.02).unwrap();
        let positions = mannequin.positions();
        let wanted = [
            ("neck", 0.868, measures.neck),
            ("chest", 0.72, measures.chest),
            ("waist", 0.62, measures.waist),
            ("hips", 0.515, measures.hips),
        ];
        for (name, level, wanted) in wanted {
            let read = girth(&positions, mannequin.triangles(), level * measures.height);
            println!("{name} {wanted:.3} m: {:+.2} %", 100.0 * (read / wanted - 1.0));
            assert!((read / wanted - 1.0).abs() < 0.015, "{name}: {read} m, not {wanted}");
        }
        let top = positions.iter().map(|at| at[2]).fold(f64::MIN, f64::max);
        let bottom = positions.iter().map(|at| at[2]).fold(f64::MAX, f64::min);
        assert!((top - measures.height).abs() < 0.004, "{top} m tall, not {}", measures.height);
        assert!(bottom.abs() < 1e-6, "soles at {bottom} m");
    }
}

#[test]
fn the_mesh_is_one_closed_surface_of_good_triangles() {
    for measures in bodies() {
        for edge in [0.012, 0.017, 0.02, 0.025, 0.03] {
            let mannequin = Mannequin::new(&measures, edge).unwrap();
            let (positions, triangles) = (mannequin.positions(), mannequin.triangles());
            let mut edges = HashMap::new();
            for &[a, b, c] in triangles {
                for pair in [(a, b), (b, c), (c, a)] {
                    *edges.entry(pair).or_insert(0) += 1;
                }
            }
            let is_paired = |(&(a, b), &count): (&(u32, u32), &i32)| {
                count == 1 && edges.get(&(b, a)) == Some(&1)
            };
            assert!(
                edges.iter().all(is_paired),
                "{measures:?} {edge}: each edge has two triangles"
            );
            let used: HashSet<u32> = triangles.iter().flatten().copied().collect();
            assert_eq!(used.len(), positions.len());
            let euler = positions.len() + triangles.len() - edges.len() / 2;
            assert_eq!(euler, 2, "{measures:?} {edge}: that of a sphere");
            let (litres, least) =
                (1e3 * volume(&positions, triangles), angle_min(&positions, triangles));
            println!("edge {edge}: {} triangles, least angle {least:.1} degrees", triangles.len());
            assert!((40.0..130.0).contains(&litres), "{litres} l");
            assert!(least > 5.0, "{measures:?} {edge}: a triangle of {least} degrees");
            let lengths = edges.keys().map(|&(a, b)| {
                let along = minus(positions[b as usize], positions[a as usize]);
                dot(along, along).sqrt()
            });
            let mean = lengths.sum::<f64>() / edges.len() as f64;
            assert!((mean / edge - 1.0).abs() < 0.05, "edges of {mean} m, not {edge}");
            let about = Mannequin::vertices_about(&measures, edge) as f64 / positions.len() as f64;
            assert!((0.8..1.25).contains(&about), "{about} of the vertices that there are");
        }
    }
}

#[test]
fn the_same_measures_give_the_same_bits_on_every_thread() {
    let made = || {
        let mannequin = Mannequin::new(&slim(), 0.025).unwrap();
        (mannequin.positions(), mannequin.triangles().to_vec())
    };
    let first = made();
    let threads: Vec<_> = (0..3).map(|_| thread::spawn(made)).collect();
    for thread in threads {
        assert_eq!(thread.join().unwrap(), first);
    }
}

#[test]
fn limbs_turn_about_their_joints_and_nothing_goes_through_itself() {
    let swing = |raise, forwards| Swing { raise, forwards };
    let up = |raise| Pose { shoulders: [swing(raise, 0.0); 2], ..Pose::default() };
    let stride = Pose {
        shoulders: [swing(45.0, 20.0), swing(50.0, 45.0)],
        elbows: [30.0, 30.0],
        hips: [swing(30.0, 90.0), swing(20.0, -90.0)],
        knees: [20.0, 30.0],
        head: 40.0,
    };
    for measures in bodies() {
        let mannequin = Mannequin::new(&measures, 0.02).unwrap();
        let rest = mannequin.positions();
        let triangles = mannequin.triangles();
        let crossings = |positions: &[[f64; 3]]| {
            let surface = cloth_audit::Surface::cloth(positions, triangles);
            cloth_audit::intersections(&[surface]).pairs()
        };
        assert_eq!(crossings(&rest), 0);
        let still = mannequin.posed(&Pose::default());
        let moved = |(a, b): (&[f64; 3], &[f64; 3])| dot(minus(*a, *b), minus(*a, *b)) > 1e-18;
        assert!(!still.iter().zip(&rest).any(moved), "the pose at rest is that of the mesh");
        for pose in [up(35.0), up(90.0), up(120.0), stride] {
            let posed = mannequin.posed(&pose);
            assert_eq!(crossings(&posed), 0, "{measures:?} in {pose:?}");
            let change = volume(&posed, triangles) / volume(&rest, triangles) - 1.0;
            assert!(change.abs() < 0.05, "volume changes by {change} in {pose:?}");
        }
        // A hand goes up, to the front, and its own way: the other one and the feet stay.
        let left = |pose: &Pose| {
            let posed = mannequin.posed(pose);
            let hand = (0..rest.len()).max_by(|&a, &b| rest[a][0].total_cmp(&rest[b][0])).unwrap();
            let still =
                (0..rest.len()).filter(|&k| rest[k][0] < 0.0 || rest[k][2] < 0.4 * measures.height);
            assert!(still.into_iter().all(|k| !moved((&posed[k], &rest[k]))));
            minus(posed[hand], rest[hand])
        };
        let one = |swing, elbow| Pose {
            shoulders: [swing, Pose::default().shoulders[1]],
            elbows: [elbow, 0.0],
            ..Pose::default()
        };
        assert!(left(&one(swing(90.0, 0.0), 0.0))[2] > 0.2 * measures.height);
        assert!(left(&one(swing(45.0, 90.0), 0.0))[1] < -0.2 * measures.height);
        assert!(left(&one(swing(45.0, 0.0), 90.0))[1] < -0.1 * measures.height);
    }
}

#[test]
fn what_no_adult_measures_is_refused() {
    let usual = Measures::default();
    let wrong = [
        (Measures { height: -1.7, ..usual }, "height"),
        (Measures { height: 17.0, ..usual }, "height"),
        (Measures { waist: f64::NAN, ..usual }, "waist"),
        (Measures { hips: f64::INFINITY, ..usual }, "hips"),
        (Measures { waist: 1.3, ..usual }, "waist"),
        (Measures { waist: 0.55, ..usual }, "chest"),
        (Measures { neck: 0.5, ..usual }, "neck"),
    ];
    for (measures, what) in wrong {
        let error = Mannequin::new(&measures, 0.02).unwrap_err();
        assert_eq!(error.what(), what, "{measures:?}: {error}");
        assert!(error.to_string().contains("give"), "{error} says no mend");
    }
    for edge in [0.0, -1.0, f64::NAN, 1e-4, 0.2] {
        let error = Mannequin::new(&usual, edge).unwrap_err();
        assert!(matches!(error, MannequinError::OutOfRange { what: "edge", .. }), "{error}");
    }
}
