//! Polygon File Format (PLY), text and binary.

use cloth_core::{TriangleMesh, VertexAttribute};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};

use super::assembly::{Corner, MeshAssembly};
use super::{MeshError, MeshPlace};

/// Reads a PLY mesh from `bytes`; `file` is the name used in errors.
///
/// Vertices need `x`, `y`, `z` of any number type; `s`/`t`, `u`/`v` or `texture_u`/`texture_v` of
/// the vertices are texture coordinates, and all their other numbers but normals are attributes;
/// those of the colours `red`, `green`, `blue` and `alpha` go from 0 to 1. Faces need a `vertex_indices` or `vertex_index` list;
/// polygons become fans of triangles.
///
/// # Errors
///
/// [`MeshError`], see [`mesh_read`](crate::mesh_read).
pub fn mesh_read_ply(file: &str, bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<PlyVertex>::new()
        .read_header(&mut reader)
        .map_err(|error| syntax(file, &error))?;
    check_sizes(file, &header, reader.get_ref().len())?;

    let mut assembly = MeshAssembly::new(MeshPlace::Face, 0);
    let mut textured = false;
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => {
                let vertices: Vec<PlyVertex> = read(file, &mut reader, element, &header)?;
                assembly.attributes = attributes(element, vertices.len());
                textured = vertices.iter().all(|vertex| vertex.texture_found == [true; 2]);
                for vertex in vertices {
                    assembly.positions.push(vertex.position);
                    for (attribute, value) in assembly.attributes.iter_mut().zip(vertex.others) {
                        attribute.values.push(value);
                    }
                    if textured {
                        assembly.coordinates.push(vertex.texture);
                    }
                }
            }
            "face" => {
                let faces: Vec<PlyFace> = read(file, &mut reader, element, &header)?;
                let mut corners = Vec::new();
                for (number, face) in faces.into_iter().enumerate() {
                    let corner = |vertex| Corner { vertex, texture: textured.then_some(vertex) };
                    corners.clear();
                    corners.extend(face.vertices.into_iter().map(corner));
                    assembly.polygon(file, number, &corners)?;
                }
            }
            _ => drop(read::<PlySkipped>(file, &mut reader, element, &header)?),
        }
    }
    assembly.finish(file)
}

/// The attributes of `element` in the order of its properties, which is that of the values of a
/// vertex; still without values, but with room for `count`.
fn attributes(element: &ElementDef, count: usize) -> Vec<VertexAttribute> {
    let properties = element.properties.iter();
    let scalars = properties.filter(|(name, property)| {
        matches!(property.data_type, PropertyType::Scalar(_)) && is_attribute(name)
    });
    scalars
        .map(|(name, _)| VertexAttribute { name: name.clone(), values: Vec::with_capacity(count) })
        .collect()
}

/// Whether the property of vertices with this name is none that has a meaning of its own.
pub(super) fn is_attribute(name: &str) -> bool {
    const KNOWN: [&str; 12] =
        ["x", "y", "z", "nx", "ny", "nz", "s", "t", "u", "v", "texture_u", "texture_v"];
    !KNOWN.contains(&name)
}

/// The value of an attribute; whole numbers of colours become parts of one.
fn attribute_value(name: &str, property: &Property, value: f64) -> f32 {
    let is_colour = ["red", "green", "blue", "alpha"].contains(&name);
    let largest = match property {
        Property::UChar(_) if is_colour => f64::from(u8::MAX),
        Property::UShort(_) if is_colour => f64::from(u16::MAX),
        _ => 1.0,
    };
    (value / largest) as f32
}

fn read<E: PropertyAccess>(
    file: &str,
    reader: &mut Reader<&[u8]>,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, MeshError> {
    Parser::<E>::new()
        .read_payload_for_element(reader, element, header)
        .map_err(|error| syntax(file, &error))
}

fn syntax(file: &str, error: &ParseError) -> MeshError {
    // The library quotes the whole line below its message; the first line says it all.
    let message = error.to_string();
    let message = message.lines().next().unwrap_or_default();
    let message = match error.line() {
        Some(line) => message.strip_prefix(&format!("Line {line}: ")).unwrap_or(message),
        None => message,
    };
    MeshError::Syntax {
        file: file.to_owned(),
        place: error.line().map_or(MeshPlace::File, MeshPlace::Line),
        problem: message.trim_end_matches('.').to_owned(),
    }
}

/// Refuses headers that promise more elements than the rest of the file can hold, before anything
/// is allocated for them.
fn check_sizes(file: &str, header: &Header, available: usize) -> Result<(), MeshError> {
    for (name, element) in &header.elements {
        let smallest: usize = match header.encoding {
            // A number and a separator for each property.
            Encoding::Ascii => (2 * element.properties.len()).saturating_sub(1),
            _ => element
                .properties
                .iter()
                .map(|(_, property)| smallest_size(&property.data_type))
                .sum(),
        };
        let limit = match smallest {
            0 => 0,
            smallest => available / smallest,
        };
        if element.count > limit {
            return Err(MeshError::Size {
                file: file.to_owned(),
                what: format!("`{name}` elements"),
                declared: element.count as u64,
                limit: limit as u64,
            });
        }
    }
    Ok(())
}

/// Bytes that a binary property takes at least; a list can be empty after its count.
fn smallest_size(data_type: &PropertyType) -> usize {
    match data_type {
        PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => match scalar {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        },
    }
}

struct PlyVertex {
    /// Not a number where the file gives none, so that the check of the mesh finds it.
    position: [f64; 3],
    texture: [f64; 2],
    texture_found: [bool; 2],
    /// The values of the [`attributes`], in the order of the file.
    others: Vec<f32>,
}

impl PropertyAccess for PlyVertex {
    fn new() -> Self {
        Self {
            position: [f64::NAN; 3],
            texture: [0.0; 2],
            texture_found: [false; 2],
            others: Vec::new(),
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let Some(value) = number(&property) else {
            return PropertyAccessResult::Ignored;
        };
        let axis = match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            "s" | "u" | "texture_u" => {
                self.texture_found[0] = true;
                &mut self.texture[0]
            }
            "t" | "v" | "texture_v" => {
                self.texture_found[1] = true;
                &mut self.texture[1]
            }
            _ if is_attribute(name) => {
                self.others.push(attribute_value(name, &property, value));
                return PropertyAccessResult::Set;
            }
            _ => return PropertyAccessResult::Ignored,
        };
        *axis = value;
        PropertyAccessResult::Set
    }
}

#[derive(Default)]
struct PlyFace {
    vertices: Vec<i64>,
}

impl PropertyAccess for PlyFace {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if name != "vertex_indices" && name != "vertex_index" {
            return PropertyAccessResult::Ignored;
        }
        self.vertices = match property {
            Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// An element that the mesh has no use for.
struct PlySkipped;

impl PropertyAccess for PlySkipped {
    fn new() -> Self {
        Self
    }
}

fn number(property: &Property) -> Option<f64> {
    match *property {
        Property::Char(value) => Some(value.into()),
        Property::UChar(value) => Some(value.into()),
        Property::Short(value) => Some(value.into()),
        Property::UShort(value) => Some(value.into()),
        Property::Int(value) => Some(value.into()),
        Property::UInt(value) => Some(value.into()),
        Property::Float(value) => Some(value.into()),
        Property::Double(value) => Some(value),
        _ => None,
    }
}
