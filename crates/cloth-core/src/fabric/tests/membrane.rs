use proptest::prelude::*;

use super::{
    super::{
        BendingRigidity, Fabric, InternalFriction, TensileCurve,
        membrane::{self, Law, RestState, Tangent},
        vector::{Vector, cross},
    },
    Random, deviation, eigenvalues,
    meshes::{Mesh, sheet},
};

fn fabric(random: &mut Random) -> Fabric {
    let mut curve = || TensileCurve {
        linear: random.between([20.0, 2000.0]),
        cubic: random.between([0.0, 1e5]),
        end: random.between([0.05, 0.4]),
    };
    let [warp, weft] = [curve(), curve()];
    let largest = Fabric::largest_coupling(&warp, &weft);
    Fabric {
        area_density: 0.2,
        thickness: 4e-4,
        warp,
        weft,
        coupling: random.signed() * largest,
        shear: random.between([1.0, 500.0]),
        bending: BendingRigidity::isotropic(1e-5),
        friction: InternalFriction::default(),
        damping: [0.0; 2],
        stretch_limit: [f64::INFINITY, random.between([1.02, 1.3])]
            [usize::from(random.signed() > 0.0)],
    }
}

fn rest(random: &mut Random) -> RestState<f64> {
    loop {
        let corner = |random: &mut Random| [0.02 * random.signed(), 0.02 * random.signed()];
        let corners = [corner(random), corner(random), corner(random)];
        if let Some(rest) = membrane::rest_state(corners).filter(|rest| rest.area > 1e-5) {
            return rest;
        }
    }
}

/// Corners of a triangle with this deformation gradient.
fn placed(rest: &RestState<f64>, [f_u, f_v]: [Vector<f64>; 2]) -> [Vector<f64>; 3] {
    let [[a, b], [c, d]] = rest.inverse;
    let determinant = a * d - b * c;
    let [p, q] = [[d / determinant, -c / determinant], [-b / determinant, a / determinant]];
    let at = |uv: [f64; 2]| std::array::from_fn(|k| 0.3 + uv[0] * f_u[k] + uv[1] * f_v[k]);
    [at([0.0; 2]), at(p), at(q)]
}

/// A deformation gradient: stretches around 1 and a shear, turned at random.
fn gradient(random: &mut Random, spread: f64) -> [Vector<f64>; 2] {
    let turn = random.rotation();
    let f_u = glam::DVec3::new(1.0 + spread * random.signed(), spread * random.signed(), 0.0);
    let f_v = glam::DVec3::new(spread * random.signed(), 1.0 + spread * random.signed(), 0.0);
    [(turn * f_u).into(), (turn * f_v).into()]
}

fn energy(law: &Law<f64>, rest: &RestState<f64>, corners: [Vector<f64>; 3]) -> f64 {
    let gradient = membrane::deformation(corners, rest);
    rest.area * law.response(membrane::strain(gradient)).energy
}

fn forces(law: &Law<f64>, rest: &RestState<f64>, corners: [Vector<f64>; 3]) -> [Vector<f64>; 3] {
    let gradient = membrane::deformation(corners, rest);
    let response = law.response(membrane::strain(gradient));
    membrane::forces(gradient, response.stress, rest)
}

fn tangent(law: &Law<f64>, rest: &RestState<f64>, corners: [Vector<f64>; 3]) -> Tangent<f64> {
    let gradient = membrane::deformation(corners, rest);
    let response = law.response(membrane::strain(gradient));
    Tangent::new(gradient, law, &response, rest)
}

fn matrix(tangent: &Tangent<f64>) -> [[f64; 9]; 9] {
    std::array::from_fn(|i| std::array::from_fn(|j| tangent.block(i / 3, j / 3)[i % 3][j % 3]))
}

/// Minus the derivatives of all forces by all coordinates, by central differences.
fn jacobian(law: &Law<f64>, rest: &RestState<f64>, corners: [Vector<f64>; 3]) -> [[f64; 9]; 9] {
    let mut jacobian = [[0.0; 9]; 9];
    let step = 1e-8;
    for j in 0..9 {
        let at = |sign: f64| {
            let mut moved = corners;
            moved[j / 3][j % 3] += sign * step;
            forces(law, rest, moved)
        };
        let [after, before] = [at(1.0), at(-1.0)];
        for (i, row) in jacobian.iter_mut().enumerate() {
            row[j] = -(after[i / 3][i % 3] - before[i / 3][i % 3]) / (2.0 * step);
        }
    }
    jacobian
}

proptest! {
    #[test]
    fn forces_are_minus_the_derivative_of_the_energy(seed in 1_u64..u64::MAX) {
        let mut random = Random(seed);
        let law = Law::new(&fabric(&mut random), "it").unwrap();
        let rest = rest(&mut random);
        let corners = placed(&rest, gradient(&mut random, 0.4));
        let step = 1e-8;
        let mut expected = [0.0; 9];
        for (j, expected) in expected.iter_mut().enumerate() {
            let at = |sign: f64| {
                let mut moved = corners;
                moved[j / 3][j % 3] += sign * step;
                energy(&law, &rest, moved)
            };
            *expected = -(at(1.0) - at(-1.0)) / (2.0 * step);
        }
        let found = forces(&law, &rest, corners).concat();
        prop_assert!(deviation(&found, &expected) < 1e-6, "{found:?} {expected:?}");
        // A law whose stress is not that of its energy is seen.
        let wrong: Vec<f64> = found.iter().map(|f| f * 1.01).collect();
        prop_assert!(deviation(&wrong, &expected) > 1e-3);
    }

    #[test]
    fn the_tangent_is_the_derivative_of_the_forces_where_the_stress_is_tensile(
        seed in 1_u64..u64::MAX
    ) {
        let mut random = Random(seed);
        let fabric = fabric(&mut random);
        let fabric = Fabric { coupling: fabric.coupling.abs(), ..fabric };
        let law = Law::new(&fabric, "it").unwrap();
        let rest = rest(&mut random);
        let turn = random.rotation();
        // Stretched along both threads, with a shear too small to press.
        let stretch = |random: &mut Random| 1.02 + 0.2 * random.signed().abs();
        let f_u = glam::DVec3::new(stretch(&mut random), 0.0, 0.0);
        let f_v = glam::DVec3::new(1e-3 * random.signed(), stretch(&mut random), 0.0);
        let corners = placed(&rest, [(turn * f_u).into(), (turn * f_v).into()]);
        let response = law.response(membrane::strain([f_u.into(), f_v.into()]));
        let [a, b, c] = response.stress;
        prop_assume!(a * b > c * c && a > 0.0);
        let expected = jacobian(&law, &rest, corners).concat();
        let found = matrix(&tangent(&law, &rest, corners)).concat();
        prop_assert!(deviation(&found, &expected) < 1e-5, "{}", deviation(&found, &expected));
    }

    #[test]
    fn what_moves_as_a_whole_feels_nothing_and_no_triangle_pushes_itself(
        seed in 1_u64..u64::MAX
    ) {
        let mut random = Random(seed);
        let law = Law::new(&fabric(&mut random), "it").unwrap();
        let rest = rest(&mut random);
        let moved = placed(&rest, gradient(&mut random, 0.0));
        let bound = 1e-12 * rest.area * 2000.0 * rest.inverse.concat().iter().fold(0.0, |s: f64, x| s.max(x.abs()));
        prop_assert!(forces(&law, &rest, moved).concat().iter().all(|f| f.abs() < bound));
        let corners = placed(&rest, gradient(&mut random, 0.4));
        let forces = forces(&law, &rest, corners);
        let scale = forces.concat().iter().fold(0.0, |s: f64, f| s.max(f.abs()));
        let sum = forces.map(glam::DVec3::from).iter().sum::<glam::DVec3>();
        prop_assert!(sum.length() < 1e-14 * scale);
        let torque = (0..3).map(|a| glam::DVec3::from(cross(corners[a], forces[a]))).sum::<glam::DVec3>();
        prop_assert!(torque.length() < 1e-13 * scale, "{torque} {scale}");
    }
}

#[test]
fn ten_thousand_tangents_have_no_negative_eigenvalue() {
    let mut random = Random(7);
    let mut pressed = 0;
    for _ in 0..10_000 {
        let law = Law::new(&fabric(&mut random), "it").unwrap();
        let rest = rest(&mut random);
        let corners = placed(&rest, gradient(&mut random, 0.6));
        let tangent = tangent(&law, &rest, corners);
        let values = eigenvalues(matrix(&tangent));
        let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(values.iter().all(|&v| v >= -1e-13 * largest), "{values:?}");
        // The same with all of the stress is indefinite for pressed triangles: the projection does something.
        let gradient = membrane::deformation(corners, &rest);
        let stress = law.response(membrane::strain(gradient)).stress.map(|s| rest.area * s);
        let whole = eigenvalues(matrix(&Tangent { stress, ..tangent }));
        pressed += usize::from(whole.iter().any(|&v| v < -1e-6 * largest));
    }
    assert!(pressed > 2000, "only {pressed} triangles were pressed");
}

#[test]
fn the_tensile_part_is_the_nearest_matrix_without_negative_eigenvalues() {
    let mut random = Random(11);
    for _ in 0..1000 {
        let [a, b, c] = random.vector();
        let [p, q, r] = membrane::tensile_part([a, b, c]);
        let values = |[a, b, c]: [f64; 3]| {
            let mut values = eigenvalues([[a, c], [c, b]]);
            values.sort_by(f64::total_cmp);
            values
        };
        let expected = values([a, b, c]).map(|v| v.max(0.0));
        for (found, expected) in values([p, q, r]).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-14);
        }
    }
    assert_eq!(membrane::tensile_part([1.0, 1.0, 0.0]), [1.0, 1.0, 0.0]);
    assert_eq!(membrane::tensile_part([-1.0, -1.0, 0.0]), [0.0; 3]);
    assert_eq!(membrane::tensile_part([0.0; 3]), [0.0; 3]);
}

/// Constant strain gives the same stress in every triangle of every mesh, and no force inside.
#[test]
fn a_patch_keeps_a_uniform_strain() {
    let mut random = Random(3);
    for mesh in Mesh::ALL {
        let sheet = sheet(mesh, [7, 6], 0.01, false);
        let law = Law::new(&fabric(&mut random), "it").unwrap();
        let [f_u, f_v] = gradient(&mut random, 0.2);
        let place = |[u, v]: [f64; 2]| std::array::from_fn(|k| u * f_u[k] + v * f_v[k]);
        let expected = law.response(membrane::strain([f_u, f_v]));
        let mut total = vec![[0.0; 3]; sheet.places.len()];
        let mut energy = 0.0;
        for (triangle, corners) in sheet.triangles.iter().zip(&sheet.corners) {
            let rest = membrane::rest_state(*corners).unwrap();
            let gradient = membrane::deformation(corners.map(place), &rest);
            let response = law.response(membrane::strain(gradient));
            assert!(deviation(&response.stress, &expected.stress) < 1e-12, "{mesh:?}");
            energy += rest.area * response.energy;
            let forces = membrane::forces(gradient, response.stress, &rest);
            for (vertex, force) in triangle.iter().zip(forces) {
                (0..3).for_each(|k| total[*vertex as usize][k] += force[k]);
            }
        }
        let area = 0.07 * 0.06;
        assert!((energy / (area * expected.energy) - 1.0).abs() < 1e-12, "{mesh:?}");
        let largest = total.concat().iter().fold(0.0_f64, |m, f| m.max(f.abs()));
        for row in 1..6 {
            for column in 1..7 {
                let force = total[row * 8 + column];
                assert!(force.iter().all(|f| f.abs() < 1e-12 * largest), "{mesh:?} {force:?}");
            }
        }
    }
}

#[test]
fn single_precision_agrees_but_for_rounding() {
    let mut random = Random(5);
    for _ in 0..1000 {
        let fabric = fabric(&mut random);
        let law = Law::new(&fabric, "it").unwrap();
        let single = Law::<f32>::new(&fabric, "it").unwrap();
        let rest = self::rest(&mut random);
        let corners = placed(&rest, gradient(&mut random, 0.3));
        let expected = forces(&law, &rest, corners).concat();
        let (corners, rest) = (corners.map(|x| x.map(|x| x as f32)), rest.rounded::<f32>());
        let gradient = membrane::deformation(corners, &rest);
        let response = single.response(membrane::strain(gradient));
        let found = membrane::forces(gradient, response.stress, &rest).concat();
        let found: Vec<f64> = found.into_iter().map(f64::from).collect();
        // Positions of 0.3 m have 3e-8 m in single precision, and edges here some 0.01 m: 3e-6 of strain.
        let scale = expected.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
        assert!(deviation(&found, &expected) < 1e-2 || scale < 1e-2, "{found:?} {expected:?}");
    }
}

#[test]
fn principal_stretches_are_those_of_the_deformation() {
    let [f_u, f_v] = [[1.3, 0.0, 0.0], [0.0, 0.0, 0.9]];
    let found = membrane::principal_stretches(membrane::strain([f_u, f_v]));
    assert!(deviation(&found, &[1.3, 0.9]) < 1e-15);
    // A simple shear by g: s1 s2 = 1, s1^2 + s2^2 = 2 + g^2.
    let sheared = [[1.0_f64, 0.0, 0.0], [0.5, 1.0, 0.0]];
    let [a, b] = membrane::principal_stretches(membrane::strain(sheared));
    assert!((a * b - 1.0).abs() < 1e-15 && (a * a + b * b - 2.25).abs() < 1e-15);
}

#[test]
fn shear_is_measured_as_an_angle() {
    // Force per width over angle is G: S12 = 2 G E12 = G gamma for small gamma, and the energy G gamma^2 / 2.
    let mut random = Random(9);
    let fabric = fabric(&mut random);
    let law = Law::new(&fabric, "it").unwrap();
    let gamma = 1e-6_f64;
    let response =
        law.response(membrane::strain([[1.0, 0.0, 0.0], [gamma.sin(), gamma.cos(), 0.0]]));
    assert!((response.stress[2] / (fabric.shear * gamma) - 1.0).abs() < 1e-9);
    assert!((response.energy / (0.5 * fabric.shear * gamma * gamma) - 1.0).abs() < 1e-4);
}

#[test]
fn threads_jam_before_the_largest_stretch() {
    let mut random = Random(5);
    let free = Fabric { stretch_limit: f64::INFINITY, ..fabric(&mut random) };
    let limited = Fabric { stretch_limit: 1.1, ..free };
    let [law, without] = [limited, free].map(|fabric| Law::new(&fabric, "it").unwrap());
    let largest: f64 = 0.5 * (1.1 * 1.1 - 1.0);
    let steepest = 0.25 * (0.32 / largest).powi(2) * free.warp.steepest().max(free.weft.steepest());
    for (k, sign) in [(0, 1.0), (1, 1.0), (2, 1.0), (2, -1.0)] {
        let at = |e: f64| std::array::from_fn(|i| if i == k { sign * e } else { 0.0 });
        let more =
            |e: f64| sign * (law.response(at(e)).stress[k] - without.response(at(e)).stress[k]);
        assert_eq!(more(0.74 * largest), 0.0);
        // A straight line beyond the limit, as steep as the end of the curve.
        let slope = (more(3.0 * largest) - more(2.0 * largest)) / largest;
        let before = (more(largest) - more(largest - 1e-7)) / 1e-7;
        assert!((before / slope - 1.0).abs() < 1e-4, "{k}: {before} {slope}");
        assert!((slope / steepest - 1.0).abs() < 1e-9, "{k}: {slope} {steepest}");
    }
    // Compressed threads do not jam.
    let compressed = [-0.3, -0.3, 0.0];
    assert_eq!(law.response(compressed).stress, without.response(compressed).stress);
    // Where a fabric was measured farther than woven cloth shears, threads jam behind that.
    let curve = TensileCurve { linear: 20.0, cubic: 100.0, end: 0.6 };
    let knit = Fabric { warp: curve, ..free }.with_usual_stretch_limit();
    assert!((knit.locking().onset - 0.6).abs() < 1e-12, "{}", knit.stretch_limit);
    let straight = TensileCurve::linear(100.0);
    let woven = Fabric { warp: straight, weft: straight, ..free }.with_usual_stretch_limit();
    assert!((woven.stretch_limit - 1.28).abs() < 1e-2, "{}", woven.stretch_limit);
}

#[test]
fn viscous_stress_is_the_tangent_times_the_rate() {
    let mut random = Random(13);
    let law = Law::new(&fabric(&mut random), "it").unwrap();
    let [strain, rate] = [random.vector().map(|e| 0.1 * e), random.vector()];
    let step = 1e-7;
    let at = |sign: f64| law.response(std::array::from_fn(|k| strain[k] + sign * step * rate[k]));
    let [after, before] = [at(1.0).stress, at(-1.0).stress];
    let expected: [f64; 3] = std::array::from_fn(|k| 0.2 * (after[k] - before[k]) / (2.0 * step));
    let found = law.viscous_stress(&law.response(strain), rate, 0.2);
    assert!(deviation(&found, &expected) < 1e-6, "{found:?} {expected:?}");
    // The rate of strain is the derivative of the strain.
    let [f, g] = [gradient(&mut random, 0.2), [random.vector(), random.vector()]];
    let moved = |sign: f64| {
        let at = |k: usize| std::array::from_fn(|i| f[k][i] + sign * step * g[k][i]);
        membrane::strain([at(0), at(1)])
    };
    let [after, before] = [moved(1.0), moved(-1.0)];
    let expected: [f64; 3] = std::array::from_fn(|k| (after[k] - before[k]) / (2.0 * step));
    assert!(deviation(&membrane::strain_rate(f, g), &expected) < 1e-6);
}
