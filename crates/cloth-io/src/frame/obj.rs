//! Writes a frame as Wavefront OBJ.

use std::io::{self, Write};

use super::{Frame, Topology};

/// Writes positions \[m\] with 9 decimals (a nanometre), texture coordinates and, for each cloth, an
/// object with its faces. Vertex numbers are particle numbers plus one.
pub(crate) fn obj_write(
    writer: &mut impl Write,
    topology: &Topology,
    frame: &Frame<'_>,
) -> io::Result<()> {
    writeln!(writer, "# frame {}, time {} s", frame.index, frame.time)?;
    for [x, y, z] in frame.positions {
        writeln!(writer, "v {x:.9} {y:.9} {z:.9}")?;
    }
    let texture = topology.texture.as_ref();
    for [u, v] in texture.iter().flat_map(|texture| &texture.coordinates) {
        writeln!(writer, "vt {u:.9} {v:.9}")?;
    }
    for cloth in &topology.cloths {
        // A line break in a name would begin a new statement.
        let name = cloth.name.replace(char::is_control, " ");
        writeln!(writer, "o {name}")?;
        for number in cloth.triangles.clone() {
            let corners = topology.triangles[number].map(|index| index + 1);
            writer.write_all(b"f")?;
            for (slot, corner) in corners.into_iter().enumerate() {
                match texture {
                    None => write!(writer, " {corner}")?,
                    Some(texture) => {
                        let coordinate = texture.triangles[number][slot] + 1;
                        write!(writer, " {corner}/{coordinate}")?;
                    }
                }
            }
            writer.write_all(b"\n")?;
        }
    }
    Ok(())
}
