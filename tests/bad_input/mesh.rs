//! Defects of triangle meshes.

use cloth_core::{Cloth, Geometry, Mass, Material, ModelBuilder, ModelError, TriangleMesh};
use harness::models::material;

use crate::patch;

const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

type Positions = &'static [[f64; 3]];
type Triangles = &'static [[u32; 3]];

/// Three triangles share the edge 0-1.
const FAN: [[f64; 3]; 5] =
    [[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]];

/// Three points on a line.
const NEEDLE: [[f64; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]];

/// Two triangles folded flat onto each other: no length between the opposite vertices.
const FOLDED: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

fn error_of(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> ModelError {
    let mesh = TriangleMesh {
        positions: positions.to_vec(),
        triangles: triangles.to_vec(),
        ..TriangleMesh::default()
    };
    let geometry = Geometry::Mesh(mesh);
    let springs = Material { mass: Mass::PerArea(0.1), ..material(1e-3, 10.0, 1e-3) };
    let cloth = Cloth { name: "sheet".into(), geometry, material: springs.into(), ..patch() };
    ModelBuilder::new().cloth(cloth).build().expect_err("the mesh has a defect")
}

#[test]
fn defects_are_named_with_their_indices() {
    let cloth = String::from("sheet");
    let cases: [(Positions, Triangles, ModelError); 10] = [
        (&[], &[], ModelError::MeshEmpty { cloth: cloth.clone(), vertices: 0, triangles: 0 }),
        (&SQUARE, &[], ModelError::MeshEmpty { cloth: cloth.clone(), vertices: 4, triangles: 0 }),
        (
            &SQUARE,
            &[[0, 1, 2], [0, 2, 4]],
            ModelError::TriangleOutOfRange {
                cloth: cloth.clone(),
                triangle: 1,
                vertex: 4,
                vertices: 4,
            },
        ),
        (
            &SQUARE,
            &[[0, 1, 2], [3, 2, 3]],
            ModelError::TriangleRepeatsVertex { cloth: cloth.clone(), triangle: 1, vertex: 3 },
        ),
        (
            &NEEDLE,
            &[[0, 1, 2]],
            ModelError::TriangleDegenerate { cloth: cloth.clone(), triangle: 0 },
        ),
        (
            &SQUARE,
            &[[0, 1, 2], [0, 2, 3], [1, 2, 0]],
            ModelError::TriangleDuplicate { cloth: cloth.clone(), first: 0, second: 2 },
        ),
        (
            &FAN,
            &[[0, 1, 2], [1, 0, 3], [0, 1, 4]],
            ModelError::EdgeNonManifold {
                cloth: cloth.clone(),
                edge: [0, 1],
                triangles: vec![0, 1, 2],
            },
        ),
        (
            &SQUARE,
            &[[0, 1, 2], [0, 3, 2]],
            ModelError::EdgeInconsistent { cloth: cloth.clone(), edge: [0, 2], triangles: [0, 1] },
        ),
        (&SQUARE, &[[0, 1, 2]], ModelError::VertexIsolated { cloth: cloth.clone(), vertex: 3 }),
        (
            &FOLDED,
            &[[0, 1, 2], [1, 0, 3]],
            ModelError::SpringWithoutLength { cloth: cloth.clone(), vertices: [2, 3] },
        ),
    ];
    for (positions, triangles, expected) in cases {
        assert_eq!(error_of(positions, triangles), expected);
    }
}

#[test]
fn positions_that_are_no_numbers() {
    for bad in [f64::NAN, f64::INFINITY] {
        let mut positions = SQUARE;
        positions[2][1] = bad;
        let error = error_of(&positions, &[[0, 1, 2], [0, 2, 3]]);
        assert!(
            matches!(&error, ModelError::NonFinite { what, .. } if what.contains("vertex 2")),
            "{error:?}"
        );
    }
}
