//! What pictures show, measured on the pixels.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use cloth::{
    StrainMeasure,
    io::{Camera, Picture, PictureCloth, PictureScene},
    scene::{CompileOptions, Scene, SceneContact, SceneContactResponse, SceneGeometry, SceneModel},
};
use cloth_viewer::{ClipOptions, Gpu, Overlays, Source, Studio};
use image::RgbImage;

const SIZE: [u32; 2] = [320, 180];

fn options(backend: &str, overlays: Overlays) -> ClipOptions {
    ClipOptions {
        size: SIZE,
        overlays: Some(overlays),
        backend: backend.into(),
        frames: None,
        stride: 1,
        still: false,
    }
}

fn drape() -> Scene {
    let mut scene = Scene::builtin("drape").unwrap();
    if let SceneGeometry::Grid(grid) = &mut scene.cloths[0].geometry {
        let coarser = f64::from(grid.columns - 1) / 30.0;
        (grid.columns, grid.rows) = (31, 31);
        grid.spacing = grid.spacing.map(|spacing| spacing * coarser);
    }
    scene
}

fn studio(gpu: &Gpu, backend: &str, overlays: Overlays) -> Studio {
    studio_of(drape(), gpu, backend, overlays)
}

fn studio_of(scene: Scene, gpu: &Gpu, backend: &str, overlays: Overlays) -> Studio {
    let source = Source::Scene(Box::new(scene), CompileOptions::default());
    Studio::new(gpu, source, &options(backend, overlays)).unwrap()
}

/// The same cloth of springs, with contact of points: all that overlays show.
fn drape_of_springs() -> Scene {
    let mut scene = drape();
    scene.cloths[0].model = Some(SceneModel::Springs);
    let response = SceneContactResponse::Impulse { friction: 0.3, restitution: 0.0 };
    scene.contact =
        Some(SceneContact { distance: Some(0.03), response, ..SceneContact::default() });
    scene
}

/// Share of pixels with this property.
fn share(picture: &RgbImage, is: impl Fn([u8; 3]) -> bool) -> f64 {
    let count = picture.pixels().filter(|pixel| is(pixel.0)).count();
    count as f64 / f64::from(picture.width() * picture.height())
}

fn is_red([red, green, blue]: [u8; 3]) -> bool {
    red > 60 && f64::from(red) > 1.8 * f64::from(green) && f64::from(red) > 1.8 * f64::from(blue)
}

fn luminance([red, green, blue]: [u8; 3]) -> f64 {
    0.21 * f64::from(red) + 0.72 * f64::from(green) + 0.07 * f64::from(blue)
}

/// Root of the mean square difference of pixels, after both pictures are blurred: what an eye sees.
fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
    let (a, b) = (image::imageops::blur(a, 1.5), image::imageops::blur(b, 1.5));
    let squares = a.as_raw().iter().zip(b.as_raw());
    let sum: f64 = squares.map(|(&x, &y)| (f64::from(x) - f64::from(y)).powi(2)).sum();
    (sum / a.as_raw().len() as f64).sqrt()
}

#[test]
fn the_cloth_is_where_the_software_renderer_sees_it() {
    let gpu = Gpu::headless(None).unwrap();
    let mut studio = studio(&gpu, "cpu", Overlays::default());
    for _ in 0..12 {
        studio.step().unwrap();
    }
    let seen = studio.picture().unwrap();
    let camera = *studio.camera_mut();
    let engine = studio.engine_mut().unwrap();
    let positions = engine.state().unwrap().positions.clone();
    let mut style = engine.style().clone();
    [style.width, style.height] = SIZE;
    let model = &engine.scene().model;
    let expected = Picture::render(
        &PictureScene {
            positions: &positions,
            triangles: model.triangles(),
            texture: None,
            cloths: vec![PictureCloth {
                triangles: 0..model.triangles().len(),
                color: style.cloth_colors[0],
            }],
            shapes: &style.shapes.at(0.4),
            dust: &[],
            overlays: None,
        },
        &Camera {
            eye: camera.eye(),
            target: camera.target,
            up: [0.0, 0.0, 1.0],
            vertical_field_of_view: camera.vertical_field_of_view,
        },
        &style,
    )
    .unwrap();
    let (mut both, mut either) = (0, 0);
    for (a, b) in seen.pixels().zip(expected.pixels()) {
        both += u32::from(is_red(a.0) && is_red(b.0));
        either += u32::from(is_red(a.0) || is_red(b.0));
    }
    assert!(either > 2000, "{either} pixels of cloth");
    let overlap = f64::from(both) / f64::from(either);
    assert!(overlap > 0.9, "{overlap}");
}

#[test]
fn buffers_of_the_solver_and_uploads_give_the_same_picture() {
    let gpu = Gpu::headless(None).unwrap();
    let picture = |backend| {
        let mut studio = studio(&gpu, backend, Overlays::default());
        for _ in 0..3 {
            studio.step().unwrap();
        }
        studio.picture().unwrap()
    };
    let (shared, uploaded) = (picture("wgpu"), picture("cpu"));
    let found = difference(&shared, &uploaded);
    assert!(found < 1.0, "{found}");
    // The measure tells pictures apart.
    let mut later = studio(&gpu, "cpu", Overlays::default());
    for _ in 0..9 {
        later.step().unwrap();
    }
    let found = difference(&later.picture().unwrap(), &uploaded);
    assert!(found > 2.0, "{found}");
}

/// Pictures that were looked at, made by `cloth render flag --still --frames 3 --picture-size 320x180
/// --backend cpu --overlay strain` and the like; to be made and looked at again when a scene or the
/// look changes. They are of the third frame: from the fifth on the flag ripples, and a millionth more
/// mass puts its ripples elsewhere, as does a sum in another order.
#[test]
fn pictures_are_as_they_were() {
    let gpu = Gpu::headless(None).unwrap();
    let picture = |name: &str, overlays: Overlays| {
        let source = Source::open(name).unwrap();
        let mut studio = Studio::new(&gpu, source, &options("cpu", overlays)).unwrap();
        for _ in 0..3 {
            studio.step().unwrap();
        }
        studio.picture().unwrap()
    };
    let none = Overlays::default();
    let pins = Overlays { pins: true, ..none };
    let wires = Overlays { wires: true, ..pins };
    let strain = Overlays { strain: true, ..none };
    for (name, overlays, others) in [("flag", strain, none), ("curtain", pins, wires)] {
        let golden = format!("{}/tests/golden/{name}.png", env!("CARGO_MANIFEST_DIR"));
        let golden = image::open(golden).unwrap().into_rgb8();
        let found = difference(&picture(name, overlays), &golden);
        let other = difference(&picture(name, others), &golden);
        assert!(found < 0.5, "{name}: {found}");
        assert!(other > 2.5, "{name}: the measure must tell pictures apart, {other}");
    }
}

#[test]
fn the_cloth_throws_a_shadow_on_the_floor() {
    let gpu = Gpu::headless(None).unwrap();
    let mut studio = studio(&gpu, "cpu", Overlays::default());
    for _ in 0..20 {
        studio.step().unwrap();
    }
    let with = studio.picture().unwrap();
    let is_grey = |p: [u8; 3]| p.iter().max().unwrap() - p.iter().min().unwrap() < 30;
    let dark = share(&with, |p| is_grey(p) && luminance(p) < 140.0);
    assert!((0.005..0.3).contains(&dark), "{dark}");
}

/// What has no triangles is seen, too.
#[test]
fn a_rope_is_a_line() {
    let gpu = Gpu::headless(None).unwrap();
    let text = r##"
        name = "rope"
        view = { eye = [0.5, -2, 1], target = [0.5, 0, 0.9] }
        [[cloth]]
        name = "rope"
        colour = "#d01010"
        material = { preset = "jersey", mass.per_particle = 0.01 }
        [cloth.geometry.network]
        width = 3
        positions = [[0, 0, 1], [0.5, 0, 1], [1, 0, 1]]
        prototype = [{ class = "stretch", stiffness = 100, length = 0.5 }]
    "##;
    let scene = Scene::from_toml(text, "rope.toml").unwrap();
    let source = Source::Scene(Box::new(scene), Default::default());
    let mut studio = Studio::new(&gpu, source, &options("cpu", Overlays::default())).unwrap();
    let red = share(&studio.picture().unwrap(), |[r, g, b]| r > 120 && g < 90 && b < 90);
    assert!((0.001..0.05).contains(&red), "{red}");
}

#[test]
fn overlays_change_the_picture_as_they_should() {
    let gpu = Gpu::headless(None).unwrap();
    let picture = |overlays| {
        let mut studio = studio_of(drape_of_springs(), &gpu, "cpu", overlays);
        for _ in 0..12 {
            studio.step().unwrap();
        }
        studio.picture().unwrap()
    };
    let plain = picture(Overlays::default());
    let red = share(&plain, is_red);
    assert!(red > 0.04, "{red}");

    let wires = picture(Overlays { wires: true, ..Overlays::default() });
    let dark = |p: [u8; 3]| luminance(p) < 45.0;
    assert!(share(&wires, dark) > share(&plain, dark) + 0.005);

    // On a long scale nothing is strained, on a short one all is.
    let is_cold = |[r, g, b]: [u8; 3]| u16::from(b) > u16::from(r) + 30 && b > g;
    let strain =
        |strain_scale| picture(Overlays { strain: true, strain_scale, ..Overlays::default() });
    let (cold, hot) = (strain(100.0), strain(1e-3));
    assert!(share(&cold, is_cold) > 0.9 * red, "blue takes the place of the colour");
    assert!(share(&cold, is_red) < 0.02 * red);
    assert!(share(&hot, is_red) > 0.3 * red, "red where springs are longer than at rest");

    let is_blue = |[r, g, b]: [u8; 3]| b > 120 && u16::from(b) > u16::from(r) + 60 && g < 180;
    let springs =
        picture(Overlays { surface: false, springs: [false, true, false], ..Overlays::default() });
    assert!(share(&springs, is_blue) > 0.005, "shear springs are blue");
    assert!(share(&springs, is_red) < 0.1 * red, "the surface is off");

    for overlays in [
        Overlays { contacts: true, ..Overlays::default() },
        Overlays { bins: true, ..Overlays::default() },
    ] {
        assert!(difference(&picture(overlays), &plain) > 0.5, "{overlays:?}");
    }
}

/// The heat map of fabric: blue on a long scale, red where triangles are stretched on a short one.
#[test]
fn strain_of_fabric_is_shown() {
    let gpu = Gpu::headless(None).unwrap();
    let text = "name = 't'\n[simulation]\nframes = 3\nsolver = 'implicit'\n[[cloth]]\nname = 'a'\nmodel = 'fabric'\npins = ['top']\n\
                material.preset = 'jersey'\ngeometry.grid = { columns = 12, rows = 12, spacing = 0.05, row_axis = [0, 0, 1] }\n";
    let picture = |strain_measure, strain_scale| {
        let scene = Scene::from_toml(text, "t.toml").unwrap();
        let standard = Overlays::default();
        let overlays = Overlays { strain: true, strain_measure, strain_scale, ..standard };
        let source = Source::Scene(Box::new(scene), CompileOptions::default());
        let mut studio = Studio::new(&gpu, source, &options("cpu", overlays)).unwrap();
        (0..3).for_each(|_| studio.step().unwrap());
        studio.picture().unwrap()
    };
    let is_cold = |[r, g, b]: [u8; 3]| u16::from(b) > u16::from(r) + 30 && b > g;
    let [stretch, weft] = [StrainMeasure::Stretch, StrainMeasure::Weft];
    let (cold, hot) = (picture(stretch, 100.0), picture(stretch, 1e-3));
    assert!(share(&hot, is_red) > share(&cold, is_red) + 0.01, "{}", share(&hot, is_red));
    assert!(share(&cold, is_cold) > share(&hot, is_cold));
    // Its own weight stretches it along the weft, not along the warp.
    let red = |measure| share(&picture(measure, 1e-3), is_red);
    let [along, across] = [weft, StrainMeasure::Warp].map(red);
    assert!(along > across + 0.01, "{along} {across}");
}

/// Lines along warp and weft are on the cloth and nowhere else, and change places when the pattern is turned by a quarter.
#[test]
fn threads_of_fabric_are_shown() {
    let gpu = Gpu::headless(None).unwrap();
    let picture = |warp: u32, threads: bool, model: &str| {
        let text = format!(
            "view = {{ eye = [0, -2.2, 0], target = [0, 0, 0] }}\n[[cloth]]\nmodel = '{model}'\nmaterial.preset = 'jersey'\n{}\
             geometry.grid = {{ columns = 11, rows = 11, size = [1, 1], row_axis = [0, 0, 1], centre = [0, 0, 0] }}\n",
            if model == "fabric" { format!("pattern.warp = {warp}\n") } else { String::new() }
        );
        let scene = Scene::from_toml(&text, "t.toml").unwrap();
        studio_of(scene, &gpu, "cpu", Overlays { threads, ..Overlays::default() })
            .picture()
            .unwrap()
    };
    let plain = picture(0, false, "fabric");
    // Darker or lighter than without, and what is neither.
    let seen = |drawn: &RgbImage| -> Vec<i32> {
        let change = |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| luminance(b.0) - luminance(a.0);
        let sign = |x: f64| if x < -15.0 { -1 } else { i32::from(x > 15.0) };
        plain.pixels().zip(drawn.pixels()).map(change).map(sign).collect()
    };
    let [straight, turned] = [0, 90].map(|warp| picture(warp, true, "fabric"));
    for ((x, y, before), after) in plain.enumerate_pixels().zip(straight.pixels()) {
        // The legend is in a corner.
        let may_change = (80..240).contains(&x) || x < 110 && y > 130;
        assert!(may_change || before == after, "{x}, {y}");
    }
    let [straight, turned] = [seen(&straight), seen(&turned)];
    let inside = |number: &usize| (100..220).contains(&(number % SIZE[0] as usize));
    for sign in [-1, 1] {
        let of = |pixels: &[i32], wanted: i32| -> Vec<usize> {
            (0..pixels.len()).filter(inside).filter(|&number| pixels[number] == wanted).collect()
        };
        let (here, there) = (of(&straight, sign), of(&turned, -sign));
        assert!(here.len() > 300, "{} pixels of threads", here.len());
        // Crossings are light in both.
        let fewer = here.len().min(there.len());
        let both = here.iter().filter(|number| there.contains(number)).count();
        assert!(both as f64 > 0.8 * fewer as f64, "{both} of {} and {}", here.len(), there.len());
    }
    // Threads of the warp run sideways: a row between them has dark pixels nowhere.
    let rows = straight.chunks(SIZE[0] as usize).skip(70).take(20);
    let darks = rows.map(|row| row[100..220].iter().filter(|&&sign| sign == -1).count());
    let (least, most) = (darks.clone().min().unwrap(), darks.max().unwrap());
    assert!(least < 10 && most > 60, "{least} {most}");
    assert_eq!(picture(0, false, "springs"), picture(0, true, "springs"), "springs have none");
}

/// What a scene says of its pictures holds for clips unless somebody says otherwise.
#[test]
fn a_scene_says_what_its_pictures_show() {
    let gpu = Gpu::headless(None).unwrap();
    let picture = |view: &str, overlays: Option<Overlays>| {
        let text = format!(
            "view = {{ eye = [0, -2.2, 0], target = [0, 0, 0]{view} }}\n[[cloth]]\nmodel = 'fabric'\nmaterial.preset = 'jersey'\n\
             geometry.grid = {{ columns = 11, rows = 11, size = [1, 1], row_axis = [0, 0, 1], centre = [0, 0, 0] }}\n"
        );
        let scene = Scene::from_toml(&text, "t.toml").unwrap();
        let source = Source::Scene(Box::new(scene), CompileOptions::default());
        let options = ClipOptions { overlays, ..options("cpu", Overlays::default()) };
        Studio::new(&gpu, source, &options).unwrap().picture().unwrap()
    };
    let all = Overlays { strain: true, strain_scale: 0.02, threads: true, ..Overlays::default() };
    let of_scene = picture(", strain = 0.02, threads = true", None);
    assert_eq!(of_scene, picture("", Some(all)));
    let plain = picture("", None);
    assert_ne!(of_scene, plain);
    assert_eq!(picture(", threads = true", Some(Overlays::default())), plain);
}

#[test]
fn sizes_that_cannot_be_are_refused() {
    let gpu = Gpu::headless(None).unwrap();
    for size in [[0, 9], [9, 0], [100_000, 9]] {
        let source = Source::Scene(Box::new(drape()), CompileOptions::default());
        let options = ClipOptions { size, ..options("cpu", Overlays::default()) };
        let message = Studio::new(&gpu, source, &options).err().unwrap().to_string();
        assert!(message.contains("cannot be drawn"), "{message}");
    }
}
