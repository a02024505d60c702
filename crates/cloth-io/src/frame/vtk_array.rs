//! The XML files of VTK: a tree of elements, and arrays that follow it as they are in memory.

use std::io::{self, Write};

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

/// Writes the XML part and gathers the arrays that follow it.
pub(super) struct ArrayWriter<W: Write> {
    xml: Writer<W>,
    arrays: Vec<Vec<u8>>,
    offset: usize,
}

impl<W: Write> ArrayWriter<W> {
    pub(super) fn new(writer: W) -> io::Result<Self> {
        let mut xml = Writer::new_with_indent(writer, b' ', 1);
        xml.write_event(Event::Decl(BytesDecl::new("1.0", None, None)))?;
        Ok(Self { xml, arrays: Vec::new(), offset: 0 })
    }

    /// Begins a grid of so many points and cells at a time \[s\].
    pub(super) fn grid(writer: W, time: f64, [points, cells]: [usize; 2]) -> io::Result<Self> {
        let mut arrays = Self::new(writer)?;
        arrays.start_file(&[("type", "UnstructuredGrid")])?;
        arrays.start("UnstructuredGrid", &[])?;
        arrays.start("FieldData", &[])?;
        arrays.time(time)?;
        arrays.end("FieldData")?;
        let [points, cells] = [points, cells].map(|count| count.to_string());
        arrays.start("Piece", &[("NumberOfPoints", &points), ("NumberOfCells", &cells)])?;
        Ok(arrays)
    }

    /// Ends it, with its arrays.
    pub(super) fn grid_end(mut self) -> io::Result<()> {
        self.end("Piece")?;
        self.end("UnstructuredGrid")?;
        self.append()
    }

    pub(super) fn start_file(&mut self, attributes: &[(&str, &str)]) -> io::Result<()> {
        let common =
            [("version", "1.0"), ("byte_order", "LittleEndian"), ("header_type", "UInt64")];
        self.start("VTKFile", &[attributes, &common].concat())
    }

    pub(super) fn start(&mut self, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
        let start = BytesStart::new(name).with_attributes(attributes.iter().copied());
        self.xml.write_event(Event::Start(start))
    }

    pub(super) fn empty(&mut self, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
        let start = BytesStart::new(name).with_attributes(attributes.iter().copied());
        self.xml.write_event(Event::Empty(start))
    }

    pub(super) fn end(&mut self, name: &str) -> io::Result<()> {
        self.xml.write_event(Event::End(BytesEnd::new(name)))
    }

    pub(super) fn time(&mut self, time: f64) -> io::Result<()> {
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

    pub(super) fn array(
        &mut self,
        name: &str,
        number_type: &str,
        components: usize,
        bytes: Vec<u8>,
    ) -> io::Result<()> {
        self.array_with(name, number_type, components, &[], bytes)
    }

    /// An array in single precision whose components have names, which ParaView shows in place of X, Y, Z.
    pub(super) fn floats<const N: usize>(
        &mut self,
        name: &str,
        components: [&str; N],
        values: &[[f64; N]],
    ) -> io::Result<()> {
        let keys: [String; N] = std::array::from_fn(|number| format!("ComponentName{number}"));
        let names: [(&str, &str); N] =
            std::array::from_fn(|number| (keys[number].as_str(), components[number]));
        let numbers = values.as_flattened().iter();
        let bytes = numbers.flat_map(|&value| (value as f32).to_le_bytes()).collect();
        self.array_with(name, "Float32", N, &names, bytes)
    }

    fn array_with(
        &mut self,
        name: &str,
        number_type: &str,
        components: usize,
        names: &[(&str, &str)],
        bytes: Vec<u8>,
    ) -> io::Result<()> {
        let (components, offset) = (components.to_string(), self.offset.to_string());
        let own = [("type", number_type), ("Name", name), ("NumberOfComponents", &components)];
        let place = [("format", "appended"), ("offset", offset.as_str())];
        self.empty("DataArray", &[&own[..], names, &place[..]].concat())?;
        self.offset += size_of::<u64>() + bytes.len();
        self.arrays.push(bytes);
        Ok(())
    }

    pub(super) fn append(mut self) -> io::Result<()> {
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
