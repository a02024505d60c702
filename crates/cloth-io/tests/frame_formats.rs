//! Output files hold the frames that were given.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

mod appended;
mod common;

use std::num::NonZeroUsize;
use std::path::Path;

use appended::appended;
use cloth_core::contact::{Contact, ContactKey, ContactKind};
use cloth_io::{
    Bounds, Camera, ContactFrame, ContainerOptions, Frame, FrameError, FrameFormat, FramePipeline,
    FrameSequenceWriter, FrameSolids, PictureSequence, PictureStyle, Topology, TopologyCloth,
    contacts_write, container_files, container_write, mesh_read, vertex_normals,
};
use common::{positions, store, topology};

fn small_style() -> PictureStyle {
    PictureStyle { width: 64, height: 36, ..PictureStyle::default() }
}

/// Names of the files in `folder`.
fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn names_are_read_back_and_typing_errors_explained() {
    for format in FrameFormat::ALL {
        assert_eq!(format.to_string().to_uppercase().parse(), Ok(format));
    }
    assert_eq!("glb".parse(), Ok(FrameFormat::Gltf));
    let message = "fbx".parse::<FrameFormat>().unwrap_err().to_string();
    assert!(message.starts_with("unknown output format `fbx`; use one of: obj, ply, vtu"));
}

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
fn vtu_arrays_start_where_the_header_says() {
    let folder = tempfile::tempdir().unwrap();
    let topology = topology();
    let mut writer =
        FrameSequenceWriter::new(FrameFormat::Vtu, folder.path(), "run", &topology).unwrap();
    let positions = positions(0);
    let velocities = vec![[1.0, 2.0, 3.0]; 8];
    let frame = Frame { velocities: Some(&velocities), ..Frame::new(0, 0.5, &positions) };
    let path = writer.write(&frame).unwrap();
    let bytes = std::fs::read(path).unwrap();
    let (text, array) = (String::from_utf8_lossy(&bytes), |name: &str| appended(&bytes, name));
    let floats = |name: &str| -> Vec<f64> {
        let floats = array(name).chunks_exact(4);
        floats.map(|b| f32::from_le_bytes(b.try_into().unwrap()).into()).collect()
    };
    assert_eq!(floats("position"), [positions.concat(), positions[4].to_vec()].concat());
    assert_eq!(floats("velocity")[..24], velocities.concat());
    assert_eq!(floats("normal")[..3], [0.0, 0.0, 1.0]);
    assert_eq!(array("types"), [5; 4]);
    assert_eq!(array("offsets")[8], 6);
    assert_eq!(array("connectivity").len(), 12 * 8);
    assert_eq!(array("cloth")[4 * 3], 1);
    // The particle on the seam is there twice, behind all particles.
    let particles: Vec<i32> = array("particle")
        .chunks_exact(4)
        .map(|b| i32::from_le_bytes(b.try_into().unwrap()))
        .collect();
    assert_eq!(particles, [0, 1, 2, 3, 4, 5, 6, 7, 4]);
    assert!(text.contains("TCoords=\"texture\""), "ParaView takes it without being asked");
    let texture = floats("texture");
    assert_eq!((&texture[8..10], &texture[16..]), (&[0.0, 0.0][..], &[0.5, 0.5][..]));
}

#[test]
fn a_resumed_collection_lists_all_frames() {
    let folder = tempfile::tempdir().unwrap();
    let topology = topology();
    let store = store(&folder.path().join("frames.cloth"), 4);
    let writer = FrameSequenceWriter::new(FrameFormat::Vtu, folder.path(), "a&b", &topology);
    let mut writer = writer.unwrap();
    writer.write(&Frame::new(0, 0.0, &positions(0))).unwrap();
    writer.write(&Frame::new(2, 0.08, &positions(2))).unwrap();
    let writer = FrameSequenceWriter::new(FrameFormat::Vtu, folder.path(), "a&b", &topology);
    let mut writer = writer.unwrap().resume(&store).unwrap();
    writer.write(&Frame::new(4, 0.16, &positions(4))).unwrap();
    let text = std::fs::read_to_string(folder.path().join("a&b.pvd")).unwrap();
    let sets: Vec<_> = text.lines().filter(|line| line.contains("<DataSet")).collect();
    assert_eq!(sets.len(), 3, "frames without a file are listed: {sets:?}");
    assert!(sets[1].contains("timestep=\"0.08\""), "{}", sets[1]);
    assert!(sets[1].contains("file=\"a&amp;b_000002.vtu\""), "{}", sets[1]);
    assert!(sets[2].contains("file=\"a&amp;b_000004.vtu\""), "{}", sets[2]);
}

#[test]
fn point_caches_follow_their_layouts() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 4);
    let options = ContainerOptions { frame_stride: Some(2), ..ContainerOptions::default() };
    let path = folder.path().join("run.pc2");
    let report = container_write(FrameFormat::Pc2, &path, &topology(), &store, &options).unwrap();
    assert_eq!((report.frame_count, report.frame_stride), (2, 2));
    let file = |name: &str| folder.path().join(name);
    let [front, sleeve] = ["run_front---back.pc2", "run_sleeve.pc2"].map(file);
    let [front_mesh, sleeve_mesh] = ["run_front---back_mesh.obj", "run_sleeve_mesh.obj"].map(file);
    assert_eq!(report.files, [front.clone(), front_mesh.clone(), sleeve, sleeve_mesh.clone()]);
    assert_eq!(report.files, container_files(FrameFormat::Pc2, &path, &topology()));
    assert!(report.notes[0].contains("12.5 frames per second"), "{:?}", report.notes);
    for (mesh, particles) in [(&front_mesh, 0..4), (&sleeve_mesh, 4..8)] {
        // Programs make an object of each `o`: there is one, with all vertices in the order of the cache.
        assert_eq!(std::fs::read_to_string(mesh).unwrap().matches("\no ").count(), 1);
        let mesh = mesh_read(mesh).unwrap();
        assert_eq!(mesh.positions, positions(0)[particles]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert!(mesh.texture.is_some());
    }
    assert_eq!(mesh_read(&sleeve_mesh).unwrap().texture.unwrap().coordinates.len(), 5);
    let bytes = std::fs::read(&front).unwrap();
    assert_eq!(&bytes[..12], b"POINTCACHE2\0");
    let header: Vec<_> = bytes[12..32].chunks(4).map(|b| b.try_into().unwrap()).collect();
    assert_eq!(header.iter().map(|&b| i32::from_le_bytes(b)).collect::<Vec<_>>()[..2], [1, 4]);
    assert_eq!(f32::from_le_bytes(header[3]), 1.0);
    assert_eq!(i32::from_le_bytes(header[4]), 2);
    let floats = |bytes: &[u8], parse: fn([u8; 4]) -> f32| -> Vec<f64> {
        bytes.chunks_exact(4).map(|b| parse(b.try_into().unwrap()).into()).collect()
    };
    let frames = |part: std::ops::Range<usize>| {
        [&positions(0)[part.clone()], &positions(2)[part]].concat().concat()
    };
    assert_eq!(floats(&bytes[32..], f32::from_le_bytes), frames(0..4));

    let path = folder.path().join("run.mdd");
    container_write(FrameFormat::Mdd, &path, &topology(), &store, &options).unwrap();
    let bytes = std::fs::read(file("run_sleeve.mdd")).unwrap();
    assert_eq!(bytes[..8], [0, 0, 0, 2, 0, 0, 0, 4]);
    let times = floats(&bytes[8..16], f32::from_be_bytes);
    assert!((times[1] - 0.08).abs() < 1e-7, "{times:?}");
    assert_eq!(floats(&bytes[16..], f32::from_be_bytes), frames(4..8));
}

/// Both formats of contacts give back what they were given.
#[test]
fn contacts_are_written_with_all_that_is_known_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let contact = |first: u32, force: f64| Contact {
        key: ContactKey { kind: ContactKind::VertexFace, first, second: 4 },
        particles: [first, 5, 6, 7],
        weights: [1.0, -0.5, -0.25, -0.25],
        gap: 1e-3,
        reach: 2e-3,
        normal: [0.0, 0.6, 0.8],
        force,
        friction: [0.25, 0.0, -0.5],
        slip: [0.0; 3],
        sticks: first == 3,
    };
    let frame = ContactFrame {
        time: 0.5,
        contacts: vec![contact(2, 1.5), contact(3, 0.125)],
        places: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
    };
    let path = folder.path().join("contacts.npz");
    contacts_write(&path, &frame).unwrap();
    let mut archive = zip::ZipArchive::new(std::fs::File::open(&path).unwrap()).unwrap();
    let mut read = |name: &str| {
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut archive.by_name(name).unwrap(), &mut bytes).unwrap();
        bytes
    };
    let mut numbers = |name: &str| -> Vec<f64> {
        npyz::NpyFile::new(&read(name)[..]).unwrap().into_vec().unwrap()
    };
    assert_eq!(numbers("place.npy"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!((numbers("force.npy"), numbers("time.npy")), (vec![1.5, 0.125], vec![0.5]));
    let bytes = read("particles.npy");
    let file = npyz::NpyFile::new(&bytes[..]).unwrap();
    assert_eq!(file.shape(), [2, 4]);
    assert_eq!(file.into_vec::<u32>().unwrap(), [2, 5, 6, 7, 3, 5, 6, 7]);
    let path = folder.path().join("contacts.vtu");
    contacts_write(&path, &frame).unwrap();
    let bytes = std::fs::read(path).unwrap();
    let array = |name: &str| appended(&bytes, name);
    let floats = |name: &str| -> Vec<f64> {
        let numbers = array(name).chunks_exact(8);
        numbers.map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
    };
    assert_eq!(floats("position"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(floats("friction")[3..], [0.25, 0.0, -0.5]);
    assert_eq!((array("sticks"), array("types")), (&[0, 1][..], &[1, 1][..]));
    // None at all is a file as well.
    for name in ["none.vtu", "none.npz"] {
        contacts_write(&folder.path().join(name), &ContactFrame::default()).unwrap();
    }
}

#[test]
fn numpy_archives_hold_all_arrays() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 3);
    let path = folder.path().join("run.npz");
    let options = ContainerOptions::default();
    container_write(FrameFormat::Npz, &path, &topology(), &store, &options).unwrap();
    let mut archive = zip::ZipArchive::new(std::fs::File::open(&path).unwrap()).unwrap();
    let mut array = |name: &str| {
        let file = archive.by_name(name).unwrap();
        npyz::NpyFile::new(std::io::BufReader::new(file)).unwrap().shape().to_vec()
    };
    assert_eq!(array("positions.npy"), [3, 8, 3]);
    assert_eq!(array("times.npy"), [3]);
    assert_eq!(array("triangles.npy"), [4, 3]);
    assert_eq!(array("uv.npy"), [5, 2]);
    assert_eq!(array("uv_triangles.npy"), [4, 3]);
    assert_eq!(array("frames_per_second.npy"), [0_u64; 0]);
    let mut read = |name: &str| {
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut archive.by_name(name).unwrap(), &mut bytes).unwrap();
        bytes
    };
    let bytes = read("cloth_of_particle.npy");
    let cloths: Vec<u32> = npyz::NpyFile::new(&bytes[..]).unwrap().into_vec().unwrap();
    assert_eq!(cloths, [0, 0, 0, 0, 1, 1, 1, 1]);
    let bytes = read("cloths.npy");
    let names: Vec<String> = npyz::NpyFile::new(&bytes[..]).unwrap().into_vec().unwrap();
    assert_eq!(names, ["front & back", "sleeve"]);
    let bytes = read("frames_per_second.npy");
    let rate: Vec<f64> = npyz::NpyFile::new(&bytes[..]).unwrap().into_vec().unwrap();
    assert_eq!(rate, [25.0]);
    let file = archive.by_name("positions.npy").unwrap();
    let values = npyz::NpyFile::new(std::io::BufReader::new(file)).unwrap();
    let values: Vec<f32> = values.into_vec().unwrap();
    assert_eq!(
        values[2 * 24..].iter().map(|&x| f64::from(x)).collect::<Vec<_>>(),
        positions(2).concat()
    );
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

#[test]
fn animated_pictures_have_all_frames() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 3);
    let options = ContainerOptions { style: small_style(), ..ContainerOptions::default() };
    let path = folder.path().join("run.gif");
    container_write(FrameFormat::Gif, &path, &topology(), &store, &options).unwrap();
    let mut decoder = gif::DecodeOptions::new();
    decoder.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = decoder.read_info(std::fs::File::open(&path).unwrap()).unwrap();
    assert_eq!((decoder.width(), decoder.height()), (64, 36));
    assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        delays.push(frame.delay);
    }
    assert_eq!(delays, [4, 4, 4]);

    let path = folder.path().join("run.png");
    container_write(FrameFormat::Apng, &path, &topology(), &store, &options).unwrap();
    let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let reader = png::Decoder::new(file).read_info().unwrap();
    assert_eq!(reader.info().animation_control().unwrap().num_frames, 3);
    assert_eq!((reader.info().width, reader.info().height), (64, 36));
}

#[test]
fn picture_sequences_have_the_size_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let topology = topology();
    let writer = FrameSequenceWriter::new(FrameFormat::Png, folder.path(), "run", &topology);
    let mut writer = writer.unwrap().with_style(small_style());
    let path = writer.write(&Frame::new(0, 0.0, &positions(0))).unwrap();
    assert_eq!(image::image_dimensions(path).unwrap(), (64, 36));
}

#[test]
fn wrong_kinds_and_bad_frames_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let topology = topology();
    let path = folder.path().join("frames.cloth");
    let options = ContainerOptions::default();
    let empty = store(&path, 0);
    for format in FrameFormat::ALL {
        let writer = FrameSequenceWriter::new(format, folder.path(), "run", &topology);
        assert_eq!(writer.is_ok(), format.is_sequence());
        let container = container_write(format, &path, &topology, &empty, &options);
        match container.unwrap_err() {
            FrameError::Kind { .. } => assert!(format.is_sequence()),
            FrameError::FrameNone { .. } => assert!(!format.is_sequence()),
            other => panic!("{other}"),
        }
    }
    let mut writer =
        FrameSequenceWriter::new(FrameFormat::Obj, folder.path(), "run", &topology).unwrap();
    let mut bad = positions(0);
    bad[7][0] = f64::NAN;
    let refused = writer.write(&Frame::new(0, 0.0, &bad));
    assert!(matches!(refused, Err(FrameError::Position { particle: 7 })));
    let refused = writer.write(&Frame::new(0, 0.0, &bad[1..]));
    assert!(matches!(refused, Err(FrameError::ParticleCount { found: 7, expected: 8 })));
    assert_eq!(files(folder.path()), ["frames.cloth"], "no half file is left");
}

/// What one format cannot hold, no format takes: OBJ is text and could hold 1e300, PLY could hold NaN.
#[test]
fn a_frame_that_is_not_finite_is_refused_alike_by_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let topology = topology();
    let good = positions(0);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        let mut broken = good.clone();
        broken[6][1] = bad;
        let frames = [
            ("position", Frame::new(0, 0.0, &broken)),
            ("velocity", Frame { velocities: Some(&broken), ..Frame::new(0, 0.0, &good) }),
            ("normal", Frame { normals: Some(&broken), ..Frame::new(0, 0.0, &good) }),
        ];
        for (wrong, frame) in frames {
            for format in FrameFormat::ALL.into_iter().filter(|format| format.is_sequence()) {
                let writer = FrameSequenceWriter::new(format, folder.path(), "run", &topology);
                let refused = writer.unwrap().with_style(small_style()).write(&frame).unwrap_err();
                match refused {
                    FrameError::Position { particle: 6 } => assert_eq!(wrong, "position"),
                    FrameError::Vector { what, particle: 6 } => assert_eq!(wrong, what),
                    other => panic!("{format}: {other}"),
                }
            }
        }
        // All other formats are made of a store.
        let mut store = store(&folder.path().join("frames.cloth"), 0);
        let refused = store.append(0.0, &broken);
        assert!(matches!(refused, Err(FrameError::Position { particle: 6 })), "{bad}");
    }
    for format in [FrameFormat::Obj, FrameFormat::Ply, FrameFormat::Vtu, FrameFormat::Png] {
        let writer = FrameSequenceWriter::new(format, folder.path(), "run", &topology);
        let refused = writer.unwrap().write(&Frame::new(3, f64::NAN, &good));
        assert!(matches!(refused, Err(FrameError::Time { index: 3, .. })), "{format}");
    }
    assert_eq!(files(folder.path()), ["frames.cloth"]);
}

/// A damaged store gives no file in any format, and the file from before stays.
#[test]
fn a_damaged_frame_is_refused_alike_by_every_container() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.cloth");
    drop(store(&path, 4));
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[64 + 2 * (16 + 12 * 8) + 40] ^= 4;
    std::fs::write(&path, bytes).unwrap();
    let damaged = cloth_io::FrameStore::open_read_only(&path, &topology()).unwrap();
    let options = ContainerOptions { style: small_style(), ..ContainerOptions::default() };
    for format in FrameFormat::ALL.into_iter().filter(|format| !format.is_sequence()) {
        let output = folder.path().join("run.out");
        std::fs::write(&output, "before").unwrap();
        let error = container_write(format, &output, &topology(), &damaged, &options).unwrap_err();
        assert!(matches!(error, FrameError::StoreDamaged { index: 2, .. }), "{format}: {error}");
        assert_eq!(std::fs::read(&output).unwrap(), b"before", "{format}");
    }
}

#[test]
fn errors_name_the_file_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 1);
    let path = folder.path().join("missing").join("run.npz");
    let options = ContainerOptions::default();
    let problem =
        container_write(FrameFormat::Npz, &path, &topology(), &store, &options).unwrap_err();
    let message = problem.to_string();
    assert!(message.contains("run.npz"), "{message}");
    assert!(message.contains("choose another folder"), "{message}");
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

/// The files that a pipeline with that many threads writes, in the order of their names.
fn piped(threads: usize) -> Vec<(String, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let store = store(&root.join("frames.cloth"), 0);
    let mut pipeline = FramePipeline::new(&topology(), NonZeroUsize::new(threads)).unwrap();
    for format in [FrameFormat::Obj, FrameFormat::Vtu] {
        pipeline.add_geometry(format, &root.join("geometry"), "run", &store).unwrap();
    }
    let bounds = Bounds { min: [-2.0; 3], max: [2.0; 3] };
    let style = PictureStyle { camera: Some(Camera::fit(&bounds, 1.8)), ..small_style() };
    let sequence = |name: &str| PictureSequence { folder: root.join(name), name: "run".to_owned() };
    pipeline.add_pictures(&sequence("pictures"), &style).unwrap();
    let smaller = PictureStyle { width: 32, height: 18, ..style };
    pipeline.add_pictures(&sequence("smaller"), &smaller).unwrap();
    for index in 0..9 {
        let positions = positions(index as usize);
        pipeline.write(&Frame::new(index, 0.04 * index as f64, &positions), None).unwrap();
    }
    pipeline.finish().unwrap();
    let mut contents = Vec::new();
    for name in ["geometry", "pictures", "smaller"] {
        let folder = root.join(name);
        for file in files(&folder) {
            contents.push((format!("{name}/{file}"), std::fs::read(folder.join(file)).unwrap()));
        }
    }
    contents
}

#[test]
fn a_pipeline_writes_the_same_bytes_with_any_number_of_threads() {
    let one = piped(1);
    assert_eq!(one.len(), 9 + 9 + 1 + 9 + 9);
    assert_eq!(one, piped(3));
    let collection = one.iter().find(|(name, _)| name.ends_with(".pvd")).unwrap();
    let text = String::from_utf8(collection.1.clone()).unwrap();
    assert_eq!(text.matches("run_00000").count(), 9, "{text}");
}

#[test]
fn an_animation_has_the_same_bytes_with_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 9);
    let options = ContainerOptions { style: small_style(), ..ContainerOptions::default() };
    let bytes = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let path = folder.path().join("run.gif");
        pool.install(|| container_write(FrameFormat::Gif, &path, &topology(), &store, &options))
            .unwrap();
        std::fs::read(path).unwrap()
    };
    assert_eq!(bytes(1), bytes(3));
}

#[test]
fn what_a_pipeline_cannot_write_is_told_later() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(&folder.path().join("frames.cloth"), 0);
    let path = folder.path().join("obj");
    let mut pipeline = FramePipeline::new(&topology(), NonZeroUsize::new(2)).unwrap();
    pipeline.add_geometry(FrameFormat::Obj, &path, "run", &store).unwrap();
    pipeline.write(&Frame::new(0, 0.0, &positions(0)), None).unwrap();
    pipeline.finish().unwrap();
    std::fs::remove_dir_all(&path).unwrap();
    let mut told = None;
    for index in 1..40 {
        let positions = positions(0);
        told = pipeline.write(&Frame::new(index, 0.0, &positions), None).err();
        if told.is_some() {
            break;
        }
    }
    let message = told.expect("before long").to_string();
    assert!(message.contains("run_000001.obj"), "the earliest frame first: {message}");
    // Frames that are not good are refused at once, and geometry is not drawn.
    let mut bad = positions(0);
    bad[7][0] = f64::NAN;
    let refused = pipeline.write(&Frame::new(50, 0.0, &bad), None);
    assert!(matches!(refused, Err(FrameError::Position { particle: 7 })));
    let refused = pipeline.add_geometry(FrameFormat::Png, &path, "run", &store);
    assert!(matches!(refused, Err(FrameError::Kind { .. })));
}
