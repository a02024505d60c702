//! Strain and stress of fabric in VTU files, against what a uniform stretch has by hand.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

mod appended;

use std::collections::BTreeMap;

use appended::appended;
use cloth_core::{
    Cloth, GridPatch, MaterialPreset, Model, ModelBuilder, StrainGauge,
    fabric::{BendingSheet, Fabric, FabricSheet, TensileSheet},
};
use cloth_io::{Frame, FrameFormat, FrameSequenceWriter, Topology, TopologyCloth};

/// Stiffness along warp and weft, in shear, and what a stretch of one does to the other \[N/m\].
const WARP: f64 = 800.0;
const WEFT: f64 = 300.0;
const SHEAR: f64 = 40.0;
const COUPLING: f64 = 60.0;

const ARRAYS: [(&str, usize); 6] = [
    ("green_strain", 3),
    ("second_piola_stress", 3),
    ("principal_stretch", 2),
    ("warp", 3),
    ("weft", 3),
    ("cauchy_stress", 6),
];

fn fabric() -> Fabric {
    let sheet = FabricSheet {
        area_density: 0.15,
        tensile: [Some(TensileSheet::Slope(WARP)), Some(TensileSheet::Slope(WEFT))],
        shear: Some(SHEAR),
        coupling: Some(COUPLING),
        bending: [Some(BendingSheet::Rigidity(1e-5)), None, None],
        ..FabricSheet::default()
    };
    sheet.fit("sheet").unwrap().0
}

/// A sheet of fabric in the plane of x, along which its warp lies, and y; before and behind it one of springs.
fn model() -> Model {
    let patch = GridPatch::new([4, 3], 0.1);
    let springs = |name: &str| Cloth::grid(name, patch, &MaterialPreset::DENIM);
    ModelBuilder::new()
        .cloth(springs("first"))
        .cloth(Cloth::fabric("fabric", patch, fabric()))
        .cloth(springs("last"))
        .build()
        .unwrap()
}

fn topology(model: &Model) -> Topology {
    let cloths = model.cloths().iter().map(|cloth| TopologyCloth {
        name: cloth.name.clone(),
        particles: cloth.particles.start as usize..cloth.particles.end as usize,
        triangles: cloth.triangles.start as usize..cloth.triangles.end as usize,
        lines: 0..0,
    });
    Topology {
        triangles: model.triangles().to_vec(),
        particle_count: model.particle_count(),
        cloths: cloths.collect(),
        frames_per_second: 25.0,
        gauge: StrainGauge::new(model),
        ..Topology::default()
    }
}

/// The file of one frame in which all particles went where `motion` takes them.
fn written(model: &Model, motion: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let topology = topology(model);
    let positions: Vec<_> = model.positions().iter().map(|&position| motion(position)).collect();
    let mut writer =
        FrameSequenceWriter::new(FrameFormat::Vtu, folder.path(), "run", &topology).unwrap();
    std::fs::read(writer.write(&Frame::new(0, 0.0, &positions)).unwrap()).unwrap()
}

/// The arrays of every triangle of the fabric; those of springs must have none.
fn cells(model: &Model, bytes: &[u8]) -> Vec<BTreeMap<&'static str, Vec<f64>>> {
    let fabric = &model.cloths()[1].triangles;
    let mut cells = vec![BTreeMap::new(); model.triangles().len()];
    for (name, components) in ARRAYS {
        let numbers = appended(bytes, name).chunks_exact(4);
        let numbers: Vec<f64> =
            numbers.map(|b| f32::from_le_bytes(b.try_into().unwrap()).into()).collect();
        assert_eq!(numbers.len(), components * cells.len(), "{name}");
        for (cell, own) in cells.iter_mut().zip(numbers.chunks_exact(components)) {
            cell.insert(name, own.to_vec());
        }
    }
    let is_fabric = |cell: usize| fabric.contains(&(cell as u32));
    for (number, cell) in cells.iter().enumerate().filter(|(number, _)| !is_fabric(*number)) {
        assert!(cell.values().flatten().all(|x| x.is_nan()), "cell {number} is of springs");
    }
    let own = cells.into_iter().enumerate().filter(|(number, _)| is_fabric(*number));
    own.map(|(_, cell)| cell).collect()
}

#[track_caller]
fn check(cells: &[BTreeMap<&'static str, Vec<f64>>], name: &str, wanted: &[f64]) {
    assert_eq!(cells.len(), 12);
    let scale = wanted.iter().fold(1.0_f64, |largest, x| largest.max(x.abs()));
    for (number, cell) in cells.iter().enumerate() {
        for (found, wanted) in cell[name].iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-6 * scale, "cell {number}: {:?}", cell[name]);
        }
    }
}

#[test]
fn a_stretch_along_the_warp() {
    let model = model();
    let stretch = 1.1;
    let cells = cells(&model, &written(&model, |[x, y, z]| [stretch * x, y, z]));
    let e11 = 0.5 * (stretch * stretch - 1.0);
    let [s11, s22] = [WARP * e11, COUPLING * e11];
    check(&cells, "green_strain", &[e11, 0.0, 0.0]);
    check(&cells, "second_piola_stress", &[s11, s22, 0.0]);
    check(&cells, "principal_stretch", &[stretch, 1.0]);
    check(&cells, "warp", &[stretch, 0.0, 0.0]);
    check(&cells, "weft", &[0.0, 1.0, 0.0]);
    // F S F^T over the area: along the warp stretch^2 / stretch, across it 1 / stretch.
    check(&cells, "cauchy_stress", &[s11 * stretch, s22 / stretch, 0.0, 0.0, 0.0, 0.0]);
}

/// x goes with y, so that the weft leans by the shear: E12 is half of it, and E22 follows as the weft becomes longer.
#[test]
fn a_simple_shear() {
    let model = model();
    let shear = 0.2;
    let cells = cells(&model, &written(&model, |[x, y, z]| [x + shear * y, y, z]));
    let [e22, e12] = [0.5 * shear * shear, 0.5 * shear];
    let [s11, s22, s12] = [COUPLING * e22, WEFT * e22, 2.0 * SHEAR * e12];
    check(&cells, "green_strain", &[0.0, e22, e12]);
    check(&cells, "second_piola_stress", &[s11, s22, s12]);
    check(&cells, "weft", &[shear, 1.0, 0.0]);
    // The area stays; F = [[1, shear], [0, 1]].
    let xx = s11 + 2.0 * shear * s12 + shear * shear * s22;
    let cauchy = [xx, s22, 0.0, s12 + shear * s22, 0.0, 0.0];
    check(&cells, "cauchy_stress", &cauchy);
}

/// Lengthened along one diagonal and shortened along the other by the same share: no normal strain, in first order.
#[test]
fn a_pure_shear() {
    let model = model();
    let angle = 0.1_f64;
    let (cosine, sine) = (angle.cos(), angle.sin());
    // Both threads keep their length and turn towards each other.
    let motion = |[x, y, z]: [f64; 3]| [cosine * x + sine * y, sine * x + cosine * y, z];
    let cells = cells(&model, &written(&model, motion));
    let e12 = sine * cosine;
    check(&cells, "green_strain", &[0.0, 0.0, e12]);
    check(&cells, "second_piola_stress", &[0.0, 0.0, 2.0 * SHEAR * e12]);
    let stretches = [1.0 + 2.0 * e12, 1.0 - 2.0 * e12].map(f64::sqrt);
    check(&cells, "principal_stretch", &stretches);
}

#[test]
fn a_rigid_motion_strains_nothing() {
    let model = model();
    let (cosine, sine) = (0.7_f64.cos(), 0.7_f64.sin());
    // About y, then about z, and away.
    let motion = |[x, y, z]: [f64; 3]| {
        let [x, z] = [cosine * x + sine * z, cosine * z - sine * x];
        [cosine * x - sine * y + 3.0, sine * x + cosine * y - 1.0, z + 2.0]
    };
    let cells = cells(&model, &written(&model, motion));
    check(&cells, "green_strain", &[0.0; 3]);
    check(&cells, "principal_stretch", &[1.0; 2]);
    check(&cells, "warp", &[cosine * cosine, sine * cosine, -sine]);
    check(&cells, "weft", &[-sine, cosine, 0.0]);
    for name in ["green_strain", "second_piola_stress", "cauchy_stress"] {
        let largest =
            cells.iter().flat_map(|cell| &cell[name]).fold(0.0_f64, |m, x| m.max(x.abs()));
        assert!(largest < 1e-10, "{name}: {largest}");
    }
}

/// A uniaxial pull turned in space has its principal stress along the warp, wherever that points.
#[test]
fn stress_in_space_turns_with_the_sheet() {
    let model = model();
    let stretch = 1.05;
    // Stretched along the warp, which then stands upright.
    let cells = cells(&model, &written(&model, |[x, y, z]| [-z, y, stretch * x]));
    let e11 = 0.5 * (stretch * stretch - 1.0);
    check(&cells, "warp", &[0.0, 0.0, stretch]);
    let [along, across] = [WARP * e11 * stretch, COUPLING * e11 / stretch];
    check(&cells, "cauchy_stress", &[0.0, across, along, 0.0, 0.0, 0.0]);
}

#[test]
fn springs_alone_have_no_strain() {
    let patch = GridPatch::new([4, 3], 0.1);
    let springs = Cloth::grid("springs", patch, &MaterialPreset::DENIM);
    let model = ModelBuilder::new().cloth(springs).build().unwrap();
    let bytes = written(&model, |[x, y, z]| [1.2 * x, y, z]);
    let text = String::from_utf8_lossy(&bytes);
    assert!(text.contains("Name=\"cloth\""));
    for (name, _) in ARRAYS {
        assert!(!text.contains(&format!("Name=\"{name}\"")), "{name}");
    }
}

#[test]
fn components_have_names_and_units() {
    let model = model();
    let bytes = written(&model, |position| position);
    let text = String::from_utf8_lossy(&bytes);
    for name in ["E11 warp", "E22 weft", "E12 shear", "S11 warp [N/m]", "S12 shear [N/m]", "XY"] {
        assert!(text.contains(&format!("=\"{name}\"")), "{name}");
    }
}
