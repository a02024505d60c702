//! Renders mesh files, each as a cloth of its own colour, on a floor.
//!
//! `cargo run --release -p cloth-io --example mesh_picture -- PICTURE.png MESH...`; a mesh after
//! `--y-up` is turned from Y-up to Z-up.

use std::error::Error;
use std::path::Path;

use cloth_io::{
    Bounds, Camera, Picture, PictureCloth, PictureScene, PictureShape, PictureStyle, mesh_read,
    picture_palette,
};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let picture = arguments.next().ok_or("name the picture and the meshes")?;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    let mut cloths = Vec::new();
    let mut y_up = false;
    for argument in arguments {
        if argument == "--y-up" {
            y_up = true;
            continue;
        }
        let mesh = mesh_read(Path::new(&argument))?;
        let vertex_start = positions.len() as u32;
        let triangle_start = triangles.len();
        let turned = |[x, y, z]: [f64; 3]| if y_up { [x, -z, y] } else { [x, y, z] };
        positions.extend(mesh.positions.into_iter().map(turned));
        triangles.extend(mesh.triangles.iter().map(|t| t.map(|index| vertex_start + index)));
        let color = picture_palette(cloths.len());
        cloths.push(PictureCloth { triangles: triangle_start..triangles.len(), color });
    }
    let bounds = Bounds::of(&positions);
    let style = PictureStyle::default();
    let floor = PictureShape::Plane { normal: [0.0, 0.0, 1.0], offset: bounds.min[2] };
    let scene = PictureScene {
        positions: &positions,
        triangles: &triangles,
        texture: None,
        cloths,
        shapes: &[floor.into()],
        dust: &[],
        overlays: None,
    };
    let image = Picture::render(&scene, &Camera::fit(&bounds, style.aspect()), &style)?;
    image.save(picture)?;
    Ok(())
}
