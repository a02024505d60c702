use proptest::prelude::*;

use super::{
    super::{
        BendingRigidity, FOLDS, RestHinge, RestShape, RestTriangle,
        hinge::{difference_of_angles, energy_and_moment, fold},
        vector::{Vector, cross},
    },
    Random, deviation,
    meshes::{Mesh, Sheet, sheet},
};
use crate::NONE;

const ORTHOTROPIC: BendingRigidity = BendingRigidity { warp: 2e-5, weft: 6e-6, bias: Some(8e-6) };

/// A hinge whose triangles are not needles.
fn vertices(random: &mut Random) -> [Vector<f64>; 4] {
    loop {
        let x = [random.vector(), random.vector(), random.vector(), random.vector()];
        let [a, b, c, d] = x.map(glam::DVec3::from);
        let areas = [(b - a).cross(c - a).length(), (b - a).cross(d - a).length()];
        let angle = fold(x).angle;
        if areas.iter().all(|&area| area > 0.2) && angle.abs() < 3.0 {
            return x.map(|x| x.map(|x| 0.01 * x));
        }
    }
}

proptest! {
    #[test]
    fn the_gradient_of_a_fold_is_its_derivative(seed in 1_u64..u64::MAX) {
        let x = vertices(&mut Random(seed));
        let step = 1e-8;
        let mut expected = [0.0; 12];
        for (j, expected) in expected.iter_mut().enumerate() {
            let at = |sign: f64| {
                let mut moved = x;
                moved[j / 3][j % 3] += sign * step;
                fold(moved).angle
            };
            *expected = (at(1.0) - at(-1.0)) / (2.0 * step);
        }
        let fold = fold(x);
        let found = fold.gradient.concat();
        prop_assert!(deviation(&found, &expected) < 1e-6, "{}", deviation(&found, &expected));
        // Nothing pushes or turns itself.
        let scale = found.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
        for k in 0..3 {
            prop_assert!((0..4).map(|a| fold.gradient[a][k]).sum::<f64>().abs() < 1e-13 * scale);
        }
        let torque = (0..4)
            .map(|a| glam::DVec3::from(cross(x[a], fold.gradient[a])))
            .sum::<glam::DVec3>();
        prop_assert!(torque.length() < 1e-13 * scale * 0.02, "{torque}");
        // The block is the product of gradients: one eigenvalue, not negative.
        let block = fold.block(2.0, 1, 3);
        prop_assert!((block[0][2] - 2.0 * fold.gradient[1][0] * fold.gradient[3][2]).abs() < 1e-9 * scale * scale);
    }

    #[test]
    fn a_fold_does_not_feel_how_it_lies_in_space(seed in 1_u64..u64::MAX) {
        let mut random = Random(seed);
        let x = vertices(&mut random);
        let [turn, shift] = [random.rotation(), glam::DMat3::from_diagonal(random.vector().into())];
        let moved = x.map(|x| (turn * glam::DVec3::from(x) + shift * glam::DVec3::ONE).into());
        prop_assert!((fold(moved).angle - fold(x).angle).abs() < 1e-11);
        // From the other end of the edge it is the same fold; mirrored, the opposite one.
        let [a, b, c, d] = x;
        prop_assert!((fold([b, a, d, c]).angle - fold(x).angle).abs() < 1e-13);
        let mirrored = x.map(|[x, y, z]| [x, y, -z]);
        prop_assert!((fold(mirrored).angle + fold(x).angle).abs() < 1e-13);
    }
}

#[test]
fn folds_are_the_angles_between_normals() {
    for degrees in [-179, -120, -90, -30, -1, 0, 1, 45, 90, 135, 179] {
        let angle = f64::from(degrees).to_radians();
        let x = [
            [0.0, 0.0, 0.0],
            [0.01, 0.0, 0.0],
            [0.002, 0.013, 0.0],
            [0.004, -0.007 * angle.cos(), 0.007 * angle.sin()],
        ];
        let found = fold(x).angle;
        assert!((found - angle).abs() < 1e-14, "{degrees}: {found}");
        let single = f64::from(fold(x.map(|x| x.map(|x| x as f32))).angle);
        assert!((single - angle).abs() < 1e-6, "{degrees}: {single}");
    }
    assert!((difference_of_angles(3.0_f64, -3.0) + 0.283_185_307).abs() < 1e-8);
    assert_eq!(difference_of_angles(0.5, 0.25), 0.25);
    assert_eq!(energy_and_moment(4.0, 0.5), [0.5, 2.0]);
    // No triangle, no fold; and nothing that is not a number.
    let nothing = fold([[0.0_f32; 3]; 4]);
    assert_eq!((nothing.angle, nothing.gradient), (0.0, [[0.0; 3]; 4]));
}

fn folds(shape: &RestShape, positions: &[[f64; 3]]) -> Vec<f64> {
    let angle = |rest: &super::super::RestHinge| {
        let fold = fold(rest.vertices.map(|vertex| positions[vertex as usize]));
        difference_of_angles(fold.angle, rest.angle)
    };
    shape.hinges.iter().map(angle).collect()
}

fn triangle_folds(folds: &[f64], hinges: [u32; FOLDS]) -> [f64; FOLDS] {
    hinges.map(|h| if h == NONE { 0.0 } else { folds[h as usize] })
}

/// Whether a triangle and the three around it have all their neighbours. (A fold may also be none because it says nothing of a triangle.)
fn has_neighbours(shape: &RestShape, triangle: &RestTriangle) -> bool {
    let is_whole = |triangle: &RestTriangle| !triangle.hinges.contains(&NONE);
    let hinges = triangle.hinges.iter().filter_map(|&h| shape.hinges.get(h as usize));
    let mut beside = hinges.flat_map(|hinge| hinge.triangles);
    let is_there = |t: u32| shape.triangles.get(t as usize).is_some_and(is_whole);
    is_whole(triangle) && beside.all(is_there)
}

/// Energy of the triangles with all folds over their area at rest \[J/m^2\].
fn inner_energy(shape: &RestShape, positions: &[[f64; 3]]) -> f64 {
    let folds = folds(shape, positions);
    let [mut energy, mut area] = [0.0; 2];
    for triangle in shape.triangles.iter().filter(|triangle| has_neighbours(shape, triangle)) {
        energy += triangle.bending.energy(triangle_folds(&folds, triangle.folds));
        area += triangle.state.area;
    }
    energy / area
}

/// The same of hinges on their own, in the whole of a shape.
fn lone_energy(shape: &RestShape, positions: &[[f64; 3]]) -> f64 {
    let folds = folds(shape, positions);
    let energy: f64 =
        shape.hinges.iter().zip(folds).map(|(h, f)| energy_and_moment(h.stiffness, f)[0]).sum();
    energy / shape.triangles.iter().map(|triangle| triangle.state.area).sum::<f64>()
}

/// A constant curvature has the energy of the plate on every mesh: the patch test of bending.
#[test]
fn a_plate_of_constant_curvature_has_its_energy_on_every_mesh() {
    let plate = ORTHOTROPIC.plate();
    for mesh in Mesh::ALL {
        for [k11, k22, k12] in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.7, -0.4, 0.5]]
        {
            let sheet = sheet(mesh, [9, 8], 0.01, false);
            // So flat that a fold is the difference of slopes.
            let scale = 1e-4;
            let height = |[u, v]: [f64; 2]| {
                [u, v, scale * (0.5 * k11 * u * u + 0.5 * k22 * v * v + k12 * u * v)]
            };
            let positions = sheet.mesh(height).positions;
            let shape = RestShape::from_pattern(
                &sheet.mesh(|[u, v]| [u, v, 0.0]),
                &sheet.pattern(0.0),
                &ORTHOTROPIC,
                "it",
            )
            .unwrap();
            assert_eq!(shape.warnings, [], "{mesh:?}");
            let expected = 0.5
                * scale
                * scale
                * (plate.warp * k11 * k11
                    + plate.weft * k22 * k22
                    + 2.0 * plate.coupling * k11 * k22
                    + 4.0 * plate.twist * k12 * k12);
            let found = inner_energy(&shape, &positions);
            assert!((found / expected - 1.0).abs() < 1e-6, "{mesh:?}: {}", found / expected);
        }
    }
}

/// Deviation of the energy of a tube from that of the plate bent to its radius; the circles make `angle` with the warp.
fn tube(mesh: Mesh, cells: u32, angle: f64, bending: &BendingRigidity) -> [f64; 2] {
    let radius = 0.1;
    let spacing = 2.0 * std::f64::consts::PI * radius / f64::from(cells);
    let sheet: Sheet = sheet(mesh, [cells, cells / 2], spacing, true);
    let rolled = |[s, t]: [f64; 2]| {
        let (sine, cosine) = (s / radius).sin_cos();
        [radius * cosine, radius * sine, t]
    };
    let tube = sheet.mesh(rolled);
    let shape = RestShape::from_pattern(&tube, &sheet.pattern(angle), bending, "tube").unwrap();
    let (s, c) = angle.sin_cos();
    let expected = 0.5 * bending.plate().cylinder([c, s]) / (radius * radius);
    [
        inner_energy(&shape, &tube.positions) / expected - 1.0,
        lone_energy(&shape, &tube.positions) / expected - 1.0,
    ]
}

#[test]
fn a_tube_has_the_energy_of_its_radius_whatever_the_mesh() {
    for mesh in Mesh::ALL {
        for degrees in [0.0_f64, 30.0, 45.0, 90.0, 135.0] {
            let error = |cells| tube(mesh, cells, degrees.to_radians(), &ORTHOTROPIC)[0];
            let [coarse, middle, fine] = [24, 48, 96].map(error);
            assert!(
                coarse.abs() < 0.05 && fine.abs() < 4e-3,
                "{mesh:?} {degrees}: {coarse} {fine}"
            );
            // Second order: a quarter for half the spacing. Irregular meshes are not each other's refinement.
            let order = (coarse / fine).abs().log2() / 2.0;
            let least = if mesh == Mesh::Irregular { 1.5 } else { 1.8 };
            // Where circles run along a regular grid the energy is exact.
            assert!(
                order > least || coarse.abs() < 1e-9,
                "{mesh:?} {degrees}: {coarse} {middle} {fine}"
            );
        }
    }
}

/// Energy of lone hinges of a flat grid with one diagonal per cell, bent a little along a direction, over that of the plate.
fn diagonal_tube_ratio(degrees: f64, bending: &BendingRigidity) -> f64 {
    let sheet = sheet(Mesh::OneWay, [60, 60], 0.01, false);
    let (s, c) = degrees.to_radians().sin_cos();
    let flat = sheet.mesh(|[u, v]| [u, v, 0.0]);
    let shape = RestShape::from_pattern(&flat, &sheet.pattern(0.0), bending, "it").unwrap();
    let curvature = 1e-3;
    let bent = sheet.mesh(|[u, v]| [u, v, 0.5 * curvature * (c * u + s * v).powi(2)]);
    lone_energy(&shape, &bent.positions) / (0.5 * bending.warp * curvature * curvature)
}

/// What hinges on their own give depends on the mesh, which is why triangles couple theirs: the test above sees that.
#[test]
fn hinges_on_their_own_are_wrong_by_what_the_mesh_is() {
    let isotropic = BendingRigidity::isotropic(1e-5);
    let error = |mesh, degrees: f64| tube(mesh, 96, degrees.to_radians(), &isotropic)[1];
    // Circles along an axis of the grid fold one family of edges alone, and these are right.
    assert!(error(Mesh::OneWay, 0.0).abs() < 0.02);
    // On a grid with one diagonal per cell, circles across the diagonals or along them have three times the energy, or what is right.
    let [along, across] = [45.0, 135.0].map(|degrees| diagonal_tube_ratio(degrees, &isotropic));
    assert!((along.max(across) - 3.0).abs() < 0.05, "{along} {across}");
    assert!((along.min(across) - 1.0).abs() < 0.05, "{along} {across}");
    assert!(error(Mesh::Irregular, 0.0) > 0.1, "{}", error(Mesh::Irregular, 0.0));
}

#[test]
fn moments_are_the_derivative_of_the_energy_of_all_triangles() {
    let sheet = sheet(Mesh::Irregular, [4, 4], 0.01, false);
    let flat = sheet.mesh(|[u, v]| [u, v, 0.0]);
    let shape = RestShape::from_pattern(&flat, &sheet.pattern(0.3), &ORTHOTROPIC, "it").unwrap();
    let mut random = Random(17);
    let mut positions = flat.positions;
    positions.iter_mut().flatten().for_each(|x| *x += 1e-3 * random.signed());
    let energy = |positions: &[[f64; 3]]| -> f64 {
        let folds = folds(&shape, positions);
        let of = |t: &super::super::RestTriangle| t.bending.energy(triangle_folds(&folds, t.folds));
        shape.triangles.iter().map(of).sum()
    };
    let angles = folds(&shape, &positions);
    let mut moments = vec![0.0; shape.hinges.len()];
    for triangle in &shape.triangles {
        let own = triangle.bending.moments(triangle_folds(&angles, triangle.folds));
        for (hinge, moment) in triangle.folds.into_iter().zip(own) {
            if hinge != NONE {
                moments[hinge as usize] += moment;
            }
        }
    }
    let mut forces = vec![[0.0; 3]; positions.len()];
    for (hinge, moment) in shape.hinges.iter().zip(moments) {
        let fold = fold(hinge.vertices.map(|vertex| positions[vertex as usize]));
        for (vertex, force) in hinge.vertices.into_iter().zip(fold.forces(moment)) {
            (0..3).for_each(|k| forces[vertex as usize][k] += force[k]);
        }
    }
    let mut expected = vec![[0.0; 3]; positions.len()];
    for (vertex, expected) in expected.iter_mut().enumerate() {
        for (k, expected) in expected.iter_mut().enumerate() {
            let at = |sign: f64| {
                let mut moved = positions.clone();
                moved[vertex][k] += sign * 1e-8;
                energy(&moved)
            };
            *expected = -(at(1.0) - at(-1.0)) / 2e-8;
        }
    }
    assert!(deviation(&forces.concat(), &expected.concat()) < 1e-6);
}

/// Needles and nearly conic neighbourhoods: the stiffness is bounded, positive, and said to be.
#[test]
fn stiffness_stays_bounded_on_bad_meshes() {
    let mut sheet = sheet(Mesh::OneWay, [12, 12], 0.01, false);
    let mut random = Random(23);
    let moved: Vec<[f64; 2]> = sheet
        .places
        .iter()
        .map(|&[u, v]| [u + 0.0045 * random.signed(), v + 0.0045 * random.signed()])
        .collect();
    sheet.corners = sheet.triangles.iter().map(|t| t.map(|v| moved[v as usize])).collect();
    sheet.places = moved;
    let flat = sheet.mesh(|[u, v]| [u, v, 0.0]);
    let shape = RestShape::from_pattern(&flat, &sheet.pattern(0.0), &ORTHOTROPIC, "it").unwrap();
    for triangle in &shape.triangles {
        let own = triangle.folds.into_iter().filter(|&h| h != NONE);
        let stiffest = own.map(|h| shape.hinges[h as usize].stiffness).fold(0.0, f64::max);
        for fold in 0..FOLDS {
            let mut folds = [0.0; FOLDS];
            folds[fold] = 1.0;
            let energy = triangle.bending.energy(folds);
            assert!((0.0..=100.0 * stiffest).contains(&energy), "{energy} {stiffest}");
        }
    }
}

/// What a constant moment does to a plate within is nothing: without that a cloth bends along the lines of its mesh.
#[test]
fn a_plate_of_constant_curvature_is_in_equilibrium_on_every_mesh() {
    for mesh in Mesh::ALL {
        let sheet = sheet(mesh, [12, 11], 0.01, false);
        let flat = sheet.mesh(|[u, v]| [u, v, 0.0]);
        let shape =
            RestShape::from_pattern(&flat, &sheet.pattern(0.0), &ORTHOTROPIC, "it").unwrap();
        let scale = 1e-4;
        let bent = sheet.mesh(|[u, v]| [u, v, scale * (0.4 * u * u - 0.3 * v * v + 0.5 * u * v)]);
        let folds = folds(&shape, &bent.positions);
        let [mut sum, mut size] = [0, 1].map(|_| vec![0.0_f64; bent.positions.len()]);
        let mut is_inside = vec![true; bent.positions.len()];
        for triangle in &shape.triangles {
            let moments = triangle.bending.moments(triangle_folds(&folds, triangle.folds));
            for (hinge, moment) in triangle.folds.into_iter().zip(moments) {
                let Some(hinge) = shape.hinges.get(hinge as usize) else { continue };
                let fold = fold(hinge.vertices.map(|v| bent.positions[v as usize]));
                for (vertex, force) in hinge.vertices.into_iter().zip(fold.forces(moment)) {
                    sum[vertex as usize] += force[2];
                    size[vertex as usize] += force[2].abs();
                }
            }
            if !has_neighbours(&shape, triangle) {
                triangle.patch.iter().for_each(|&vertex| is_inside[vertex as usize] = false);
            }
        }
        let inside = || (0..sum.len()).filter(|&vertex| is_inside[vertex]);
        assert!(inside().count() > 4, "{mesh:?}");
        for vertex in inside() {
            let ratio = sum[vertex].abs() / size[vertex];
            assert!(ratio < 1e-5, "{mesh:?} {vertex}: {ratio}");
        }
    }
}

/// Two quadratic forms of heights: their halves are the energies of bending, and of folds as they stand in the matrix.
fn forms(shape: &RestShape, heights: &[f64]) -> [Vec<f64>; 2] {
    let weights: Vec<_> = shape.hinges.iter().map(|hinge| shape.hinge_weights(hinge)).collect();
    let fold = |(hinge, weights): (&RestHinge, &[f64; 4])| -> f64 {
        let at = hinge.vertices.iter().zip(weights);
        at.map(|(&vertex, weight)| weight * heights[vertex as usize]).sum()
    };
    let folds: Vec<_> = shape.hinges.iter().zip(&weights).map(fold).collect();
    let mut moments = vec![0.0; folds.len()];
    for triangle in &shape.triangles {
        let own = triangle.bending.moments(triangle_folds(&folds, triangle.folds));
        for (&fold, moment) in triangle.folds.iter().zip(own) {
            if let Some(sum) = moments.get_mut(fold as usize) {
                *sum += moment;
            }
        }
    }
    let alone = shape.matrix_stiffness(|_| 0.0).into_iter().zip(&folds);
    let alone = alone.map(|([stiffness, _], fold)| stiffness * fold).collect();
    [moments, alone].map(|moments| {
        let mut gradient = vec![0.0; heights.len()];
        for ((hinge, weights), moment) in shape.hinges.iter().zip(&weights).zip(moments) {
            for (&vertex, weight) in hinge.vertices.iter().zip(weights) {
                gradient[vertex as usize] += weight * moment;
            }
        }
        gradient
    })
}

/// The largest quotient of both forms, by steps along its gradient, each to the largest one in the plane of both.
fn largest_quotient(shape: &RestShape, count: usize) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut random = Random(0x0123_4567_89ab_cdef);
    let mut x: Vec<_> = (0..count).map(|_| random.signed()).collect();
    let mut quotient = 0.0;
    for _ in 0..400 {
        let [of_bending, of_folds] = forms(shape, &x);
        quotient = dot(&x, &of_bending) / dot(&x, &of_folds);
        let along = of_bending.iter().zip(&of_folds).map(|(a, b)| a - quotient * b);
        let mut along: Vec<_> = along.collect();
        let scale = (dot(&x, &x) / dot(&along, &along)).sqrt();
        along.iter_mut().for_each(|a| *a *= scale);
        let [bending_along, folds_along] = forms(shape, &along);
        let pairs = [(&x, &of_bending, &of_folds), (&along, &bending_along, &folds_along)];
        let [a, b] = [0, 1].map(|which| {
            let form = |k: usize| if which == 0 { pairs[k].1 } else { pairs[k].2 };
            [dot(&x, form(0)), dot(&along, form(0)), dot(&along, form(1))]
        });
        // det(A - q B) = 0, the larger q, and its vector.
        let square = b[0] * b[2] - b[1] * b[1];
        let linear = a[0] * b[2] + a[2] * b[0] - 2.0 * a[1] * b[1];
        let constant = a[0] * a[2] - a[1] * a[1];
        let root = (linear * linear - 4.0 * square * constant).max(0.0).sqrt();
        let best = (linear + root) / (2.0 * square);
        let share = -(a[0] - best * b[0]) / (a[1] - best * b[1]);
        if !share.is_finite() {
            break;
        }
        x.iter_mut().zip(&along).for_each(|(x, along)| *x += share * along);
    }
    quotient
}

/// An implicit step whose matrix has less than half of the stiffness of a motion makes it larger.
#[test]
fn folds_in_the_matrix_have_enough_of_the_stiffness_of_bending() {
    let soft_in_twist = BendingRigidity { warp: 1e-5, weft: 1e-5, bias: Some(3e-6) };
    let stiff_in_twist = BendingRigidity { warp: 1e-5, weft: 4e-6, bias: Some(9e-6) };
    let mut all = Vec::new();
    for mesh in Mesh::ALL {
        let sheet = sheet(mesh, [9, 8], 0.01, false);
        let flat = sheet.mesh(|[u, v]| [u, v, 0.0]);
        for bending in [ORTHOTROPIC, soft_in_twist, stiff_in_twist] {
            let shape =
                RestShape::from_pattern(&flat, &sheet.pattern(0.3), &bending, "it").unwrap();
            let most = largest_quotient(&shape, flat.positions.len());
            assert!(most < 1.667, "{mesh:?} {bending:?}: {most}");
            all.push(most);
        }
    }
    let most = all.iter().fold(0.0_f64, |most, all| most.max(*all));
    assert!(most > 1.3, "the steps do not find the largest: {all:?}");
}
