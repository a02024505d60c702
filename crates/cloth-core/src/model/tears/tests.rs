//! What a split mesh becomes, and where it tears.

use std::f64::consts::PI;

use super::{SplitMesh, Tear};
use crate::{
    Cloth, GridPatch, MeshFold, Meshing, Model, ModelBuilder, RestSource, State, TriangleMesh,
    Weld, Welding,
    fabric::{BendingSheet, FabricSheet, TensileSheet},
};

const STRAIN: f64 = 0.2;

fn mesh() -> TriangleMesh {
    let mut mesh = GridPatch::new([7, 5], 0.05).mesh(Meshing::Alternating);
    mesh.folds = vec![MeshFold { edge: [9, 16], angle: 0.25 * PI }];
    mesh
}

fn cloth(mesh: TriangleMesh) -> Cloth {
    let sheet = FabricSheet {
        area_density: 0.15,
        tensile: [Some(TensileSheet::Slope(800.0)), Some(TensileSheet::Slope(300.0))],
        shear: Some(40.0),
        bending: [Some(BendingSheet::Rigidity(1e-5)), None, None],
        ..FabricSheet::default()
    };
    let (fabric, _) = sheet.fit("rag").unwrap();
    Cloth::fabric_mesh("rag", mesh, fabric, RestSource::Pattern { scale: 1.0 }).with_pins([0])
}

fn builder() -> ModelBuilder {
    let SplitMesh { mesh, tear, .. } = mesh().split();
    let tear = Tear { cloth: "rag".into(), strain: STRAIN, ..tear };
    ModelBuilder::new().cloth(cloth(mesh)).tear(tear)
}

fn weld(torn: &[u32]) -> Weld {
    builder().weld(Welding { torn, ..Welding::default() }).unwrap().unwrap()
}

/// The edge between two vertices of the mesh before.
fn edge(model: &Model, origins: &[u32], ends: [u32; 2]) -> u32 {
    let of = |edge: &super::TearEdge| edge.joints.map(|[corner, _]| origins[corner as usize]);
    model.tears().edges().iter().position(|edge| of(edge) == ends).unwrap() as u32
}

#[test]
fn what_is_not_torn_is_the_cloth_before_to_the_last_bit() {
    let whole = ModelBuilder::new().cloth(cloth(mesh())).build().unwrap();
    let split = builder().build().unwrap();
    assert_eq!(split.particle_count(), 3 * whole.triangles().len());
    let weld = weld(&[]);
    assert_eq!(*weld.model, whole);
    assert_eq!(weld.map, mesh().split().origins);
    // Its fold is one of it.
    assert!(whole.elements().folds().iter().any(|fold| fold.angle.abs() > 0.7));
}

/// One edge inside the cloth opens nothing, one at its border does, two that meet do.
#[test]
fn a_vertex_parts_where_no_edges_join_its_triangles() {
    let split = builder().build().unwrap();
    let origins = mesh().split().origins;
    let vertices = |torn: &mut [[u32; 2]]| {
        let mut torn: Vec<u32> = torn.iter().map(|&ends| edge(&split, &origins, ends)).collect();
        torn.sort_unstable();
        weld(&torn).model.particle_count()
    };
    assert_eq!(vertices(&mut []), 35);
    assert_eq!(vertices(&mut [[17, 24]]), 35);
    assert_eq!(vertices(&mut [[3, 10]]), 36, "3 is at the border");
    assert_eq!(vertices(&mut [[10, 17], [17, 24]]), 36, "17 is between them");
    assert_eq!(vertices(&mut [[3, 10], [10, 17], [17, 24], [24, 31]]), 40, "two pieces");
}

/// Both sides lie apart at rest and where they are brought, and each within what it was.
#[test]
fn sides_of_a_tear_lie_apart() {
    let split = builder().build().unwrap();
    let origins = mesh().split().origins;
    let torn = [edge(&split, &origins, [3, 10])];
    let (before, after) = (weld(&[]), weld(&torn));
    let parted = after.parted(&split, &before, split.positions(), 1e-4);
    let moved: Vec<usize> =
        (0..parted.len()).filter(|&i| parted[i] != split.positions()[i]).collect();
    let at_it = origins.iter().filter(|origin| **origin == 3).count();
    assert!(moved.iter().all(|&corner| origins[corner] == 3) && moved.len() == at_it, "{moved:?}");
    let apart = |positions: &[[f64; 3]], [a, b]: [usize; 2]| {
        glam::DVec3::from(positions[a]).distance(positions[b].into())
    };
    let ends = split.tears().edges()[torn[0] as usize].joints[0].map(|corner| corner as usize);
    assert!((1e-4..=2e-4).contains(&apart(&parted, ends)), "{}", apart(&parted, ends));
    let became = ends.map(|corner| after.map[corner] as usize);
    assert!((1e-4..=2e-4).contains(&apart(after.model.positions(), became)));
    for triangle in split.triangles() {
        let [a, b, c] = triangle.map(|corner| glam::DVec3::from(parted[corner as usize]));
        assert!((b - a).cross(c - a).z > 0.0, "{triangle:?}");
    }
    // What was parted before stays where it is.
    let further = [torn[0], edge(&split, &origins, [10, 17])];
    let again = weld(&{
        let mut all = further;
        all.sort_unstable();
        all
    });
    let moved = again.parted(&split, &after, &parted, 1e-4);
    let is_of = |i: usize, vertex: u32| moved[i] == parted[i] || origins[i] == vertex;
    assert!((0..moved.len()).all(|i| is_of(i, 10)));
    // The same from positions alone, of before the one tear and of before both.
    assert_eq!(again.parted_from(&split, &parted, 1e-4), moved);
    assert_eq!(after.parted_from(&split, split.positions(), 1e-4), parted);
    assert_eq!(after.parted_from(&split, &parted, 1e-4), parted);
}

/// Threads break at their elongation, of warp and of weft, and not where cloth is sheared as far.
#[test]
fn threads_decide_what_tears() {
    let split = builder().build().unwrap();
    let state = |map: [[f64; 2]; 2]| {
        let place = |&[x, y, z]: &[f64; 3]| {
            [map[0][0] * x + map[0][1] * y, map[1][0] * x + map[1][1] * y, z]
        };
        let positions = split.positions().iter().map(place).collect();
        State { positions, held: vec![0; split.particle_count()], ..split.initial_state() }
    };
    let torn = |map| split.edges_that_tear(&state(map), &[]);
    assert!(torn([[1.19, 0.0], [0.0, 1.0]]).is_empty());
    for (axis, map) in [(0, [[1.21, 0.0], [0.0, 1.0]]), (1, [[1.0, 0.0], [0.0, 1.21]])] {
        let torn = torn(map);
        assert!(!torn.is_empty());
        let mut seen = vec![false; split.triangles().len()];
        for edge in torn {
            let edge = split.tears().edges()[edge as usize];
            let [a, b] = edge
                .joints
                .map(|[corner, _]| glam::DVec3::from(split.positions()[corner as usize]));
            // It crosses the threads, and no triangle tears twice.
            assert!((b - a).normalize()[axis].abs() < 0.9, "{edge:?}");
            for triangle in edge.triangles {
                assert!(!std::mem::replace(&mut seen[triangle as usize], true));
            }
        }
    }
    // Sheared to a lozenge whose long diagonal is a third longer, with threads as long as before.
    let (sin, cos) = (0.4_f64.sin(), 0.4_f64.cos());
    assert!(torn([[cos, sin], [sin, cos]]).is_empty());
    // What is held, and what is torn, does not.
    let mut state = state([[1.3, 0.0], [0.0, 1.0]]);
    let torn = split.edges_that_tear(&state, &[]);
    let rest = split.edges_that_tear(&state, &torn);
    assert!(rest.iter().all(|edge| !torn.contains(edge)));
    state.held.fill(1);
    assert!(split.edges_that_tear(&state, &[]).is_empty());
}

/// Two triangles that share a vertex and no edge stay together there.
#[test]
fn what_meets_at_a_vertex_alone_stays_one() {
    let mesh = TriangleMesh {
        positions: vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [-1.0, 0.0, 0.0],
            [-1.0, -1.0, 0.0],
        ],
        triangles: vec![[0, 1, 2], [0, 3, 4]],
        ..TriangleMesh::default()
    };
    let split = mesh.split();
    assert_eq!((split.tear.edges.len(), split.tear.bonds), (0, vec![[0, 5]]));
}

#[test]
fn a_tear_of_another_cloth_is_refused() {
    let SplitMesh { mesh, tear, .. } = mesh().split();
    let of = |cloth: &str, strain| Tear { cloth: cloth.into(), strain, ..tear.clone() };
    let build = |mesh: &TriangleMesh, tear| {
        ModelBuilder::new().cloth(cloth(mesh.clone())).tear(tear).build().unwrap_err().to_string()
    };
    assert!(build(&mesh, of("bag", 0.2)).contains("cloth \"bag\" is to tear"));
    assert!(build(&self::mesh(), of("rag", 0.2)).contains("is not the one whose mesh was split"));
    assert!(build(&mesh, of("rag", -0.2)).contains("strain at which cloth \"rag\" tears"));
}
