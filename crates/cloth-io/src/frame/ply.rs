//! Writes a frame as binary PLY.

use std::io::{self, Write};

use ply_rs_bw::ply::{
    Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;

use super::{Frame, Topology};

/// Names of the numbers of a vertex; texture coordinates come last.
const VERTEX_NUMBERS: [&str; 8] = ["x", "y", "z", "nx", "ny", "nz", "s", "t"];

/// Writes positions \[m\], normals, the number of the cloth of each particle, faces and, if there are
/// any, lines as edges; little endian. Texture coordinates are written if no particle has two of them:
/// the format has no texture seams. Comments give the time and the names of the cloths.
pub(crate) fn ply_write(
    writer: &mut impl Write,
    topology: &Topology,
    frame: &Frame<'_>,
) -> io::Result<()> {
    let mut comments = vec![
        format!("time {} s", frame.time),
        format!("{} frames per second", topology.frames_per_second),
    ];
    for (number, cloth) in topology.cloths.iter().enumerate() {
        // A line break in a name would begin a new statement.
        comments.push(format!("cloth {number} {}", cloth.name.replace(char::is_control, " ")));
    }
    let cloths = (0..).zip(&topology.cloths);
    let cloths = cloths.flat_map(|(number, cloth)| cloth.particles.clone().map(move |_| number));
    let cloths = Column::Integer("cloth", cloths.collect());
    ply_write_with(writer, topology, frame, &comments, &[cloths])
}

/// A further number of each vertex with its name.
pub(crate) enum Column<'a> {
    Integer(&'a str, Vec<i32>),
    Float(&'a str, &'a [f32]),
}

impl Column<'_> {
    fn property(&self) -> PropertyDef {
        let (name, number_type) = match self {
            Self::Integer(name, _) => (name, ScalarType::Int),
            Self::Float(name, _) => (name, ScalarType::Float),
        };
        PropertyDef::new((*name).to_owned(), PropertyType::Scalar(number_type))
    }
}

/// Writes the same with `columns` as further properties of the vertices.
pub(crate) fn ply_write_with(
    writer: &mut impl Write,
    topology: &Topology,
    frame: &Frame<'_>,
    comments: &[String],
    columns: &[Column<'_>],
) -> io::Result<()> {
    let normals = frame.normals_or_computed(&topology.triangles);
    let texture = topology.texture_of_particles();

    let mut vertex = ElementDef::new("vertex".to_owned());
    vertex.count = frame.positions.len();
    let number_count = if texture.is_some() { 8 } else { 6 };
    for name in &VERTEX_NUMBERS[..number_count] {
        let float = PropertyType::Scalar(ScalarType::Float);
        vertex.properties.add(PropertyDef::new((*name).to_owned(), float));
    }
    columns.iter().for_each(|column| vertex.properties.add(column.property()));
    let mut face = ElementDef::new("face".to_owned());
    face.count = topology.triangles.len();
    let list = PropertyType::List(ScalarType::UChar, ScalarType::Int);
    face.properties.add(PropertyDef::new("vertex_indices".to_owned(), list));
    let mut edge = ElementDef::new("edge".to_owned());
    edge.count = topology.lines.len();
    for name in ["vertex1", "vertex2"] {
        let integer = PropertyType::Scalar(ScalarType::Int);
        edge.properties.add(PropertyDef::new(name.to_owned(), integer));
    }

    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.comments.extend_from_slice(comments);
    header.elements.add(vertex.clone());
    header.elements.add(face.clone());
    if !topology.lines.is_empty() {
        header.elements.add(edge.clone());
    }

    let elements = Writer::new();
    elements.write_header(writer, &header)?;
    for (particle, position) in frame.positions.iter().enumerate() {
        let values = PlyElement::Vertex {
            position: *position,
            normal: normals[particle],
            texture: texture.as_ref().map_or([0.0; 2], |texture| texture[particle]),
            particle,
            columns,
        };
        elements.write_little_endian_element(writer, &values, &vertex)?;
    }
    for triangle in &topology.triangles {
        let values = PlyElement::Face(triangle.map(|index| index as i32));
        elements.write_little_endian_element(writer, &values, &face)?;
    }
    for line in &topology.lines {
        let values = PlyElement::Edge(line.map(|index| index as i32));
        elements.write_little_endian_element(writer, &values, &edge)?;
    }
    Ok(())
}

enum PlyElement<'a> {
    Vertex {
        position: [f64; 3],
        normal: [f64; 3],
        texture: [f64; 2],
        particle: usize,
        columns: &'a [Column<'a>],
    },
    Face([i32; 3]),
    Edge([i32; 2]),
}

impl PropertyAccess for PlyElement<'_> {
    fn new() -> Self {
        Self::Face([0; 3])
    }

    fn get_float(&self, wanted: &str) -> Option<f32> {
        let Self::Vertex { position, normal, texture, particle, columns } = self else {
            return None;
        };
        let value = match wanted {
            "x" => position[0],
            "y" => position[1],
            "z" => position[2],
            "nx" => normal[0],
            "ny" => normal[1],
            "nz" => normal[2],
            "s" => texture[0],
            "t" => texture[1],
            _ => {
                return columns.iter().find_map(|column| match column {
                    Column::Float(name, values) if *name == wanted => {
                        values.get(*particle).copied()
                    }
                    _ => None,
                });
            }
        };
        Some(value as f32)
    }

    fn get_int(&self, wanted: &str) -> Option<i32> {
        match self {
            Self::Edge([first, _]) if wanted == "vertex1" => Some(*first),
            Self::Edge([_, second]) => Some(*second),
            Self::Vertex { particle, columns, .. } => {
                columns.iter().find_map(|column| match column {
                    Column::Integer(name, values) if *name == wanted => {
                        values.get(*particle).copied()
                    }
                    _ => None,
                })
            }
            Self::Face(_) => None,
        }
    }

    fn get_list_int(&self, _name: &str) -> Option<&[i32]> {
        match self {
            Self::Face(triangle) => Some(triangle),
            _ => None,
        }
    }
}
