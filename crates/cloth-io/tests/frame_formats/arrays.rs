//! VTK, NumPy and point caches.

use cloth_core::contact::{Contact, ContactKey, ContactKind};
use cloth_io::{
    ContactFrame, ContainerOptions, Frame, FrameFormat, FrameSequenceWriter, contacts_write,
    container_files, container_write, mesh_read,
};

use crate::{
    appended::appended,
    common::{positions, store, topology},
};

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
