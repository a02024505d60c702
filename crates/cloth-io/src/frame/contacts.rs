//! Writes the contacts between triangles at the end of a frame, for ParaView (`.vtu`, a point for each) or NumPy (`.npz`).
//!
//! | array | shape | type | content |
//! |---|---|---|---|
//! | `place` | contacts, 3 | f64 | where it is on the cloth \[m\]; in VTU the points |
//! | `normal` | contacts, 3 | f64 | unit vector from the second feature to the first |
//! | `gap` | contacts | f64 | distance of both \[m\] |
//! | `reach` | contacts | f64 | distance at which the force begins \[m\] |
//! | `force` | contacts | f64 | along the normal \[N\], pushing |
//! | `friction` | contacts, 3 | f64 | force on the first feature \[N\] |
//! | `slip` | contacts, 3 | f64 | how far it is from where it sticks \[m\] |
//! | `sticks` | contacts | u8 | 1 if both stick to each other |
//! | `particles` | contacts, 4 | u32 | particles of both features, and nodes of bodies behind all particles |
//! | `weights` | contacts, 4 | f64 | of the particles: those of the first feature are positive |

use std::{io, io::Write, path::Path};

use cloth_core::contact::Contact;
use npyz::{AutoSerialize, WriterBuilder};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use super::{FrameError, output::output_write, vtk_array::ArrayWriter};

/// Contacts at one time.
#[derive(Clone, Debug, Default)]
pub struct ContactFrame {
    /// The time \[s\].
    pub time: f64,
    /// The contacts.
    pub contacts: Vec<Contact>,
    /// Where each is on the cloth \[m\].
    pub places: Vec<[f64; 3]>,
}

/// Writes contacts into a file whose extension is `npz` or, for anything else, as VTU.
///
/// # Errors
/// [`FrameError`] if the file cannot be written; nothing is left of it then.
pub fn contacts_write(path: &Path, frame: &ContactFrame) -> Result<(), FrameError> {
    let is_npz = path.extension().is_some_and(|extension| extension == "npz");
    output_write(path, |writer| {
        let written = if is_npz {
            let mut zip = ZipWriter::new(writer);
            npz(&mut zip, frame).and_then(|()| Ok(zip.finish().map(drop)?))
        } else {
            vtu(writer, frame)
        };
        written.map_err(FrameError::write(path))
    })
}

fn npz<W: Write + io::Seek>(zip: &mut ZipWriter<W>, frame: &ContactFrame) -> io::Result<()> {
    let all = &frame.contacts;
    let vectors = |of: fn(&Contact) -> [f64; 3]| all.iter().flat_map(of).collect::<Vec<_>>();
    let numbers = |of: fn(&Contact) -> f64| all.iter().map(of).collect::<Vec<_>>();
    array(zip, "time", &[], vec![frame.time])?;
    let n = all.len() as u64;
    array(zip, "place", &[n, 3], frame.places.as_flattened().to_vec())?;
    array(zip, "normal", &[n, 3], vectors(|contact| contact.normal))?;
    array(zip, "gap", &[n], numbers(|contact| contact.gap))?;
    array(zip, "reach", &[n], numbers(|contact| contact.reach))?;
    array(zip, "force", &[n], numbers(|contact| contact.force))?;
    array(zip, "friction", &[n, 3], vectors(|contact| contact.friction))?;
    array(zip, "slip", &[n, 3], vectors(|contact| contact.slip))?;
    array(zip, "sticks", &[n], all.iter().map(|contact| u8::from(contact.sticks)).collect())?;
    let particles = all.iter().flat_map(|contact| contact.particles).collect();
    array(zip, "particles", &[n, 4], particles)?;
    array(zip, "weights", &[n, 4], all.iter().flat_map(|contact| contact.weights).collect())
}

fn array<W: Write + io::Seek, T: AutoSerialize>(
    zip: &mut ZipWriter<W>,
    name: &str,
    shape: &[u64],
    values: Vec<T>,
) -> io::Result<()> {
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    zip.start_file(format!("{name}.npy"), options)?;
    let options = npyz::WriteOptions::new().default_dtype().shape(shape);
    let mut writer = options.writer(zip).begin_nd()?;
    writer.extend(values)?;
    writer.finish()
}

fn vtu(writer: &mut impl Write, frame: &ContactFrame) -> io::Result<()> {
    const VTK_VERTEX: u8 = 1;
    let all = &frame.contacts;
    let vectors = |of: fn(&Contact) -> [f64; 3]| -> Vec<u8> {
        all.iter().flat_map(of).flat_map(f64::to_le_bytes).collect()
    };
    let numbers = |of: fn(&Contact) -> f64| -> Vec<u8> {
        all.iter().map(of).flat_map(f64::to_le_bytes).collect()
    };
    let mut arrays = ArrayWriter::grid(writer, frame.time, [all.len(); 2])?;
    arrays.start("PointData", &[("Normals", "normal"), ("Scalars", "force")])?;
    arrays.array("normal", "Float64", 3, vectors(|contact| contact.normal))?;
    arrays.array("gap", "Float64", 1, numbers(|contact| contact.gap))?;
    arrays.array("reach", "Float64", 1, numbers(|contact| contact.reach))?;
    arrays.array("force", "Float64", 1, numbers(|contact| contact.force))?;
    arrays.array("friction", "Float64", 3, vectors(|contact| contact.friction))?;
    arrays.array("slip", "Float64", 3, vectors(|contact| contact.slip))?;
    let sticks = all.iter().map(|contact| u8::from(contact.sticks)).collect();
    arrays.array("sticks", "UInt8", 1, sticks)?;
    let particles = all.iter().flat_map(|contact| contact.particles);
    arrays.array("particles", "UInt32", 4, particles.flat_map(u32::to_le_bytes).collect())?;
    let weights = all.iter().flat_map(|contact| contact.weights);
    arrays.array("weights", "Float64", 4, weights.flat_map(f64::to_le_bytes).collect())?;
    arrays.end("PointData")?;
    arrays.start("Points", &[])?;
    let places = frame.places.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    arrays.array("position", "Float64", 3, places)?;
    arrays.end("Points")?;
    arrays.start("Cells", &[])?;
    let points = 0..all.len() as i64;
    arrays.array(
        "connectivity",
        "Int64",
        1,
        points.clone().flat_map(i64::to_le_bytes).collect(),
    )?;
    let ends = points.map(|point| point + 1);
    arrays.array("offsets", "Int64", 1, ends.flat_map(i64::to_le_bytes).collect())?;
    arrays.array("types", "UInt8", 1, vec![VTK_VERTEX; all.len()])?;
    arrays.end("Cells")?;
    arrays.grid_end()
}
