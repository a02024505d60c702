//! Meshes of other people, in the folder that the environment variable `CLOTH_TEST_DATA` names.

use std::path::PathBuf;

use cloth_io::mesh_read;

fn data(name: &str) -> Option<PathBuf> {
    let path = match std::env::var_os("CLOTH_TEST_DATA") {
        Some(folder) => PathBuf::from(folder).join(name),
        None => {
            println!(
                "not run here: meshes of real files: set CLOTH_TEST_DATA to a folder with {name}"
            );
            return None;
        }
    };
    assert!(path.is_file(), "CLOTH_TEST_DATA lacks {name}");
    Some(path)
}

#[test]
fn cloth_and_collider_meshes() {
    let expected = [
        ("meshes/bunny3K.obj", 3135, 6266),
        ("meshes/sphere1K.obj", 1239, 2474),
        ("meshes/skirt8K.obj", 8121, 15_858),
        ("meshes/square26K.obj", 26_099, 51_564),
        ("rumba/shell0.obj", 12_811, 25_472),
        ("dress/drape.obj", 28_467, 54_928),
    ];
    for (name, vertices, triangles) in expected {
        let Some(path) = data(name) else {
            return;
        };
        let mesh = mesh_read(&path).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (vertices, triangles), "{name}");
        assert_eq!(mesh.texture, None, "{name}");
        assert!(mesh.groups.is_empty(), "{name}");
    }
}

#[test]
fn sewing_pattern() {
    let Some(path) = data("dress/stage.obj") else {
        return;
    };
    let mesh = mesh_read(&path).unwrap();
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (15_656, 29_456));
    assert_eq!(mesh.positions[0], [1.892435e-2, -8.321909e-2, 4.124258e-1]);
    assert_eq!(mesh.groups.len(), 14);
    let covered: usize = mesh.groups.iter().map(|panel| panel.vertices.len()).sum();
    assert_eq!(covered, mesh.positions.len(), "panels share no vertices");
    assert_eq!(mesh.texture.unwrap().coordinates.len(), 15_656);
}
