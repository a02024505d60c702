//! Point caches: where the vertices of a mesh are in each frame, beside the mesh that they move.
//!
//! A cache says nothing of its mesh but the number of its vertices, and programs that import OBJ make an
//! object of each cloth. So each cloth has a cache and a mesh of its own, with the same vertices in the
//! same order. Vertices that are in no face and no line are left out of both, as programs leave them out
//! of what they import; if a cloth has nothing but points, they take them all.

use std::collections::{HashMap, HashSet};
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

use cloth_core::TextureMap;

use super::container::ContainerSource;
use super::obj::obj_write;
use super::output::output_write;
use super::{Frame, FrameError, FrameFormat, Topology, TopologyCloth};
use super::{mdd, pc2};

/// The files of one cloth.
pub(super) struct CacheFiles {
    pub(super) cache: PathBuf,
    pub(super) mesh: PathBuf,
}

/// The files that a cache at `path` has for each cloth: `path` itself for a single cloth, else `path`
/// with the name of the cloth behind its own; and beside each a mesh, `_mesh.obj`.
pub(super) fn cache_files(path: &Path, topology: &Topology) -> Vec<CacheFiles> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let mut taken = HashSet::new();
    let files = |cloth: &TopologyCloth| {
        let mut name = stem.to_string();
        if topology.cloths.len() > 1 {
            name = format!("{stem}_{}", file_part(&cloth.name));
            // Two names can look alike as files, and some systems do not know capitals.
            let mut number = 2;
            while !taken.insert(name.to_lowercase()) {
                name = format!("{stem}_{}_{number}", file_part(&cloth.name));
                number += 1;
            }
        }
        let cache = match &*extension {
            "" => path.with_file_name(&name),
            extension => path.with_file_name(format!("{name}.{extension}")),
        };
        CacheFiles { cache, mesh: path.with_file_name(format!("{name}_mesh.obj")) }
    };
    topology.cloths.iter().map(files).collect()
}

/// A name as part of a file name that leads to no other folder.
fn file_part(name: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || "-_".contains(c) { c } else { '-' };
    let part: String = name.chars().take(60).map(plain).collect();
    if part.is_empty() { "cloth".to_owned() } else { part }
}

/// Writes the caches and meshes of all cloths, and gives back their files.
pub(super) fn write(
    format: FrameFormat,
    source: &ContainerSource<'_>,
) -> Result<Vec<PathBuf>, FrameError> {
    let mut written = Vec::new();
    for (cloth, files) in
        source.topology.cloths.iter().zip(cache_files(source.path, source.topology))
    {
        let particles = shown(source.topology, cloth);
        let cache = CacheSource { source, path: &files.cache, particles: &particles };
        match format {
            FrameFormat::Pc2 => pc2::write(&cache)?,
            _ => mdd::write(&cache)?,
        }
        mesh_write(&cache, cloth, &files.mesh)?;
        written.extend([files.cache, files.mesh]);
    }
    Ok(written)
}

/// What the writer of one cache needs.
pub(super) struct CacheSource<'a> {
    pub(super) source: &'a ContainerSource<'a>,
    pub(super) path: &'a Path,
    /// The particles of the cache, ascending.
    particles: &'a [u32],
}

impl CacheSource<'_> {
    /// Numbers of points and frames as both formats store them.
    pub(super) fn counts(&self) -> Result<[i32; 2], FrameError> {
        let points = self.source.count_i32("particles", self.particles.len())?;
        Ok([points, self.source.count_i32("frames", self.source.frames.len())?])
    }

    /// Writes the positions \[m\] of all frames, each number by `bytes`.
    pub(super) fn positions(
        &self,
        writer: &mut impl Write,
        bytes: impl Fn(f32) -> [u8; 4],
    ) -> Result<(), FrameError> {
        for &index in &self.source.frames {
            let frame = self.source.store.frame(index)?;
            let positions =
                self.particles.iter().map(|&particle| frame.positions[particle as usize]);
            let bytes: Vec<u8> = positions.flatten().flat_map(&bytes).collect();
            writer.write_all(&bytes).map_err(FrameError::write(self.path))?;
        }
        Ok(())
    }
}

/// The particles of `cloth` that a mesh of it shows.
fn shown(topology: &Topology, cloth: &TopologyCloth) -> Vec<u32> {
    let hidden: HashSet<u32> = topology.points(cloth).into_iter().collect();
    let all = cloth.particles.start as u32..cloth.particles.end as u32;
    if hidden.len() == all.len() {
        return all.collect();
    }
    all.filter(|particle| !hidden.contains(particle)).collect()
}

/// Writes the mesh that a cache moves, as it is in the first frame.
fn mesh_write(
    cache: &CacheSource<'_>,
    cloth: &TopologyCloth,
    path: &Path,
) -> Result<(), FrameError> {
    let source = cache.source;
    let topology = part(source, cloth, cache.particles);
    let first = source.store.frame(source.frames[0])?;
    let position = |&particle: &u32| first.positions[particle as usize].map(f64::from);
    let positions: Vec<_> = cache.particles.iter().map(position).collect();
    let frame = Frame::new(source.frames[0] as u64, first.time, &positions);
    output_write(path, |writer| {
        obj_write(writer, &topology, &frame, &[]).map_err(FrameError::write(path))
    })
}

/// The topology of one cloth alone, with only `particles`.
fn part(source: &ContainerSource<'_>, cloth: &TopologyCloth, particles: &[u32]) -> Topology {
    let topology = source.topology;
    let number = |particle: u32| particles.partition_point(|&other| other < particle) as u32;
    let triangles: Vec<[u32; 3]> =
        topology.triangles[cloth.triangles.clone()].iter().map(|t| t.map(number)).collect();
    let lines = topology.lines[cloth.lines.clone()].iter().map(|line| line.map(number));
    let texture =
        topology.texture.as_ref().map(|texture| texture_part(texture, cloth.triangles.clone()));
    let mut part = Topology::single(&cloth.name, particles.len(), triangles, texture, source.rate);
    part.lines = lines.collect();
    part.cloths[0].lines = 0..part.lines.len();
    part
}

/// The texture coordinates that `triangles` use.
fn texture_part(texture: &TextureMap, triangles: Range<usize>) -> TextureMap {
    let mut numbers = HashMap::new();
    let mut part = TextureMap::default();
    for triangle in &texture.triangles[triangles] {
        part.triangles.push(triangle.map(|index| {
            *numbers.entry(index).or_insert_with(|| {
                part.coordinates.push(texture.coordinates[index as usize]);
                part.coordinates.len() as u32 - 1
            })
        }));
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_cloths_give_files_of_their_own_in_the_same_folder() {
        let topology = |names: &[&str]| Topology {
            cloths: names
                .iter()
                .map(|name| TopologyCloth { name: (*name).to_owned(), ..TopologyCloth::default() })
                .collect(),
            ..Topology::default()
        };
        let files = |names: &[&str]| -> Vec<String> {
            let files = cache_files(Path::new("out/run.pc2"), &topology(names));
            let text = |path: PathBuf| path.display().to_string().replace('\\', "/");
            files.into_iter().flat_map(|files| [text(files.cache), text(files.mesh)]).collect()
        };
        assert_eq!(files(&["shirt"]), ["out/run.pc2", "out/run_mesh.obj"]);
        assert_eq!(
            files(&["a/b", "A b", "../x"]),
            [
                "out/run_a-b.pc2",
                "out/run_a-b_mesh.obj",
                "out/run_A-b_2.pc2",
                "out/run_A-b_2_mesh.obj",
                "out/run_---x.pc2",
                "out/run_---x_mesh.obj"
            ]
        );
    }
}
