//! Writes a frame as a VTK XML unstructured grid (`.vtu`) and lists the frames with their times in
//! a collection (`.pvd`), as ParaView reads them.

use std::io::{self, Write};

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

use super::{Frame, Topology};

/// Number of VTK's triangle cell type.
const VTK_TRIANGLE: u8 = 5;

/// Writes positions \[m\], normals, velocities \[m/s\] if the frame has them, texture coordinates if
/// no particle has two of them, and the number of the cloth of each triangle. All arrays are
/// appended raw: little endian, each after its size in bytes as UInt64.
pub(super) fn vtu_write(
    writer: &mut impl Write,
    topology: &Topology,
    frame: &Frame<'_>,
) -> io::Result<()> {
    let mut arrays = ArrayWriter::new(writer)?;
    let grid = [("type", "UnstructuredGrid")];
    arrays.start_file(&grid)?;
    arrays.start("UnstructuredGrid", &[])?;
    arrays.start("FieldData", &[])?;
    arrays.time(frame.time)?;
    arrays.end("FieldData")?;
    let points = frame.positions.len().to_string();
    let cells = topology.triangles.len().to_string();
    arrays.start("Piece", &[("NumberOfPoints", &points), ("NumberOfCells", &cells)])?;

    arrays.start("PointData", &[("Normals", "normal"), ("Vectors", "velocity")])?;
    let normals = frame.normals_or_computed(&topology.triangles);
    arrays.array("normal", "Float32", 3, floats(&normals))?;
    if let Some(texture) = topology.texture_of_particles() {
        arrays.array("texture", "Float32", 2, floats(&texture))?;
    }
    if let Some(velocities) = frame.velocities {
        arrays.array("velocity", "Float32", 3, floats(velocities))?;
    }
    arrays.end("PointData")?;

    arrays.start("CellData", &[])?;
    arrays.array("cloth", "Int32", 1, cloth_numbers(topology))?;
    arrays.end("CellData")?;

    arrays.start("Points", &[])?;
    arrays.array("position", "Float32", 3, floats(frame.positions))?;
    arrays.end("Points")?;

    arrays.start("Cells", &[])?;
    let corners = topology.triangles.iter().flatten();
    let connectivity = corners.flat_map(|&index| i64::from(index).to_le_bytes());
    arrays.array("connectivity", "Int64", 1, connectivity.collect())?;
    let offsets = (1..=topology.triangles.len()).flat_map(|cell| (3 * cell as i64).to_le_bytes());
    arrays.array("offsets", "Int64", 1, offsets.collect())?;
    arrays.array("types", "UInt8", 1, vec![VTK_TRIANGLE; topology.triangles.len()])?;
    arrays.end("Cells")?;

    arrays.end("Piece")?;
    arrays.end("UnstructuredGrid")?;
    arrays.append()
}

/// Writes the collection of `frames`: time \[s\] and file name of each.
pub(super) fn pvd_write<'a>(
    writer: &mut impl Write,
    frames: impl IntoIterator<Item = (f64, &'a str)>,
) -> io::Result<()> {
    let mut arrays = ArrayWriter::new(writer)?;
    arrays.start_file(&[("type", "Collection")])?;
    arrays.start("Collection", &[])?;
    for (time, file) in frames {
        let time = time.to_string();
        let attributes = [("timestep", time.as_str()), ("part", "0"), ("file", file)];
        arrays.empty("DataSet", &attributes)?;
    }
    arrays.end("Collection")?;
    arrays.end("VTKFile")
}

/// Writes the XML part and gathers the arrays that follow it.
struct ArrayWriter<W: Write> {
    xml: Writer<W>,
    arrays: Vec<Vec<u8>>,
    offset: usize,
}

impl<W: Write> ArrayWriter<W> {
    fn new(writer: W) -> io::Result<Self> {
        let mut xml = Writer::new_with_indent(writer, b' ', 1);
        xml.write_event(Event::Decl(BytesDecl::new("1.0", None, None)))?;
        Ok(Self { xml, arrays: Vec::new(), offset: 0 })
    }

    fn start_file(&mut self, attributes: &[(&str, &str)]) -> io::Result<()> {
        let common =
            [("version", "1.0"), ("byte_order", "LittleEndian"), ("header_type", "UInt64")];
        self.start("VTKFile", &[attributes, &common].concat())
    }

    fn start(&mut self, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
        let start = BytesStart::new(name).with_attributes(attributes.iter().copied());
        self.xml.write_event(Event::Start(start))
    }

    fn empty(&mut self, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
        let start = BytesStart::new(name).with_attributes(attributes.iter().copied());
        self.xml.write_event(Event::Empty(start))
    }

    fn end(&mut self, name: &str) -> io::Result<()> {
        self.xml.write_event(Event::End(BytesEnd::new(name)))
    }

    fn time(&mut self, time: f64) -> io::Result<()> {
        let attributes = [
            ("type", "Float64"),
            ("Name", "TimeValue"),
            ("NumberOfTuples", "1"),
            ("format", "ascii"),
        ];
        self.start("DataArray", &attributes)?;
        self.xml.write_event(Event::Text(BytesText::new(&time.to_string())))?;
        self.end("DataArray")
    }

    fn array(
        &mut self,
        name: &str,
        number_type: &str,
        components: usize,
        bytes: Vec<u8>,
    ) -> io::Result<()> {
        let attributes = [
            ("type", number_type),
            ("Name", name),
            ("NumberOfComponents", &components.to_string()),
            ("format", "appended"),
            ("offset", &self.offset.to_string()),
        ];
        self.empty("DataArray", &attributes)?;
        self.offset += size_of::<u64>() + bytes.len();
        self.arrays.push(bytes);
        Ok(())
    }

    fn append(mut self) -> io::Result<()> {
        self.start("AppendedData", &[("encoding", "raw")])?;
        let writer = self.xml.get_mut();
        // The underscore marks where offsets count from.
        writer.write_all(b"\n_")?;
        for array in &self.arrays {
            writer.write_all(&(array.len() as u64).to_le_bytes())?;
            writer.write_all(array)?;
        }
        writer.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    }
}

fn floats<const N: usize>(values: &[[f64; N]]) -> Vec<u8> {
    let values = values.iter().flatten();
    values.flat_map(|&value| (value as f32).to_le_bytes()).collect()
}

fn cloth_numbers(topology: &Topology) -> Vec<u8> {
    let cloths = (0i32..).zip(&topology.cloths);
    cloths
        .flat_map(|(number, cloth)| cloth.triangles.clone().map(move |_| number))
        .flat_map(i32::to_le_bytes)
        .collect()
}
