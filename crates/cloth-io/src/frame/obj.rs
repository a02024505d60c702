//! Writes a frame as Wavefront OBJ.

use std::io::{self, Write};

use super::{Frame, PlacedSolid, Topology, TopologyCloth, vertex_normals};

/// Writes positions \[m\] with 9 decimals (a nanometre), texture coordinates, unit normals and, for
/// each cloth, an object with its faces, lines and points; after them an object for each of `solids`.
/// Vertex numbers are particle numbers plus one.
pub(crate) fn obj_write(
    writer: &mut impl Write,
    topology: &Topology,
    frame: &Frame<'_>,
    solids: &[PlacedSolid<'_>],
) -> io::Result<()> {
    write!(writer, "# frame {}, time {} s", frame.index, frame.time)?;
    writeln!(writer, ", {} frames per second", topology.frames_per_second)?;
    vertices(writer, frame.positions)?;
    let texture = topology.texture.as_ref();
    for [u, v] in texture.iter().flat_map(|texture| &texture.coordinates) {
        writeln!(writer, "vt {u:.9} {v:.9}")?;
    }
    let has_faces = !topology.triangles.is_empty();
    if has_faces {
        normals(writer, &frame.normals_or_computed(&topology.triangles))?;
    }
    for cloth in &topology.cloths {
        object(writer, &cloth.name)?;
        cloth_write(writer, topology, cloth)?;
    }
    let mut vertex_count = frame.positions.len();
    let mut normal_count = if has_faces { vertex_count } else { 0 };
    for solid in solids {
        object(writer, solid.name)?;
        vertices(writer, &solid.positions)?;
        normals(writer, &vertex_normals(&solid.positions, solid.triangles))?;
        for triangle in solid.triangles {
            writer.write_all(b"f")?;
            for corner in triangle.map(|index| index as usize + 1) {
                write!(writer, " {}//{}", vertex_count + corner, normal_count + corner)?;
            }
            writer.write_all(b"\n")?;
        }
        vertex_count += solid.positions.len();
        normal_count += solid.positions.len();
    }
    Ok(())
}

fn cloth_write(
    writer: &mut impl Write,
    topology: &Topology,
    cloth: &TopologyCloth,
) -> io::Result<()> {
    for number in cloth.triangles.clone() {
        let corners = topology.triangles[number].map(|index| index + 1);
        writer.write_all(b"f")?;
        for (slot, corner) in corners.into_iter().enumerate() {
            match &topology.texture {
                None => write!(writer, " {corner}//{corner}")?,
                Some(texture) => {
                    let coordinate = texture.triangles[number][slot] + 1;
                    write!(writer, " {corner}/{coordinate}/{corner}")?;
                }
            }
        }
        writer.write_all(b"\n")?;
    }
    // One line for each segment: not every reader knows longer ones.
    for [a, b] in &topology.lines[cloth.lines.clone()] {
        writeln!(writer, "l {} {}", a + 1, b + 1)?;
    }
    points_write(writer, &topology.points(cloth))
}

/// Writes the particles, zero based, as points.
pub(crate) fn points_write(writer: &mut impl Write, particles: &[u32]) -> io::Result<()> {
    // Lines of a length that people and programs can read.
    for particles in particles.chunks(16) {
        writer.write_all(b"p")?;
        for particle in particles {
            write!(writer, " {}", particle + 1)?;
        }
        writer.write_all(b"\n")?;
    }
    Ok(())
}

/// Begins an object, of which all faces are smooth.
fn object(writer: &mut impl Write, name: &str) -> io::Result<()> {
    // A line break in a name would begin a new statement.
    writeln!(writer, "o {}\ns 1", name.replace(char::is_control, " "))
}

fn vertices(writer: &mut impl Write, positions: &[[f64; 3]]) -> io::Result<()> {
    positions.iter().try_for_each(|[x, y, z]| writeln!(writer, "v {x:.9} {y:.9} {z:.9}"))
}

fn normals(writer: &mut impl Write, normals: &[[f64; 3]]) -> io::Result<()> {
    normals.iter().try_for_each(|&normal| {
        // Where no triangle is there is no normal; readers want a unit vector nevertheless.
        let [x, y, z] = if normal == [0.0; 3] { [0.0, 0.0, 1.0] } else { normal };
        writeln!(writer, "vn {x:.6} {y:.6} {z:.6}")
    })
}
