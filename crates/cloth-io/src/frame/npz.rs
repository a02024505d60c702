//! Writes a NumPy archive with the arrays
//!
//! | name | shape | type | content |
//! |---|---|---|---|
//! | `positions` | frames, particles, 3 | f32 | positions \[m\] |
//! | `times` | frames | f64 | times \[s\] |
//! | `frames_per_second` | | f64 | frames of the file in a second \[1/s\] |
//! | `triangles` | triangles, 3 | u32 | particle indices |
//! | `lines` | lines, 2 | u32 | particle indices, if there are any lines |
//! | `cloth_of_particle` | particles | u32 | number of the cloth, from 0 |
//! | `cloths` | cloths | text | names of the cloths |
//! | `uv` | coordinates, 2 | f64 | texture coordinates, if any |
//! | `uv_triangles` | triangles, 3 | u32 | indices into `uv`, if any |

use std::io::{Seek, Write};

use npyz::{AutoSerialize, WriterBuilder};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::FrameError;
use super::container::ContainerSource;
use super::output::output_write;

pub(super) fn write(source: &ContainerSource<'_>) -> Result<(), FrameError> {
    output_write(source.path, |writer| {
        let mut archive = Archive { source, zip: ZipWriter::new(writer) };
        archive.arrays()?;
        archive.zip.finish().map_err(FrameError::write(source.path))?;
        Ok(())
    })
}

struct Archive<'a, W: Write + Seek> {
    source: &'a ContainerSource<'a>,
    zip: ZipWriter<W>,
}

impl<W: Write + Seek> Archive<'_, W> {
    fn arrays(&mut self) -> Result<(), FrameError> {
        let source = self.source;
        let topology = source.topology;
        let frame_count = source.frames.len() as u64;
        let shape = [frame_count, topology.particle_count as u64, 3];
        let positions = source.frames.iter().map(|&index| {
            let frame = source.store.frame(index)?;
            Ok(frame.positions.into_flattened())
        });
        self.array("positions", &shape, positions)?;

        let times = source.frames.iter().map(|&index| Ok(vec![source.store.time(index)?]));
        self.array("times", &[frame_count], times)?;

        let triangle_shape = [topology.triangles.len() as u64, 3];
        let triangles = topology.triangles.as_flattened().to_vec();
        self.array("triangles", &triangle_shape, [Ok(triangles)])?;
        self.array("frames_per_second", &[], [Ok(vec![source.rate])])?;
        if !topology.lines.is_empty() {
            let lines = topology.lines.as_flattened().to_vec();
            self.array("lines", &[topology.lines.len() as u64, 2], [Ok(lines)])?;
        }
        let numbered = (0_u32..).zip(&topology.cloths);
        let cloths =
            numbered.flat_map(|(number, cloth)| cloth.particles.clone().map(move |_| number));
        let shape = [topology.particle_count as u64];
        self.array("cloth_of_particle", &shape, [Ok(cloths.collect())])?;
        self.names()?;

        if let Some(texture) = &topology.texture {
            let shape = [texture.coordinates.len() as u64, 2];
            let coordinates = texture.coordinates.as_flattened().to_vec();
            self.array("uv", &shape, [Ok(coordinates)])?;
            let triangles = texture.triangles.as_flattened().to_vec();
            self.array("uv_triangles", &triangle_shape, [Ok(triangles)])?;
        }
        Ok(())
    }

    /// Writes the names of the cloths as the strings of Python.
    fn names(&mut self) -> Result<(), FrameError> {
        let path = self.source.path;
        let names: Vec<&str> =
            self.source.topology.cloths.iter().map(|cloth| cloth.name.as_str()).collect();
        let width = names.iter().map(|name| name.chars().count()).max().unwrap_or(0).max(1);
        let text_type: npyz::TypeStr =
            format!("<U{width}").parse().map_err(FrameError::write(path))?;
        self.begin("cloths")?;
        let mut writer = npyz::WriteOptions::<str>::new()
            .dtype(npyz::DType::Plain(text_type))
            .shape(&[names.len() as u64])
            .writer(&mut self.zip)
            .begin_nd()
            .map_err(FrameError::write(path))?;
        for name in names {
            writer.push(name).map_err(FrameError::write(path))?;
        }
        writer.finish().map_err(FrameError::write(path))
    }

    /// Begins the file of an array.
    fn begin(&mut self, name: &str) -> Result<(), FrameError> {
        // Positions hardly compress, and readers can map stored arrays.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(true);
        let started = self.zip.start_file(format!("{name}.npy"), options);
        started.map_err(FrameError::write(self.source.path))
    }

    /// Writes one array from its parts, so that only one frame is in memory at a time.
    fn array<T: AutoSerialize>(
        &mut self,
        name: &str,
        shape: &[u64],
        parts: impl IntoIterator<Item = Result<Vec<T>, FrameError>>,
    ) -> Result<(), FrameError> {
        let path = self.source.path;
        self.begin(name)?;
        let mut writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(shape)
            .writer(&mut self.zip)
            .begin_nd()
            .map_err(FrameError::write(path))?;
        for part in parts {
            writer.extend(part?).map_err(FrameError::write(path))?;
        }
        writer.finish().map_err(FrameError::write(path))
    }
}
