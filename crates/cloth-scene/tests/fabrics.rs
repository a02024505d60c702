//! Fabrics that come with the engine, and those of laboratory sheets.

use std::{collections::HashSet, fs, path::Path};

use cloth_core::fabric::{BendingSheet, TensileSheet};
use cloth_scene::{MeasuredFabric, fabric_sheet_read, measured_fabrics};

#[test]
fn every_fabric_has_a_source_and_a_law() {
    let fabrics = measured_fabrics();
    assert!(fabrics.len() >= 40, "{}", fabrics.len());
    let names: HashSet<_> = fabrics.iter().map(|fabric| &fabric.name).collect();
    assert_eq!(names.len(), fabrics.len());
    for fabric in fabrics {
        let (law, report) = fabric.fit().unwrap();
        assert_eq!(law.validate(&fabric.name), Ok(()));
        assert!(fabric.source.url.starts_with("https://doi.org/"), "{}", fabric.name);
        assert!(!report.to_string().is_empty(), "{}", fabric.name);
        // Cloth, and not numbers in other units: known fabrics lie within these.
        assert!((0.01..1.0).contains(&law.area_density), "{}", fabric.name);
        assert!((3e-7..3e-4).contains(&law.bending.warp), "{}", fabric.name);
    }
}

/// The table of the denim by hand: slopes twice c22 and c11, shear c33, a quarter of k_e, the coupling twice c12.
#[test]
fn a_table_of_wang_is_read_as_its_conversion_says() {
    let (denim, _) = MeasuredFabric::find("11oz-black-denim").unwrap().fit().unwrap();
    assert!((denim.warp.linear / (2.0 * 1013.886) - 1.0).abs() < 0.03, "{}", denim.warp.linear);
    assert!((denim.weft.linear / (2.0 * 205.352) - 1.0).abs() < 0.08, "{}", denim.weft.linear);
    assert_eq!(denim.shear, 53.387_184);
    assert!((denim.coupling - 20.468_154).abs() < 1e-9);
    let quarter = |k: f64| 0.25e-6 * k;
    assert_eq!(denim.bending.warp, quarter(64.196_457));
    assert_eq!(denim.bending.weft, quarter(96.951_576));
    assert_eq!(denim.bending.bias, Some(quarter(73.384_567)));
    // Where a line and a cubic cannot follow the table at rest, the report says so.
    let (_, report) = MeasuredFabric::find("navy-sparkle-sweat").unwrap().fit().unwrap();
    assert!(report.to_string().contains("warp at rest is 6.5 N/m in the table"), "{report}");
}

#[test]
fn a_fabric_is_found_or_a_similar_one_is_named() {
    assert_eq!(MeasuredFabric::find("cotton-broad").unwrap().name, "cotton-broad");
    let message = |word| MeasuredFabric::find(word).unwrap_err().to_string();
    assert!(message("coton-broad").contains("did you mean `cotton-broad`?"));
    // Words that people use.
    assert_eq!(MeasuredFabric::find("cotton").unwrap().name, "cotton-broad");
    assert_eq!(MeasuredFabric::find("jeans").unwrap().name, "11oz-black-denim");
    assert!(message("Wool").contains("did you mean `wool`?"));
    let velvet = message("velvet");
    assert!(velvet.contains("200 to 350 g/m^2") && velvet.contains("-denim`"), "{velvet}");
    assert!(message("xyz").contains("`cotton`, `shirt`") && message("xyz").ends_with(" more"));
}

fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder for the test");
    for (name, text) in files {
        fs::write(folder.path().join(name), text).expect("a file for the test");
    }
    folder
}

#[test]
fn a_sheet_is_read_in_the_units_of_its_instruments() {
    let text = "W = 20\nT = 0.5\nG = 1\n2HG = 2\n[warp]\nLT = 0.6\nWT = 10\nEMT = 5\nRT = 60\nB = 0.1\n2HB = 0.05\n\
                [weft]\ncurve = \"weft.csv\"\noverhang = 40\n[bias]\nB = 0.08";
    let curve = "strain,force\n# loading\n0.0, 0.0\n0.05, 100\n0.1, 300\n";
    let place = folder(&[("sheet.toml", text), ("weft.csv", curve)]);
    let sheet = fabric_sheet_read(&place.path().join("sheet.toml")).unwrap();
    assert!((sheet.area_density - 0.2).abs() < 1e-15);
    assert!((sheet.shear.unwrap() - 56.187).abs() < 1e-3);
    assert!((sheet.shear_hysteresis.unwrap() - 1.961_33).abs() < 1e-9);
    assert_eq!(sheet.bending[1], Some(BendingSheet::Overhang(0.04)));
    assert!(matches!(&sheet.tensile[1], Some(TensileSheet::Curve(points)) if points.len() == 3));
    let (fabric, report) = sheet.fit("sheet").unwrap();
    assert!((fabric.bending.bias.unwrap() - 7.845e-6).abs() < 1e-9);
    assert!(report.tension.iter().all(Option::is_some));
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let message = |sheet: &str, curve: &str| {
        let place = folder(&[("sheet.toml", sheet), ("c.csv", curve)]);
        fabric_sheet_read(&place.path().join("sheet.toml")).unwrap_err().to_string()
    };
    let unknown = message("W = 20\nH = 3\n", "");
    assert!(unknown.contains("line 2: unknown field `H`"), "{unknown}");
    let with_curve = "W = 20\n[warp]\ncurve = \"c.csv\"\n";
    let line = message(with_curve, "0, 0\n0.1, ten\n");
    assert!(line.contains("line 2: `0.1, ten`"), "{line}");
    assert!(message("W = 20\n[warp]\nEMT = 5\n", "").contains("give LT"));
    assert!(message("W = 20\n[weft]\nLT = 0.6\nRT = 600\n", "").contains("RT of the weft"));
    assert!(message("W = 20\n[warp]\ncurve = \"no.csv\"\n", "").contains("no.csv"));
    let outside = message("W = 20\n[warp]\ncurve = \"../c.csv\"\n", "");
    assert!(outside.contains("not a plain path"), "{outside}");
    let missing = fabric_sheet_read(Path::new("/nowhere/sheet.toml")).unwrap_err();
    assert!(missing.to_string().contains("check the path"), "{missing}");
}
