//! What stays the same in all frames of a run.

use std::hash::Hasher;
use std::ops::Range;

use cloth_core::{StrainGauge, TextureMap};
use siphasher::sip::SipHasher13;

use super::FrameError;

/// The connectivity of all cloths of a run and its frame rate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Topology {
    /// Particle indices of each triangle, zero based, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Particle indices of each line: springs of ropes and networks, which have no triangles.
    pub lines: Vec<[u32; 2]>,
    /// Texture coordinates with indices of their own, if any.
    pub texture: Option<TextureMap>,
    /// Number of particles in each frame.
    pub particle_count: usize,
    /// The cloths; together they cover all particles, triangles and lines.
    pub cloths: Vec<TopologyCloth>,
    /// Frames in a second of simulated time \[1/s\].
    pub frames_per_second: f64,
    /// What tells strain and stress of the triangles of fabric; empty if there are none.
    pub gauge: StrainGauge,
}

/// One cloth of a [`Topology`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TopologyCloth {
    /// Name of the cloth in the scene.
    pub name: String,
    /// Its particles.
    pub particles: Range<usize>,
    /// Its triangles, which use only its particles.
    pub triangles: Range<usize>,
    /// Its lines, which use only its particles.
    pub lines: Range<usize>,
}

impl Topology {
    /// A topology with a single cloth called `name`.
    #[must_use]
    pub fn single(
        name: &str,
        particle_count: usize,
        triangles: Vec<[u32; 3]>,
        texture: Option<TextureMap>,
        frames_per_second: f64,
    ) -> Self {
        let cloth = TopologyCloth {
            name: name.to_owned(),
            particles: 0..particle_count,
            triangles: 0..triangles.len(),
            lines: 0..0,
        };
        let (lines, cloths) = (Vec::new(), vec![cloth]);
        let gauge = StrainGauge::default();
        Self { triangles, lines, texture, particle_count, cloths, frames_per_second, gauge }
    }

    /// A hash of particle count, triangles and lines, the same on all machines and in all versions. Two
    /// runs with the same hash can share a [`FrameStore`](crate::FrameStore).
    #[must_use]
    pub fn hash(&self) -> u64 {
        let mut hasher = SipHasher13::new();
        hasher.write(&(self.particle_count as u64).to_le_bytes());
        for index in self.triangles.iter().flatten() {
            hasher.write(&index.to_le_bytes());
        }
        // After an index that no triangle has, so that lines are not taken for triangles.
        if !self.lines.is_empty() {
            hasher.write(&u32::MAX.to_le_bytes());
        }
        for index in self.lines.iter().flatten() {
            hasher.write(&index.to_le_bytes());
        }
        hasher.finish()
    }

    /// Checks that all indices and ranges fit together.
    ///
    /// # Errors
    ///
    /// [`FrameError::Topology`] naming the part that does not fit.
    pub fn check(&self) -> Result<(), FrameError> {
        let fail = |problem: String| Err(FrameError::Topology { problem });
        if self.particle_count == 0 {
            return fail("it has no particles".to_owned());
        }
        if u32::try_from(self.particle_count).is_err() {
            return fail("it has more particles than 32 bits can index".to_owned());
        }
        if !(self.frames_per_second.is_finite() && self.frames_per_second > 0.0) {
            return fail(format!("{} frames per second", self.frames_per_second));
        }
        let count = self.particle_count;
        if let Some(number) = out_of_range(&self.triangles, count) {
            return fail(format!("triangle {number} uses a particle beyond {count}"));
        }
        if let Some(number) = out_of_range(&self.lines, count) {
            return fail(format!("line {number} uses a particle beyond {count}"));
        }
        if let Some(texture) = &self.texture {
            let count = texture.coordinates.len();
            if texture.triangles.len() != self.triangles.len() {
                return fail("the texture map has another number of triangles".to_owned());
            }
            if let Some(number) = out_of_range(&texture.triangles, count) {
                return fail(format!("triangle {number} uses a texture coordinate beyond {count}"));
            }
        }
        if !self.gauge.fits(count, self.triangles.len()) {
            return fail("the gauge of its strains is of another model".to_owned());
        }
        let mut particles_end = 0;
        let mut triangles_end = 0;
        let mut lines_end = 0;
        for cloth in &self.cloths {
            let starts = (cloth.particles.start, cloth.triangles.start, cloth.lines.start);
            let triangles = self.triangles.get(cloth.triangles.clone());
            let lines = self.lines.get(cloth.lines.clone());
            let own = |index: &u32| cloth.particles.contains(&(*index as usize));
            if starts != (particles_end, triangles_end, lines_end)
                || triangles.is_none_or(|triangles| !triangles.iter().flatten().all(own))
                || lines.is_none_or(|lines| !lines.iter().flatten().all(own))
            {
                return fail(format!("the ranges of cloth `{}` do not fit", cloth.name));
            }
            particles_end = cloth.particles.end;
            triangles_end = cloth.triangles.end;
            lines_end = cloth.lines.end;
        }
        let counts = (self.particle_count, self.triangles.len(), self.lines.len());
        if (particles_end, triangles_end, lines_end) != counts {
            return fail("the cloths do not cover all particles, triangles and lines".to_owned());
        }
        Ok(())
    }

    /// The particles of `cloth` that are in no triangle and no line: formats show them as points.
    pub(super) fn points(&self, cloth: &TopologyCloth) -> Vec<u32> {
        let first = cloth.particles.start as u32;
        let mut used = vec![false; cloth.particles.len()];
        let triangles = self.triangles[cloth.triangles.clone()].as_flattened();
        let lines = self.lines[cloth.lines.clone()].as_flattened();
        for &particle in triangles.iter().chain(lines) {
            used[(particle - first) as usize] = true;
        }
        let numbered = (first..).zip(used);
        numbered.filter(|&(_, used)| !used).map(|(particle, _)| particle).collect()
    }

    /// The texture coordinate of every particle, if there are texture coordinates and no particle
    /// has two of them, so that formats without texture seams can hold them.
    pub(super) fn texture_of_particles(&self) -> Option<Vec<[f64; 2]>> {
        let texture = self.texture.as_ref()?;
        let mut index_of_particle = vec![None; self.particle_count];
        let corners = self.triangles.iter().flatten();
        for (&particle, &index) in corners.zip(texture.triangles.iter().flatten()) {
            let coordinate = *texture.coordinates.get(index as usize)?;
            let slot = index_of_particle.get_mut(particle as usize)?;
            if slot.is_some_and(|other| other != coordinate) {
                return None;
            }
            *slot = Some(coordinate);
        }
        let coordinates = index_of_particle.into_iter();
        Some(coordinates.map(Option::unwrap_or_default).collect())
    }
}

/// The first triangle or line with an index of `count` or more.
fn out_of_range<const N: usize>(elements: &[[u32; N]], count: usize) -> Option<usize> {
    elements.iter().position(|element| element.iter().any(|&index| index as usize >= count))
}
