//! Pictures show what is in the scene, where it is.

use cloth_io::{
    Bounds, Camera, Picture, PictureCloth, PictureError, PictureScene, PictureShape, PictureSolid,
    PictureStyle,
};
use image::{Rgb, RgbImage};
use proptest::prelude::*;

/// A camera that looks from the front at a scene of 2 m.
fn camera() -> Camera {
    Camera {
        eye: [0.0, -4.0, 0.0],
        target: [0.0; 3],
        up: [0.0, 0.0, 1.0],
        vertical_field_of_view: 0.6,
    }
}

const STYLE: (u32, u32) = (120, 80);

fn style() -> PictureStyle {
    PictureStyle { width: STYLE.0, height: STYLE.1, ..PictureStyle::default() }
}

/// A square cloth of 1 m that faces the camera, red, at distance `depth` behind the target.
fn square(depth: f64) -> Vec<[f64; 3]> {
    [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[x, z]| [x, depth, z]).to_vec()
}

const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn render(positions: &[[f64; 3]], shapes: &[PictureSolid]) -> Result<RgbImage, PictureError> {
    let cloths = vec![PictureCloth { triangles: 0..2, color: [200, 20, 20] }];
    let scene = PictureScene {
        positions,
        triangles: &TRIANGLES,
        texture: None,
        cloths,
        shapes,
        dust: &[],
        overlays: None,
    };
    Picture::render(&scene, &camera(), &style())
}

fn is_red(pixel: &Rgb<u8>) -> bool {
    i32::from(pixel[0]) > i32::from(pixel[1]) + 50
}

#[test]
fn cloth_covers_the_pixels_that_it_should() {
    let image = render(&square(0.0), &[]).unwrap();
    // 1 m at 4 m with a field of view of 2 tan(0.3) 4 m = 2.475 m across 80 pixels.
    let expected = (80.0f64 / 2.475).powi(2);
    let red = image.pixels().filter(|pixel| is_red(pixel)).count() as f64;
    assert!((red / expected - 1.0).abs() < 0.1, "{red} pixels instead of {expected}");
    assert!(is_red(image.get_pixel(60, 40)));
    assert!(!is_red(image.get_pixel(20, 40)));
}

#[test]
fn the_nearer_surface_hides_the_other() {
    let sphere =
        |y: f64| PictureSolid::from(PictureShape::Sphere { center: [0.0, y, 0.0], radius: 0.2 });
    let hidden = render(&square(0.0), &[sphere(0.5)]).unwrap();
    assert!(is_red(hidden.get_pixel(60, 40)));
    let seen = render(&square(0.0), &[sphere(-0.5)]).unwrap();
    assert!(!is_red(seen.get_pixel(60, 40)));
    assert!(is_red(seen.get_pixel(48, 28)));
}

#[test]
fn solids_have_the_colour_that_they_are_given() {
    let shape = PictureShape::Sphere { center: [0.0, -0.5, 0.0], radius: 0.2 };
    let pixel = |color| {
        let solid = PictureSolid { shape: shape.clone(), color };
        let [red, green, blue] = render(&square(0.0), &[solid]).unwrap().get_pixel(60, 40).0;
        [red, green, blue].map(i32::from)
    };
    let [red, green, blue] = pixel(Some([20, 40, 200]));
    assert!(blue > green + 50 && green > red, "{red} {green} {blue}");
    let grey = pixel(None);
    assert!(grey.iter().max().unwrap() - grey.iter().min().unwrap() < 30, "{grey:?}");
}

#[test]
fn the_floor_is_below_the_horizon_and_receives_shadow() {
    let floor = PictureSolid::from(PictureShape::Plane { normal: [0.0, 0.0, 1.0], offset: -0.55 });
    let with_floor = render(&square(0.0), std::slice::from_ref(&floor)).unwrap();
    let without = render(&square(0.0), &[]).unwrap();
    let row = |image: &RgbImage, y: u32| -> Vec<Rgb<u8>> {
        (0..STYLE.0).map(|x| *image.get_pixel(x, y)).collect()
    };
    assert_eq!(row(&with_floor, 2), row(&without, 2), "sky");
    assert_ne!(row(&with_floor, 75), row(&without, 75), "floor");
    // The light comes over the left shoulder: the shadow lies behind the cloth, to the right.
    let open = render(&square(100.0), &[floor]).unwrap();
    let darker = |x: u32, y: u32| {
        i32::from(open.get_pixel(x, y)[1]) - i32::from(with_floor.get_pixel(x, y)[1]) > 15
    };
    let shadowed = (0..STYLE.0).flat_map(|x| (40..STYLE.1).map(move |y| (x, y)));
    let shadowed: Vec<_> =
        shadowed.filter(|&(x, y)| !is_red(with_floor.get_pixel(x, y)) && darker(x, y)).collect();
    let right = shadowed.iter().filter(|(x, _)| *x > 60).count();
    assert!(right > 20 && 2 * right > shadowed.len(), "{right} of {}", shadowed.len());
}

/// The size of the tiles used to follow that of everything in the picture, so that they grew and
/// shrank while the cloth moved.
#[test]
fn the_floor_keeps_its_tiles_while_the_cloth_moves() {
    let floor = PictureSolid::from(PictureShape::Plane { normal: [0.0, 0.0, 1.0], offset: -0.55 });
    let camera = Camera { eye: [0.0, -4.0, 1.5], ..camera() };
    let with_cloth_of = |scale: f64, shift: f64| {
        let positions: Vec<_> = square(0.0)
            .iter()
            .map(|p| [scale * p[0] + shift, scale * p[1], scale * p[2]])
            .collect();
        let cloths = vec![PictureCloth { triangles: 0..2, color: [200, 20, 20] }];
        let shapes = std::slice::from_ref(&floor);
        let scene = PictureScene {
            positions: &positions,
            triangles: &TRIANGLES,
            texture: None,
            cloths,
            shapes,
            dust: &[],
            overlays: None,
        };
        Picture::render(&scene, &camera, &style()).unwrap()
    };
    let first = with_cloth_of(0.4, 0.0);
    let mut shades = Vec::new();
    for next in [with_cloth_of(0.9, 0.0), with_cloth_of(0.15, 0.3)] {
        // Beside the cloth and its shadow, where soft shadows change a little and tiles would a lot.
        for (x, y) in (0..20).flat_map(|x| (60..STYLE.1).map(move |y| (x, y))) {
            let (a, b) = (first.get_pixel(x, y)[1], next.get_pixel(x, y)[1]);
            assert!(a.abs_diff(b) < 6, "pixel {x}, {y}: {a} and {b}");
            shades.push(a);
        }
    }
    let contrast = shades.iter().max().unwrap() - shades.iter().min().unwrap();
    assert!(contrast > 10, "there are tiles: {contrast}");
}

#[test]
fn front_and_back_of_a_cloth_differ() {
    let front = render(&square(0.0), &[]).unwrap();
    let mut turned = square(0.0);
    turned.swap(1, 3);
    let back = render(&turned, &[]).unwrap();
    assert_ne!(front.get_pixel(60, 40), back.get_pixel(60, 40));
}

#[test]
fn parts_behind_the_camera_are_cut_off() {
    let mut positions = square(0.0);
    positions[2] = [0.5, -50.0, 0.5];
    let image = render(&positions, &[]).unwrap();
    // The cloth now passes below the camera.
    assert!(is_red(image.get_pixel(60, 70)), "{:?}", image.get_pixel(60, 70));
    assert!(!is_red(image.get_pixel(100, 20)));
}

#[test]
fn scenes_far_from_the_origin_look_the_same() {
    let offset = 1e6;
    let near = render(&square(0.0), &[]).unwrap();
    let positions: Vec<_> = square(0.0).iter().map(|[x, y, z]| [x + offset, *y, *z]).collect();
    let mut camera = camera();
    camera.eye[0] += offset;
    camera.target[0] += offset;
    let cloths = vec![PictureCloth { triangles: 0..2, color: [200, 20, 20] }];
    let scene = PictureScene {
        positions: &positions,
        triangles: &TRIANGLES,
        texture: None,
        cloths,
        shapes: &[],
        dust: &[],
        overlays: None,
    };
    let far = Picture::render(&scene, &camera, &style()).unwrap();
    let different = near.pixels().zip(far.pixels()).filter(|(a, b)| a != b).count();
    assert!(different < 20, "{different} pixels differ");
}

#[test]
fn fitted_cameras_show_the_whole_box() {
    let bounds = Bounds { min: [1.0, 2.0, 3.0], max: [2.0, 2.5, 6.0] };
    for aspect in [0.5, 1.0, 1.78] {
        let camera = Camera::fit(&bounds, aspect);
        let eye = glam::DVec3::from(camera.eye);
        let forward = (glam::DVec3::from(camera.target) - eye).normalize();
        let right = forward.cross(glam::DVec3::Z).normalize();
        let up = right.cross(forward);
        let slope = (0.5 * camera.vertical_field_of_view).tan();
        let mut largest = 0.0f64;
        for corner in 0..8 {
            let side = |axis: usize| {
                if corner >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] }
            };
            let ray = glam::DVec3::new(side(0), side(1), side(2)) - eye;
            let depth = ray.dot(forward);
            largest = largest.max(ray.dot(up).abs() / depth / slope);
            largest = largest.max(ray.dot(right).abs() / depth / slope / aspect);
        }
        assert!((0.7..1.0).contains(&largest), "{aspect}: {largest}");
    }
}

#[test]
fn impossible_pictures_are_refused() {
    let mut bad = square(0.0);
    bad[3][1] = f64::NAN;
    assert_eq!(render(&bad, &[]).unwrap_err(), PictureError::Position { particle: 3 });
    assert!(matches!(render(&square(0.0)[..3], &[]), Err(PictureError::Index { triangle: 1 })));
    let positions = square(0.0);
    let scene = PictureScene {
        positions: &positions,
        triangles: &TRIANGLES,
        texture: None,
        cloths: Vec::new(),
        shapes: &[],
        dust: &[],
        overlays: None,
    };
    let sized = |width| PictureStyle { width, ..style() };
    for width in [0, 10_000_000] {
        let refused = Picture::render(&scene, &camera(), &sized(width));
        assert!(matches!(refused, Err(PictureError::Size { .. })));
    }
    for camera in [
        Camera { eye: [0.0; 3], ..camera() },
        Camera { up: [0.0, 1.0, 0.0], ..camera() },
        Camera { vertical_field_of_view: 0.0, ..camera() },
        Camera { target: [f64::NAN; 3], ..camera() },
    ] {
        let refused = Picture::render(&scene, &camera, &style());
        assert!(matches!(refused, Err(PictureError::Camera { .. })), "{camera:?}");
    }
    assert!(Picture::render(&scene, &camera(), &style()).is_ok(), "an empty scene is a picture");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Extreme scenes give a picture or an error, never a panic.
    #[test]
    fn extreme_scenes_do_not_panic(
        numbers in prop::collection::vec(
            prop::sample::select(vec![
                0.0, -0.0, 1.0, -1.0, 0.5, 1e-30, 1e-300, 1e6, -1e9, 1e18, -1e37, 1e39, 1e300,
            ]),
            24,
        ),
        fitted in any::<bool>(),
    ) {
        let positions: Vec<[f64; 3]> =
            numbers[..12].chunks(3).map(|p| [p[0], p[1], p[2]]).collect();
        let point = |start: usize| [numbers[start], numbers[start + 1], numbers[start + 2]];
        let shapes = [
            PictureShape::Plane { normal: point(12), offset: numbers[15] }.into(),
            PictureShape::Capsule { a: point(16), b: point(19), radius: numbers[22] }.into(),
        ];
        let camera = if fitted { Camera::fit(&Bounds::of(&positions), 1.5) } else { camera() };
        let cloths = vec![PictureCloth { triangles: 0..2, color: [200, 20, 20] }];
        let scene = PictureScene {
            positions: &positions,
            triangles: &TRIANGLES,
            texture: None,
            cloths,
            shapes: &shapes,
            dust: &[],
            overlays: None,
        };
        let small = PictureStyle { width: 24, height: 16, ..PictureStyle::default() };
        if let Ok(image) = Picture::render(&scene, &camera, &small) {
            prop_assert_eq!(image.dimensions(), (24, 16));
        }
    }
}
