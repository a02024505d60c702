//! Writes a frame as binary PLY.

use std::io::{self, Write};

use ply_rs_bw::ply::{
    Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;

use super::{Frame, Topology};

/// Writes positions \[m\], normals and faces, little endian. Texture coordinates are written if no
/// particle has two of them: the format has no texture seams.
pub(crate) fn ply_write(
    writer: &mut impl Write,
    topology: &Topology,
    frame: &Frame<'_>,
) -> io::Result<()> {
    let normals = frame.normals_or_computed(&topology.triangles);
    let texture = topology.texture_of_particles();

    let mut vertex = ElementDef::new("vertex".to_owned());
    vertex.count = frame.positions.len();
    let names = ["x", "y", "z", "nx", "ny", "nz", "s", "t"];
    let name_count = if texture.is_some() { 8 } else { 6 };
    for name in &names[..name_count] {
        let float = PropertyType::Scalar(ScalarType::Float);
        vertex.properties.add(PropertyDef::new((*name).to_owned(), float));
    }
    let mut face = ElementDef::new("face".to_owned());
    face.count = topology.triangles.len();
    let list = PropertyType::List(ScalarType::UChar, ScalarType::Int);
    face.properties.add(PropertyDef::new("vertex_indices".to_owned(), list));

    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.comments.push(format!("time {} s", frame.time));
    header.elements.add(vertex.clone());
    header.elements.add(face.clone());

    let elements = Writer::new();
    elements.write_header(writer, &header)?;
    for (particle, position) in frame.positions.iter().enumerate() {
        let values = PlyElement::Vertex {
            position: *position,
            normal: normals[particle],
            texture: texture.as_ref().map_or([0.0; 2], |texture| texture[particle]),
        };
        elements.write_little_endian_element(writer, &values, &vertex)?;
    }
    for triangle in &topology.triangles {
        let values = PlyElement::Face(triangle.map(|index| index as i32));
        elements.write_little_endian_element(writer, &values, &face)?;
    }
    Ok(())
}

enum PlyElement {
    Vertex { position: [f64; 3], normal: [f64; 3], texture: [f64; 2] },
    Face([i32; 3]),
}

impl PropertyAccess for PlyElement {
    fn new() -> Self {
        Self::Face([0; 3])
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        let Self::Vertex { position, normal, texture } = self else {
            return None;
        };
        let value = match name {
            "x" => position[0],
            "y" => position[1],
            "z" => position[2],
            "nx" => normal[0],
            "ny" => normal[1],
            "nz" => normal[2],
            "s" => texture[0],
            "t" => texture[1],
            _ => return None,
        };
        Some(value as f32)
    }

    fn get_list_int(&self, _name: &str) -> Option<&[i32]> {
        match self {
            Self::Face(triangle) => Some(triangle),
            Self::Vertex { .. } => None,
        }
    }
}
