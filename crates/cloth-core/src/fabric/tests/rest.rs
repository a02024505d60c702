use super::{
    super::{BendingRigidity, FabricError, RestShape, RestWarning},
    deviation,
    meshes::{Mesh, sheet},
};
use crate::{ModelError, NONE, TextureMap, TriangleMesh};

const BENDING: BendingRigidity = BendingRigidity { warp: 2e-5, weft: 6e-6, bias: None };

fn square(uv: [[f64; 2]; 4]) -> (TriangleMesh, TextureMap) {
    let mesh = TriangleMesh {
        positions: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.1, 0.1, 0.0], [0.0, 0.1, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    };
    let pattern = TextureMap { coordinates: uv.to_vec(), triangles: mesh.triangles.clone() };
    (mesh, pattern)
}

const FLAT: [[f64; 2]; 4] = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]];

#[test]
fn a_pattern_and_the_same_shape_in_space_are_one() {
    let sheet = sheet(Mesh::Irregular, [5, 4], 0.02, false);
    let mesh = sheet.mesh(|[u, v]| [v, 3.0, u]);
    let pattern = RestShape::from_pattern(&mesh, &sheet.pattern(0.0), &BENDING, "it").unwrap();
    let space = RestShape::from_mesh(&mesh, Some([0.0, 0.0, 2.0]), &BENDING, "it").unwrap();
    let numbers = |shape: &RestShape| -> Vec<f64> {
        let of = |t: &super::super::RestTriangle| {
            // The weft may point either way, as it does when the cloth is seen from behind.
            let [[a, b], [c, d]] = t.state.inverse;
            [
                vec![t.state.area, a, b.abs(), c, d.abs()],
                t.bending.map.iter().flatten().map(|k| k.abs()).collect(),
            ]
            .concat()
        };
        shape.triangles.iter().flat_map(of).collect()
    };
    assert!(deviation(&numbers(&pattern), &numbers(&space)) < 1e-12);
    let masses = pattern.masses(|_| 0.25, 30);
    assert!((masses.iter().sum::<f64>() / (0.25 * 0.1 * 0.08) - 1.0).abs() < 1e-12);
    assert_eq!(pattern.hinges.len(), 5 * 4 + 4 * 4 + 5 * 3);
    assert!(space.hinges.iter().all(|hinge| hinge.angle.abs() < 1e-12));
    let borders = pattern.triangles.iter().flat_map(|t| t.hinges).filter(|&h| h == NONE).count();
    assert_eq!(borders, 18);
}

#[test]
fn a_shape_in_space_keeps_its_folds() {
    let (mut mesh, _) = square(FLAT);
    mesh.positions[3][2] = 0.05;
    let shape = RestShape::from_mesh(&mesh, Some([1.0, 0.0, 0.0]), &BENDING, "it").unwrap();
    assert!(shape.hinges[0].angle.abs() > 0.1);
    let upright = RestShape::from_mesh(&square(FLAT).0, Some([0.0, 0.0, 1.0]), &BENDING, "it");
    assert_eq!(upright, Err(FabricError::WarpUpright { cloth: "it".into(), triangle: 0 }));
}

/// A box has faces across all axes: each has a warp, the same one all over, in any place where it begins to tilt.
#[test]
fn a_closed_mesh_needs_no_direction_of_the_warp() {
    let (mesh, _) = square(FLAT);
    for (turn, expected) in [(0.0, 0), (0.4, 0), (1.2, 1), (1.5, 1)] {
        let (sin, cos) = f64::sin_cos(turn);
        // Beside it a far vertex makes z the longest axis, y the next one.
        let mut mesh = mesh.clone();
        mesh.positions.iter_mut().for_each(|x| *x = [x[1] * sin, x[0], x[1] * cos]);
        mesh.positions.push([0.0, 0.3, 2.0]);
        mesh.positions.push([0.01, 0.3, 2.0]);
        mesh.positions.push([0.0, 0.4, 2.0]);
        mesh.triangles.push([4, 5, 6]);
        let shape = RestShape::from_mesh(&mesh, None, &BENDING, "it").unwrap();
        // Along u, vertex 1 is .1 from vertex 0 if the warp runs along y, and at the same place if it runs up.
        let [[a, _], [c, _]] = shape.triangles[0].state.inverse;
        let along_y = usize::from(c.abs() < 1e-9 && (a.abs() - 10.0).abs() < 1e-6);
        assert_eq!(along_y, expected, "turned by {turn}: {a} {c}");
    }
}

#[test]
fn folds_at_rest_are_off_by_as_much_as_is_asked_for() {
    let sheet = sheet(Mesh::Irregular, [9, 8], 0.02, false);
    let mesh = sheet.mesh(|[u, v]| [u, v, 0.0]);
    let flat = RestShape::from_pattern(&mesh, &sheet.pattern(0.0), &BENDING, "it").unwrap();
    let mut shape = flat.clone();
    shape.imperfection_add(1e-3);
    let angles = || shape.hinges.iter().map(|hinge| hinge.angle);
    let most = angles().map(f64::abs).fold(0.0, f64::max);
    assert!(most > 0.9e-3 && most <= 1e-3, "{most}");
    let mean = angles().sum::<f64>() / shape.hinges.len() as f64;
    assert!(mean.abs() < 1.5e-4, "{mean}");
    shape.hinges.iter_mut().for_each(|hinge| hinge.angle = 0.0);
    assert_eq!(shape, flat);
}

#[test]
fn bad_patterns_are_named() {
    let build = |uv| {
        let (mesh, pattern) = square(uv);
        RestShape::from_pattern(&mesh, &pattern, &BENDING, "it")
    };
    assert_eq!(build(FLAT).unwrap().warnings, []);
    // Vertex 3 on the same side of the diagonal as vertex 1.
    let flipped = build([FLAT[0], FLAT[1], FLAT[2], [0.09, 0.02]]).unwrap_err();
    assert!(matches!(flipped, FabricError::PatternFlipped { .. }), "{flipped}");
    let flat = build([FLAT[0], FLAT[1], [0.2, 0.0], FLAT[3]]).unwrap_err();
    assert_eq!(flat, FabricError::PatternDegenerate { cloth: "it".into(), triangle: 0 });
    // A whole panel may be mirrored, and one in pixels is told.
    assert_eq!(build(FLAT.map(|[u, v]| [-u, v])).unwrap().warnings, []);
    let pixels = build(FLAT.map(|uv| uv.map(|x| 2000.0 * x))).unwrap();
    assert!(matches!(pixels.warnings[..], [RestWarning::Scale { ratio }] if ratio > 1999.0));
    assert!(pixels.warnings[0].to_string().contains("5.000e-4"), "{}", pixels.warnings[0]);
    let not_finite = build([FLAT[0], FLAT[1], FLAT[2], [f64::NAN, 0.0]]).unwrap_err();
    assert!(matches!(not_finite, FabricError::Model(ModelError::NonFinite { .. })));
    let (mesh, mut pattern) = square(FLAT);
    pattern.triangles[1][2] = 7;
    let error = RestShape::from_pattern(&mesh, &pattern, &BENDING, "it").unwrap_err();
    assert!(matches!(error, FabricError::PatternOutOfRange { triangle: 1, coordinate: 7, .. }));
    pattern.triangles.pop();
    let error = RestShape::from_pattern(&mesh, &pattern, &BENDING, "it").unwrap_err();
    assert!(matches!(error, FabricError::PatternLength { found: 1, expected: 2, .. }));
}

#[test]
fn bad_surfaces_are_named() {
    let (mut mesh, _) = square(FLAT);
    mesh.positions.push([0.05, 0.05, 0.1]);
    mesh.triangles.push([2, 0, 4]);
    let error = RestShape::from_mesh(&mesh, Some([1.0, 0.0, 0.0]), &BENDING, "it").unwrap_err();
    assert!(matches!(error, FabricError::Model(ModelError::EdgeNonManifold { .. })), "{error}");
    // A cloth that starts folded flat has a rest state all the same.
    let (mut mesh, pattern) = square(FLAT);
    mesh.positions[3] = mesh.positions[0];
    let shape = RestShape::from_pattern(&mesh, &pattern, &BENDING, "it").unwrap();
    assert_eq!(shape.triangles.len(), 2);
    let error = RestShape::from_mesh(&mesh, Some([1.0, 0.0, 0.0]), &BENDING, "it").unwrap_err();
    assert!(matches!(
        error,
        FabricError::Model(ModelError::TriangleDegenerate { triangle: 1, .. })
    ));
}
