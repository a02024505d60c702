//! Heat map and threads in pictures change the pixels that they should, and no others.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use cloth_core::{
    Cloth, GridPatch, MaterialPreset, Model, ModelBuilder, RestSource, StrainMeasure, TextureMap,
    TriangleMesh,
    fabric::{BendingSheet, Fabric, FabricSheet, TensileSheet},
};
use cloth_io::{
    Camera, Picture, PictureCloth, PictureError, PictureOverlays, PictureScene, PictureStyle,
    StrainMap,
};
use image::RgbImage;

const SIZE: [u32; 2] = [400, 300];
/// Vertices along a side of the sheet, of 1 m.
const SIDE: u32 = 9;

fn fabric() -> Fabric {
    let sheet = FabricSheet {
        area_density: 0.15,
        tensile: [Some(TensileSheet::Slope(800.0)), Some(TensileSheet::Slope(300.0))],
        shear: Some(40.0),
        bending: [Some(BendingSheet::Rigidity(1e-5)), None, None],
        ..FabricSheet::default()
    };
    sheet.fit("sheet").unwrap().0
}

fn patch() -> GridPatch {
    GridPatch::new([SIDE, SIDE], 1.0 / f64::from(SIDE - 1))
}

/// A square sheet around the origin along x and y, its pattern turned by so many quarters.
fn sheet(quarters: u32) -> Model {
    let plain = ModelBuilder::new().cloth(Cloth::fabric("a", patch(), fabric())).build().unwrap();
    let turned = |&[x, y, _]: &[f64; 3]| (0..quarters).fold([x, y], |[u, v], _| [v, -u]);
    let mesh = TriangleMesh {
        positions: plain.positions().to_vec(),
        triangles: plain.triangles().to_vec(),
        texture: Some(TextureMap {
            coordinates: plain.positions().iter().map(turned).collect(),
            triangles: plain.triangles().to_vec(),
        }),
        ..TriangleMesh::default()
    };
    let rest = RestSource::Pattern { scale: 1.0 };
    let cloth = Cloth::fabric_mesh("a", mesh, fabric(), rest);
    ModelBuilder::new().cloth(cloth).build().unwrap()
}

/// Seen from above, with x to the right and y upward.
fn style() -> (Camera, PictureStyle) {
    let camera = Camera {
        eye: [0.0, 0.0, 4.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        vertical_field_of_view: 0.35,
    };
    let [width, height] = SIZE;
    (camera, PictureStyle { width, height, ..PictureStyle::default() })
}

fn render(
    model: &Model,
    positions: &[[f64; 3]],
    overlays: Option<&PictureOverlays>,
) -> Result<RgbImage, PictureError> {
    let cloths = model.cloths().iter().map(|cloth| PictureCloth {
        triangles: cloth.triangles.start as usize..cloth.triangles.end as usize,
        color: [196, 58, 62],
    });
    let scene = PictureScene {
        positions,
        triangles: model.triangles(),
        texture: None,
        cloths: cloths.collect(),
        shapes: &[],
        dust: &[],
        overlays,
    };
    let (camera, style) = style();
    Picture::render(&scene, &camera, &style)
}

fn luminance(image: &RgbImage, x: u32, y: u32) -> f64 {
    let [red, green, blue] = image.get_pixel(x, y).0.map(f64::from);
    0.21 * red + 0.72 * green + 0.07 * blue
}

/// Pixels of the cloth of a picture without anything on it.
fn is_red([red, green, blue]: [u8; 3]) -> bool {
    u16::from(red) > u16::from(green) + 60 && u16::from(red) > u16::from(blue) + 60
}

fn is_blue([red, green, blue]: [u8; 3]) -> bool {
    u16::from(blue) > u16::from(red) + 40 && blue > green
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Thread {
    None,
    Dark,
    Light,
}

/// What is seen at each pixel, told from the picture without threads.
fn threads(plain: &RgbImage, drawn: &RgbImage) -> Vec<Thread> {
    let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| match luminance(drawn, x, y) - luminance(plain, x, y) {
            change if change < -20.0 => Thread::Dark,
            change if change > 20.0 => Thread::Light,
            _ => Thread::None,
        })
        .collect()
}

fn with_threads(model: &Model) -> (RgbImage, RgbImage) {
    let overlays = PictureOverlays::new(model, None, true);
    let plain = render(model, model.positions(), None).unwrap();
    (plain, render(model, model.positions(), Some(&overlays)).unwrap())
}

#[test]
fn threads_are_lines_on_the_cloth_and_nowhere_else() {
    let model = sheet(0);
    let (plain, drawn) = with_threads(&model);
    let found = threads(&plain, &drawn);
    let (mut on_cloth, mut same) = (0, 0);
    for ((x, y, before), after) in plain.enumerate_pixels().zip(drawn.pixels()) {
        let is_cloth = is_red(before.0);
        assert!(is_cloth || before == after, "{x}, {y} is not of the cloth");
        on_cloth += u32::from(is_cloth);
        same += u32::from(is_cloth && before == after);
    }
    assert!(on_cloth > 20_000, "{on_cloth}");
    let share = f64::from(same) / f64::from(on_cloth);
    assert!((0.4..0.9).contains(&share), "between the threads the cloth is as it was: {share}");
    // 20 of each, 5 cm apart: the colour changes twice at each that is crossed.
    let count = |thread: Thread, line: &mut dyn Iterator<Item = u32>| {
        let seen: Vec<bool> = line.map(|place| found[place as usize] == thread).collect();
        seen.windows(2).filter(|pair| !pair[0] && pair[1]).count()
    };
    let [width, height] = SIZE;
    // Beside the middle, which lies between two threads.
    let (row, column) = (height / 2, width / 2);
    let most = |thread, is_row: bool| {
        let lines = (0..8).map(|beside| {
            if is_row {
                count(thread, &mut (0..width).map(|x| (row + beside) * width + x))
            } else {
                count(thread, &mut (0..height).map(|y| y * width + column + beside))
            }
        });
        lines.max().unwrap()
    };
    assert_eq!(most(Thread::Light, true), 20, "the weft runs upward");
    assert_eq!(most(Thread::Dark, false), 20, "the warp runs sideways");
}

#[test]
fn a_pattern_turned_by_a_quarter_exchanges_warp_and_weft() {
    let seen = [0, 1].map(|quarters| {
        let (plain, drawn) = with_threads(&sheet(quarters));
        threads(&plain, &drawn)
    });
    for [one, other] in [[0, 1], [1, 0]] {
        let dark = seen[one].iter().zip(&seen[other]).filter(|(a, _)| **a == Thread::Dark);
        let (mut all, mut light) = (0, 0);
        for (_, there) in dark {
            all += 1;
            light += u32::from(*there == Thread::Light);
        }
        assert!(all > 1000, "{all}");
        assert!(f64::from(light) > 0.97 * f64::from(all), "{light} of {all}");
    }
    // Half a turn leaves all as it was.
    let (plain, drawn) = with_threads(&sheet(2));
    let turned = threads(&plain, &drawn);
    let differ = turned.iter().zip(&seen[0]).filter(|(a, b)| a != b).count();
    assert!(differ < 200, "{differ}");
}

/// Stretched along x, the threads along y part and the others stay.
#[test]
fn threads_go_with_the_cloth() {
    let model = sheet(0);
    let overlays = PictureOverlays::new(&model, None, true);
    let positions: Vec<_> = model.positions().iter().map(|&[x, y, z]| [1.2 * x, y, z]).collect();
    let starts = |positions: &[[f64; 3]]| {
        let plain = render(&model, positions, None).unwrap();
        let found = threads(&plain, &render(&model, positions, Some(&overlays)).unwrap());
        // A row between two threads of the warp.
        let rows = (0..10).map(|beside| {
            let start = ((SIZE[1] / 2 + beside) * SIZE[0]) as usize;
            let row = &found[start..start + SIZE[0] as usize];
            let starts =
                (1..row.len()).filter(|&x| row[x] == Thread::Light && row[x - 1] != Thread::Light);
            starts.collect::<Vec<usize>>()
        });
        rows.max_by_key(Vec::len).unwrap()
    };
    let (before, after) = (starts(model.positions()), starts(&positions));
    assert_eq!((before.len(), after.len()), (20, 20));
    let [before, after] = [before, after].map(|places| (places[19] - places[0]) as f64);
    assert!((after / before - 1.2).abs() < 0.02, "{before} {after}");
}

#[test]
fn the_heat_map_shows_where_cloth_is_stretched() {
    let model = sheet(0);
    // The right half by 12 %.
    let stretched = |&[x, y, z]: &[f64; 3]| [x + 0.12 * x.max(0.0), y, z];
    let positions: Vec<_> = model.positions().iter().map(stretched).collect();
    let plain = render(&model, &positions, None).unwrap();
    let drawn = |scale| {
        let overlays = PictureOverlays::new(&model, Some((StrainMeasure::Stretch, scale)), false);
        render(&model, &positions, Some(&overlays)).unwrap()
    };
    let (hot, cold) = (drawn(0.1), drawn(10.0));
    let mut cloth = 0;
    for (x, y, before) in plain.enumerate_pixels() {
        let (hot, cold) = (hot.get_pixel(x, y).0, cold.get_pixel(x, y).0);
        if !is_red(before.0) {
            assert!(before.0 == hot && before.0 == cold, "{x}, {y} is not of the cloth");
            continue;
        }
        cloth += 1;
        // Away from the triangles around the middle and from the border.
        if (80..180).contains(&x) && (60..240).contains(&y) {
            assert!(is_blue(hot), "{x}, {y}: {hot:?}");
        }
        if (225..310).contains(&x) && (60..240).contains(&y) {
            assert!(is_red(hot), "{x}, {y}: {hot:?}");
            assert!(is_blue(cold), "{x}, {y}: {cold:?}");
        }
    }
    assert!(cloth > 20_000, "{cloth}");
    let green = drawn(0.24).get_pixel(260, 150).0;
    assert!(green[1] > green[0] && green[1] > green[2], "half of the scale: {green:?}");
}

/// Overlays of the second cloth are on the second cloth, also where it alone is drawn.
#[test]
fn each_triangle_has_its_own_threads() {
    let apart = GridPatch { origin: [1.5, 0.0, 0.0], ..patch() };
    let model = ModelBuilder::new()
        .cloth(Cloth::grid("springs", apart, &MaterialPreset::DENIM))
        .cloth(Cloth::fabric("fabric", patch(), fabric()))
        .build()
        .unwrap();
    let overlays = PictureOverlays::new(&model, None, true);
    let second = &model.cloths()[1].triangles;
    let (camera, style) = style();
    let scene = PictureScene {
        positions: model.positions(),
        triangles: model.triangles(),
        texture: None,
        cloths: vec![PictureCloth {
            triangles: second.start as usize..second.end as usize,
            color: [196, 58, 62],
        }],
        shapes: &[],
        dust: &[],
        overlays: Some(&overlays),
    };
    let alone = Picture::render(&scene, &camera, &style).unwrap();
    let (_, wanted) = with_threads(&sheet(0));
    let differ = alone.pixels().zip(wanted.pixels()).filter(|(a, b)| a != b).count();
    assert!(differ < 50, "{differ}");
}

#[test]
fn springs_have_strain_and_no_threads() {
    let springs = Cloth::grid("springs", patch(), &MaterialPreset::DENIM);
    let model = ModelBuilder::new().cloth(springs).build().unwrap();
    let (plain, drawn) = with_threads(&model);
    assert_eq!(plain, drawn);
    let overlays = PictureOverlays::new(&model, Some((StrainMeasure::Stretch, 0.1)), false);
    let cold = render(&model, model.positions(), Some(&overlays)).unwrap();
    assert!(is_blue(cold.get_pixel(200, 150).0));
}

#[test]
fn overlays_of_another_model_are_refused() {
    let model = sheet(0);
    let finer = GridPatch::new([2 * SIDE, SIDE], 0.1);
    let other = ModelBuilder::new().cloth(Cloth::fabric("b", finer, fabric())).build().unwrap();
    for (strain, threads) in [(Some((StrainMeasure::Stretch, 0.1)), false), (None, true)] {
        let overlays = PictureOverlays::new(&other, strain, threads);
        let outcome = render(&model, model.positions(), Some(&overlays));
        assert_eq!(outcome.unwrap_err(), PictureError::Overlays);
    }
}

#[test]
fn each_strain_of_fabric_is_shown_alone() {
    let cloth = Cloth::fabric("a", GridPatch::new([4, 4], 0.1), fabric());
    let model = ModelBuilder::new().cloth(cloth).build().unwrap();
    let map = StrainMap::new(&model);
    // F = [[1.1, .2], [0, .8]].
    let strained: Vec<_> =
        model.positions().iter().map(|&[x, y, z]| [1.1 * x + 0.2 * y, 0.8 * y, z]).collect();
    let green = [0.5 * (1.21 - 1.0), 0.5 * (1.0 - 0.04 - 0.64), 0.5 * 1.1 * 0.2];
    let measures = [StrainMeasure::Warp, StrainMeasure::Weft, StrainMeasure::Shear];
    for (measure, expected) in measures.into_iter().zip(green) {
        for strain in map.at_particles(&strained, measure) {
            assert!((strain - expected).abs() < 1e-9, "{measure:?}: {strain} for {expected}");
        }
    }
}
