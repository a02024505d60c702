//! Writes a frame as a VTK XML unstructured grid (`.vtu`) and lists the frames with their times in
//! a collection (`.pvd`), as ParaView reads them.

use std::collections::HashMap;
use std::io::{self, Write};

use super::vtk_array::ArrayWriter;
use super::vtu_fabric::FabricCells;
use super::{Frame, PlacedSolid, Topology, vertex_normals};

/// Numbers of VTK's cell types.
const VTK_VERTEX: u8 = 1;
const VTK_LINE: u8 = 3;
const VTK_TRIANGLE: u8 = 5;

/// What is the same in all frames: the points and the cells of the cloths.
#[derive(Debug)]
pub(super) struct VtuLayout {
    /// Particle of each point behind the particles: the format has one texture coordinate for each
    /// point, so a particle on a seam is there once more for each further coordinate.
    seams: Vec<u32>,
    /// Texture coordinate of each point, if there are any.
    coordinates: Option<Vec<[f64; 2]>>,
    /// Points of each triangle.
    triangles: Vec<[u32; 3]>,
    /// Particles in no triangle and no line, with the number of their cloth.
    vertices: Vec<(u32, i32)>,
}

impl VtuLayout {
    pub(super) fn of(topology: &Topology) -> Self {
        let numbered = (0..).zip(&topology.cloths);
        let vertices = numbered.flat_map(|(number, cloth)| {
            topology.points(cloth).into_iter().map(move |point| (point, number))
        });
        let mut layout = Self {
            seams: Vec::new(),
            coordinates: None,
            triangles: topology.triangles.clone(),
            vertices: vertices.collect(),
        };
        let Some(texture) = &topology.texture else { return layout };
        let particle_count = topology.particle_count;
        let mut first: Vec<Option<u32>> = vec![None; particle_count];
        let mut coordinates = vec![[0.0; 2]; particle_count];
        let mut further = HashMap::new();
        let corners = layout.triangles.as_flattened_mut().iter_mut();
        for (corner, &index) in corners.zip(texture.triangles.as_flattened()) {
            let particle = *corner as usize;
            let coordinate = texture.coordinates[index as usize];
            if first[particle].is_none() {
                first[particle] = Some(index);
                coordinates[particle] = coordinate;
            }
            if coordinates[particle] == coordinate {
                continue;
            }
            let bits = coordinate.map(f64::to_bits);
            *corner = *further.entry((particle, bits)).or_insert_with(|| {
                layout.seams.push(particle as u32);
                coordinates.push(coordinate);
                coordinates.len() as u32 - 1
            });
        }
        layout.coordinates = Some(coordinates);
        layout
    }
}

/// Writes positions \[m\], normals, velocities \[m/s\] if the frame has them and texture coordinates if
/// there are any; for each cell the number of its cloth and, if there are `solids`, of its solid, -1 for
/// none; for fabric also what [`FabricCells`] has. Points that are no particle by their index have it in the
/// array `particle`, -1 for those of a solid. All arrays are appended raw: little endian, each after its size in bytes as UInt64.
pub(super) fn vtu_write(
    writer: &mut impl Write,
    topology: &Topology,
    layout: &VtuLayout,
    frame: &Frame<'_>,
    solids: &[PlacedSolid<'_>],
) -> io::Result<()> {
    let cells = Cells::of(topology, layout, solids);
    let solid_points: usize = solids.iter().map(|solid| solid.positions.len()).sum();
    let particle_count = frame.positions.len();
    let point_count = particle_count + layout.seams.len() + solid_points;
    // Cloth first, then seams, then the solids, for which `of_solids` has an array or zeros.
    let vectors = |of_cloth: &[[f64; 3]], of_solids: Option<Vec<[f64; 3]>>| {
        let seams = layout.seams.iter().map(|&particle| of_cloth[particle as usize]);
        let mut all: Vec<[f64; 3]> = of_cloth.iter().copied().chain(seams).collect();
        all.extend(of_solids.unwrap_or_default());
        all.resize(point_count, [0.0; 3]);
        floats(&all)
    };
    let mut arrays = ArrayWriter::grid(writer, frame.time, [point_count, cells.types.len()])?;

    // What ParaView takes without being asked.
    let mut active = vec![("Normals", "normal")];
    if layout.coordinates.is_some() {
        active.push(("TCoords", "texture"));
    }
    if frame.velocities.is_some() {
        active.push(("Vectors", "velocity"));
    }
    arrays.start("PointData", &active)?;
    let normals = frame.normals_or_computed(&topology.triangles);
    let solid_normals = solids.iter().flat_map(|s| vertex_normals(&s.positions, s.triangles));
    arrays.array("normal", "Float32", 3, vectors(&normals, Some(solid_normals.collect())))?;
    if let Some(coordinates) = &layout.coordinates {
        let mut coordinates = coordinates.clone();
        coordinates.resize(point_count, [0.0; 2]);
        arrays.array("texture", "Float32", 2, floats(&coordinates))?;
    }
    if let Some(velocities) = frame.velocities {
        arrays.array("velocity", "Float32", 3, vectors(velocities, None))?;
    }
    if point_count != particle_count {
        let seams = layout.seams.iter().map(|&particle| particle as i32);
        let mut particles: Vec<i32> = (0..particle_count as i32).chain(seams).collect();
        particles.resize(point_count, -1);
        arrays.array("particle", "Int32", 1, integers(&particles))?;
    }
    arrays.end("PointData")?;

    arrays.start("CellData", &[])?;
    arrays.array("cloth", "Int32", 1, integers(&cells.cloths))?;
    if !solids.is_empty() {
        arrays.array("solid", "Int32", 1, integers(&cells.solids))?;
    }
    if let Some(fabric) = FabricCells::of(topology, frame, cells.types.len()) {
        fabric.write(&mut arrays)?;
    }
    arrays.end("CellData")?;

    arrays.start("Points", &[])?;
    let solid_positions = solids.iter().flat_map(|solid| solid.positions.iter().copied());
    let positions = vectors(frame.positions, Some(solid_positions.collect()));
    arrays.array("position", "Float32", 3, positions)?;
    arrays.end("Points")?;

    arrays.start("Cells", &[])?;
    arrays.array("connectivity", "Int64", 1, cells.connectivity)?;
    arrays.array("offsets", "Int64", 1, cells.offsets)?;
    arrays.array("types", "UInt8", 1, cells.types)?;
    arrays.end("Cells")?;

    arrays.grid_end()
}

/// The arrays of all cells: triangles, lines and points of the cloths, triangles of the solids.
#[derive(Default)]
struct Cells {
    connectivity: Vec<u8>,
    offsets: Vec<u8>,
    types: Vec<u8>,
    /// Number of the cloth of each cell, -1 for none.
    cloths: Vec<i32>,
    /// Number of the solid of each cell, -1 for none.
    solids: Vec<i32>,
    end: i64,
}

impl Cells {
    fn of(topology: &Topology, layout: &VtuLayout, solids: &[PlacedSolid<'_>]) -> Self {
        let mut cells = Self::default();
        for (number, cloth) in (0..).zip(&topology.cloths) {
            for triangle in &layout.triangles[cloth.triangles.clone()] {
                cells.add(VTK_TRIANGLE, triangle, [number, -1]);
            }
        }
        for (number, cloth) in (0..).zip(&topology.cloths) {
            for line in &topology.lines[cloth.lines.clone()] {
                cells.add(VTK_LINE, line, [number, -1]);
            }
        }
        for &(point, number) in &layout.vertices {
            cells.add(VTK_VERTEX, &[point], [number, -1]);
        }
        let mut start = (topology.particle_count + layout.seams.len()) as u32;
        for (number, solid) in (0..).zip(solids) {
            for triangle in solid.triangles {
                cells.add(VTK_TRIANGLE, &triangle.map(|index| start + index), [-1, number]);
            }
            start += solid.positions.len() as u32;
        }
        cells
    }

    fn add(&mut self, cell_type: u8, points: &[u32], [cloth, solid]: [i32; 2]) {
        let bytes = points.iter().flat_map(|&point| i64::from(point).to_le_bytes());
        self.connectivity.extend(bytes);
        self.end += points.len() as i64;
        self.offsets.extend(self.end.to_le_bytes());
        self.types.push(cell_type);
        self.cloths.push(cloth);
        self.solids.push(solid);
    }
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

fn floats<const N: usize>(values: &[[f64; N]]) -> Vec<u8> {
    values.as_flattened().iter().flat_map(|&value| (value as f32).to_le_bytes()).collect()
}

fn integers(values: &[i32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}
