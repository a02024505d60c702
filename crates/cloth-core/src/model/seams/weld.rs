//! A model whose closed seams are gone: the vertices of each stitch are one particle.

use super::{Seam, SeamError, VertexClasses};
use crate::{
    Cloth, ClothMaterial, Geometry, Meshing, Model, ModelBuilder, ModelError, RestSource, State,
    TriangleMesh, contact::Ghost,
};

/// A welded model, and where the particles of the model before it are in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Weld {
    /// The welded model. Seams that are not welded are in it as closed.
    pub model: Model,
    /// For each particle of the model before, the one that it became.
    pub map: Vec<u32>,
}

impl ModelBuilder {
    /// The model with all seams welded that are to be; `None` if none is.
    ///
    /// # Errors
    /// [`SeamError`] for what cannot be welded, and whatever [`Self::build`] finds in the welded cloths.
    pub fn weld(&self) -> Result<Option<Weld>, ModelError> {
        if !self.seams.iter().any(|seam| seam.weld) {
            return Ok(None);
        }
        let mut builder = self.clone();
        builder.cloths.clear();
        builder.seams.clear();
        let mut map = Vec::new();
        let mut maps = Vec::with_capacity(self.cloths.len());
        for cloth in &self.cloths {
            let (cloth, of_cloth) = self.cloth_weld(cloth)?;
            let first = maps.iter().map(|(_, _, count)| count).sum::<u32>();
            map.extend(of_cloth.iter().map(|particle| first + particle));
            let count = of_cloth.iter().max().map_or(0, |last| last + 1);
            maps.push((cloth.name.clone(), of_cloth, count));
            builder = builder.cloth(cloth);
        }
        for seam in self.seams.iter().filter(|seam| !seam.weld) {
            let find = |name: &String| maps.iter().find(|(cloth, ..)| cloth == name);
            let [Some((_, first, _)), Some((_, second, _))] = seam.cloths.each_ref().map(find)
            else {
                continue;
            };
            let both = [first, second];
            let end =
                |stitch: &[u32; 2], side: usize| both[side].get(stitch[side] as usize).copied();
            let mut tied: Vec<_> = seam
                .tied()
                .filter_map(|(stitch, tie)| Some(([end(&stitch, 0)?, end(&stitch, 1)?], tie)))
                .filter(|([a, b], _)| a != b || seam.cloths[0] != seam.cloths[1])
                .collect();
            tied.sort_by_key(|(stitch, _)| *stitch);
            tied.dedup_by_key(|(stitch, _)| *stitch);
            let (stitches, ties): (Vec<_>, Vec<_>) = tied.into_iter().unzip();
            if !stitches.is_empty() {
                let ties = if seam.ties.is_empty() { Vec::new() } else { ties };
                builder = builder.seam(Seam { stitches, ties, ..seam.clone() });
            }
        }
        Ok(Some(Weld { model: builder.build()?, map }))
    }

    /// A cloth with its seams welded, and what its vertices become.
    fn cloth_weld(&self, cloth: &Cloth) -> Result<(Cloth, Vec<u32>), ModelError> {
        let count = cloth.geometry.particle_count() as u32;
        let mut classes = VertexClasses::new(count as usize);
        let mut last = None;
        for seam in self.seams.iter().filter(|seam| seam.weld && seam.cloths.contains(&cloth.name))
        {
            if seam.cloths[0] != seam.cloths[1] {
                let (seam, cloths) = (seam.name.clone(), seam.cloths.clone());
                return Err(SeamError::WeldBetweenCloths { seam, cloths }.into());
            }
            for &[a, b] in &seam.stitches {
                if let Some(&vertex) = [a, b].iter().find(|&&vertex| vertex >= count) {
                    let (seam, cloth) = (seam.name.clone(), cloth.name.clone());
                    return Err(
                        SeamError::OutOfRange { seam, cloth, vertex, vertices: count }.into()
                    );
                }
                classes.join(a, b);
            }
            last = Some(&seam.name);
        }
        let Some(seam) = last else { return Ok((cloth.clone(), (0..count).collect())) };
        let has_pattern = matches!(&cloth.material, ClothMaterial::Fabric(fabric) if matches!(fabric.rest, RestSource::Pattern { .. }));
        let mesh = match &cloth.geometry {
            Geometry::Mesh(mesh) if has_pattern => mesh.clone(),
            Geometry::Grid(patch) if has_pattern => patch.mesh(Meshing::default()),
            _ => {
                let (seam, cloth) = (seam.clone(), cloth.name.clone());
                return Err(SeamError::WeldWithoutPattern { seam, cloth }.into());
            }
        };
        let (mesh, map) = mesh_weld(mesh, &classes, &cloth.name)?;
        let mut pins: Vec<u32> =
            cloth.pins.iter().filter_map(|&pin| map.get(pin as usize).copied()).collect();
        pins.sort_unstable();
        pins.dedup();
        Ok((Cloth { geometry: Geometry::Mesh(mesh), pins, ..cloth.clone() }, map))
    }
}

fn mesh_weld(
    mesh: TriangleMesh,
    classes: &VertexClasses,
    cloth: &str,
) -> Result<(TriangleMesh, Vec<u32>), ModelError> {
    let mut map = Vec::with_capacity(mesh.positions.len());
    let mut sums: Vec<(glam::DVec3, f64)> = Vec::new();
    for (vertex, &position) in (0..).zip(&mesh.positions) {
        let name = classes.of(vertex);
        if name == vertex {
            map.push(sums.len() as u32);
            sums.push((glam::DVec3::ZERO, 0.0));
        } else {
            // The name of a class is its smallest vertex, which has been met.
            map.push(map[name as usize]);
        }
        let (sum, count) = &mut sums[map[vertex as usize] as usize];
        *sum += glam::DVec3::from(position);
        *count += 1.0;
    }
    let mut triangles = mesh.triangles;
    for (index, triangle) in triangles.iter_mut().enumerate() {
        let before = *triangle;
        *triangle = before.map(|vertex| map[vertex as usize]);
        if let Some(k) = (0..3).find(|&k| triangle[k] == triangle[(k + 1) % 3]) {
            return Err(SeamError::Collapses {
                cloth: cloth.into(),
                triangle: index,
                vertices: [before[k], before[(k + 1) % 3]],
            }
            .into());
        }
    }
    let positions = sums.iter().map(|(sum, count)| (*sum / *count).into()).collect();
    Ok((
        TriangleMesh { positions, triangles, groups: Vec::new(), attributes: Vec::new(), ..mesh },
        map,
    ))
}

impl Weld {
    /// The state of the welded model that follows from one of the model before, whose particles have these `masses` \[kg\]. Particles that become one
    /// keep the centre of mass and the momentum that they had together; where they are one already, they keep their bits.
    #[must_use]
    pub fn contract(&self, masses: &[f64], state: &State) -> State {
        let count = self.model.particle_count();
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); count];
        for (particle, &became) in self.map.iter().enumerate() {
            members[became as usize].push(particle);
        }
        let mean = |values: &[[f64; 3]], members: &[usize]| {
            let first = values[members[0]];
            if members.iter().all(|&i| values[i].map(f64::to_bits) == first.map(f64::to_bits)) {
                return first;
            }
            let mass: f64 = members.iter().map(|&i| masses[i]).sum();
            std::array::from_fn(|k| {
                members.iter().map(|&i| masses[i] * values[i][k]).sum::<f64>() / mass
            })
        };
        // A particle that is held holds those that become one with it.
        let carriers: Vec<Vec<usize>> = members
            .into_iter()
            .map(|members| {
                let held = members.iter().copied().filter(|&i| state.held[i] != 0);
                let held: Vec<usize> = held.collect();
                if held.is_empty() { members } else { held }
            })
            .collect();
        State {
            positions: carriers.iter().map(|of| mean(&state.positions, of)).collect(),
            velocities: carriers.iter().map(|of| mean(&state.velocities, of)).collect(),
            held: carriers.iter().map(|of| state.held[of[0]]).collect(),
            // Contacts have other numbers now.
            slips: Vec::new(),
            ghosts: self.ghosts(&state.ghosts),
            ..state.clone()
        }
    }

    /// Ghosts as particles of the welded model.
    fn ghosts(&self, ghosts: &[Ghost]) -> Vec<Ghost> {
        let became =
            |ghost: &Ghost| Ghost { particle: self.map[ghost.particle as usize], ..ghost.clone() };
        let mut ghosts: Vec<_> = ghosts.iter().map(became).collect();
        ghosts.sort_by_key(|ghost| ghost.particle);
        ghosts.dedup_by_key(|ghost| ghost.particle);
        ghosts
    }

    /// Whether the particles of each stitch that is welded are one in `state`, to the last bit.
    #[must_use]
    pub fn is_done_in(&self, state: &State) -> bool {
        let mut first = vec![None; self.model.particle_count()];
        self.map.iter().enumerate().all(|(i, &became)| {
            let bits = |values: &[[f64; 3]]| values.get(i).map(|value| value.map(f64::to_bits));
            let found = (bits(&state.positions), bits(&state.velocities));
            *first[became as usize].get_or_insert(found) == found
        })
    }

    /// A value for each particle of the model before, from one for each of the welded model.
    #[must_use]
    pub fn expand<T: Copy>(&self, values: &[T]) -> Vec<T> {
        self.map.iter().map(|&particle| values[particle as usize]).collect()
    }
}
