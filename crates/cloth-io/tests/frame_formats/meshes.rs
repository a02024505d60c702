//! OBJ, PLY and glTF.

use cloth_io::{
    ContainerOptions, Frame, FrameFormat, FrameSequenceWriter, FrameSolids, Topology,
    TopologyCloth, container_write, mesh_read, vertex_normals,
};

use crate::{
    common::{positions, store, topology},
    files, small_style,
};

#[test]
fn mesh_sequences_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let topology = topology();
    for format in [FrameFormat::Obj, FrameFormat::Ply] {
        let mut writer = FrameSequenceWriter::new(format, folder.path(), "run", &topology).unwrap();
        let positions = positions(3);
        let path = writer.write(&Frame::new(3, 0.12, &positions)).unwrap();
        assert_eq!(path, folder.path().join(format!("run_000003.{format}")));
        let mesh = mesh_read(&path).unwrap();
        assert_eq!(mesh.positions, positions);
        assert_eq!(mesh.triangles, topology.triangles);
        if format == FrameFormat::Obj {
            assert_eq!(mesh.texture, topology.texture);
            assert_eq!(mesh.group("front & back").unwrap().vertices, [0, 1, 2, 3]);
        }
    }
    assert_eq!(files(folder.path()), ["run_000003.obj", "run_000003.ply"], "nothing else is left");
}

#[test]
fn gltf_is_valid_and_animates_every_frame() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 4);
    let path = folder.path().join("run.glb");
    let options = ContainerOptions::default();
    container_write(FrameFormat::Gltf, &path, &topology(), &store, &options).unwrap();

    let bytes = std::fs::read(&path).unwrap();
    let gltf = gltf::Gltf::from_slice(&bytes).expect("the library finds the file valid");
    let blob = gltf.blob.clone().unwrap();
    assert_eq!(gltf.meshes().len(), 2);
    let sleeve = gltf.meshes().nth(1).unwrap();
    assert_eq!(sleeve.name(), Some("sleeve"));
    let primitive = sleeve.primitives().next().unwrap();
    let reader = primitive.reader(|_| Some(&blob));
    let base: Vec<_> = reader.read_positions().unwrap().collect();
    assert_eq!(base.len(), 5, "the seam splits one particle");
    assert_eq!(base[2], [1.0, 1.0, -1.0], "Y is up");
    let targets: Vec<_> = reader.read_morph_targets().collect();
    assert_eq!(targets.len(), 3);
    let change: Vec<_> = targets.into_iter().nth(2).unwrap().0.unwrap().collect();
    // Frame 3 moves particle 6 by 0.375 along y and, at x = 1, along z.
    assert_eq!(change[2], [0.0, 0.375, -0.375]);

    let animation = gltf.animations().next().unwrap();
    assert_eq!(animation.channels().count(), 2);
    let reader = animation.channels().next().unwrap().reader(|_| Some(&blob));
    let times: Vec<f32> = reader.read_inputs().unwrap().collect();
    assert_eq!(times, [0.0, 0.04, 0.08, 0.12]);
    let gltf::animation::util::ReadOutputs::MorphTargetWeights(weights) =
        reader.read_outputs().unwrap()
    else {
        panic!("the animation moves something else");
    };
    let weights: Vec<f32> = weights.into_f32().collect();
    assert_eq!(weights, [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]);

    // Our own reader welds the seam again and finds both cloths.
    let mesh = mesh_read(&path).unwrap();
    assert_eq!(mesh.positions.len(), 8);
    assert_eq!(mesh.groups.len(), 2);
    // It has the axes of the engine again, after the seam that split a particle.
    let mut found = mesh.positions.clone();
    let mut expected = positions(0);
    found.sort_by(|a, b| a.partial_cmp(b).unwrap());
    expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
    assert_eq!(found, expected);
}

#[test]
fn gltf_leaves_out_frames_rather_than_grow_too_large() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 10);
    let path = folder.path().join("run.glb");
    // Room for three targets of 8 particles with normals.
    let options = ContainerOptions { gltf_size: 3 * 8 * 24, ..ContainerOptions::default() };
    let report = container_write(FrameFormat::Gltf, &path, &topology(), &store, &options).unwrap();
    assert_eq!((report.frame_count, report.frame_stride), (4, 3));
    assert!(report.warnings[0].contains("1 of 3 frames"), "{:?}", report.warnings);
    let options = ContainerOptions { frame_stride: Some(1), ..options };
    let report = container_write(FrameFormat::Gltf, &path, &topology(), &store, &options).unwrap();
    assert_eq!(
        (report.frame_count, report.warnings.len()),
        (10, 0),
        "an explicit stride is obeyed"
    );
}

/// A rope of three particles and a single one: nothing has a surface.
fn rope() -> Topology {
    Topology {
        lines: vec![[0, 1], [1, 2]],
        particle_count: 4,
        cloths: vec![TopologyCloth {
            name: "rope".to_owned(),
            particles: 0..4,
            triangles: 0..0,
            lines: 0..2,
        }],
        frames_per_second: 10.0,
        ..Topology::default()
    }
}

#[test]
fn a_run_without_triangles_writes_lines_and_points_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let topology = rope();
    let path = folder.path().join("frames.cloth");
    let mut store = cloth_io::FrameStore::create(&path, &topology).unwrap();
    for index in 0..2 {
        let places = positions(index);
        store.append(0.1 * index as f64, &places[..4]).unwrap();
        for format in FrameFormat::ALL.into_iter().filter(|format| format.is_sequence()) {
            let writer = FrameSequenceWriter::new(format, folder.path(), "run", &topology);
            let mut writer = writer.unwrap().with_style(small_style());
            writer.write(&Frame::new(index as u64, 0.1 * index as f64, &places[..4])).unwrap();
        }
    }
    let options = ContainerOptions { style: small_style(), ..ContainerOptions::default() };
    for format in FrameFormat::ALL.into_iter().filter(|format| !format.is_sequence()) {
        let path = folder.path().join(format!("run.{}", format.extension()));
        container_write(format, &path, &topology, &store, &options).unwrap();
    }
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    let obj = String::from_utf8(read("run_000001.obj")).unwrap();
    assert!(obj.contains("\nl 1 2\nl 2 3\np 4\n") && !obj.contains("vn"), "{obj}");
    // The single particle is in no line: programs that import the mesh leave it out.
    let obj = String::from_utf8(read("run_mesh.obj")).unwrap();
    assert!(obj.matches("\nv ").count() == 3 && obj.contains("\nl 1 2\nl 2 3\n"), "{obj}");
    assert_eq!(read("run.pc2").len(), 32 + 2 * 3 * 12);
    let ply = read("run_000000.ply");
    let ply = String::from_utf8_lossy(&ply);
    assert!(ply.contains("element edge 2\nproperty int vertex1"), "{ply}");
    let vtu = read("run_000000.vtu");
    let text = String::from_utf8_lossy(&vtu);
    assert!(text.contains("NumberOfPoints=\"4\" NumberOfCells=\"3\""), "{text}");
    assert!(vtu.ends_with(b"\x03\x03\x01\n</AppendedData>\n</VTKFile>\n"), "two lines, a point");
    let bytes = read("run.glb");
    let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
    let mesh = gltf.meshes().next().unwrap();
    let modes: Vec<_> = mesh.primitives().map(|primitive| primitive.mode()).collect();
    assert_eq!(modes, [gltf::mesh::Mode::Lines, gltf::mesh::Mode::Points]);
    let image = image::open(folder.path().join("run_000000.png")).unwrap().into_rgb8();
    let first = image.get_pixel(0, 0);
    assert!(
        image
            .pixels()
            .filter(|pixel| pixel[0] > first[0].saturating_add(20)
                || pixel[2].saturating_add(40) < first[2])
            .count()
            > 3,
        "the rope is seen"
    );
}

/// A ball that moves and a floor, beside the two cloths.
#[test]
fn colliders_are_written_beside_the_cloth_when_asked_for() {
    use cloth_core::{Collider, ColliderShape, Pose};
    let folder = tempfile::tempdir().unwrap();
    let collider = |name: &str, shape| Collider {
        name: name.to_owned(),
        shape,
        pose: Pose::IDENTITY,
        friction: 0.0,
        restitution: 0.0,
    };
    let colliders = [
        collider("ball", ColliderShape::Sphere { radius: 0.5 }),
        collider("floor", ColliderShape::Plane),
    ];
    let solids = FrameSolids::new(&colliders, &positions(0), |time| {
        vec![Pose::from_translation([time, 0.0, 2.0]), Pose::IDENTITY]
    });
    let topology = topology();
    for format in [FrameFormat::Obj, FrameFormat::Vtu] {
        let writer = FrameSequenceWriter::new(format, folder.path(), "run", &topology).unwrap();
        let mut writer = writer.with_solids(Some(solids.clone()));
        let path = writer.write(&Frame::new(0, 3.0, &positions(0))).unwrap();
        if format == FrameFormat::Vtu {
            let text = String::from_utf8_lossy(&std::fs::read(path).unwrap()).into_owned();
            assert!(text.contains("Name=\"solid\""), "{text}");
            continue;
        }
        let mesh = mesh_read(&path).unwrap();
        assert_eq!(mesh.positions[..8], positions(0));
        let ball = &mesh.group("ball").unwrap().vertices;
        for &vertex in ball {
            let [x, y, z] = mesh.positions[vertex as usize];
            assert!(((x - 3.0).hypot(y).hypot(z - 2.0) - 0.5).abs() < 1e-6, "{x} {y} {z}");
        }
        let floor = &mesh.group("floor").unwrap().vertices;
        assert!(floor.iter().all(|&vertex| mesh.positions[vertex as usize][2] == 0.0));
    }
    let store = store(&folder.path().join("frames.cloth"), 3);
    let path = folder.path().join("run.glb");
    let options = ContainerOptions { solids: Some(solids), ..ContainerOptions::default() };
    container_write(FrameFormat::Gltf, &path, &topology, &store, &options).unwrap();
    let gltf = gltf::Gltf::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let names: Vec<_> = gltf.nodes().map(|node| node.name().unwrap().to_owned()).collect();
    assert_eq!(names, ["front & back", "sleeve", "ball", "floor"]);
    let ball = gltf.nodes().nth(2).unwrap();
    assert_eq!(ball.transform().decomposed().0, [0.0, 2.0, 0.0], "y is up");
    let blob = gltf.blob.clone().unwrap();
    let animation = gltf.animations().next().unwrap();
    let moved: Vec<_> = animation.channels().filter(|c| c.target().node().index() == 2).collect();
    assert_eq!(moved.len(), 1, "it does not turn");
    let reader = moved[0].reader(|_| Some(&blob));
    let gltf::animation::util::ReadOutputs::Translations(path) = reader.read_outputs().unwrap()
    else {
        panic!("no translation");
    };
    let expected = [0.0, 0.04, 0.08].map(|x| [x, 2.0, 0.0]);
    assert_eq!(path.collect::<Vec<_>>(), expected);
    assert!(animation.channels().all(|channel| channel.target().node().index() < 3));
}

/// One normal for each particle, also where the texture has a seam; files say that faces are smooth.
#[test]
fn normals_are_smooth_in_obj() {
    let folder = tempfile::tempdir().unwrap();
    let topology = topology();
    let writer = FrameSequenceWriter::new(FrameFormat::Obj, folder.path(), "run", &topology);
    let path = writer.unwrap().write(&Frame::new(0, 0.0, &positions(2))).unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    let normals: Vec<Vec<f64>> = text
        .lines()
        .filter_map(|line| line.strip_prefix("vn "))
        .map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect())
        .collect();
    for (found, wanted) in normals.iter().zip(vertex_normals(&positions(2), &topology.triangles)) {
        assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}");
    }
    assert_eq!((normals.len(), text.matches("\ns 1\n").count()), (8, 2));
    assert!(text.contains("f 5/1/5 6/2/6 7/3/7") && text.contains("f 5/5/5 7/3/7 8/4/8"), "{text}");
}

#[test]
fn normals_are_weighted_by_area() {
    // A large triangle facing up and a small one facing along x share vertex 0.
    let positions = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [5.0; 3],
    ];
    let normals = vertex_normals(&positions, &[[0, 1, 2], [0, 3, 4]]);
    let length = 17f64.sqrt();
    assert!((normals[0][0] - 1.0 / length).abs() < 1e-12);
    assert!((normals[0][2] - 4.0 / length).abs() < 1e-12);
    assert_eq!(normals[1], [0.0, 0.0, 1.0]);
    assert_eq!(normals[5], [0.0; 3]);
}
