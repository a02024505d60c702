//! A model in which several particles of another one are one: the vertices of each stitch of closed seams, and the corners of triangles at each
//! vertex of cloth that may tear.

use std::{collections::BTreeSet, sync::Arc};

use super::{Seam, SeamError, VertexClasses};
use crate::{
    Cloth, ClothMaterial, ContactMap, Geometry, MeshFold, Meshing, Model, ModelBuilder, ModelError,
    RestSource, State, Tear, TriangleMesh,
    contact::Ghost,
    model::tears::{Tears, part},
};

/// How far the sides of a tear are moved apart at rest \[m\], each: contact between them begins within that.
const TEAR_GAP: f64 = 1e-4;

/// A welded model, and where the particles of the model before it are in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Weld {
    /// The welded model. Seams that are not welded are in it as closed.
    pub model: Arc<Model>,
    /// For each particle of the model before, the one that it became.
    pub map: Vec<u32>,
}

/// What is one in a [`Weld`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Welding<'a> {
    /// Whether the seams are welded that are to be.
    pub sews: bool,
    /// Their stitches that are not, by their numbers among those of the model, ascending.
    pub open: &'a [u32],
    /// Edges of the model's [`Tears`] that are torn, ascending.
    pub torn: &'a [u32],
}

impl ModelBuilder {
    /// The model in which what `welding` says is one; `None` if nothing is.
    ///
    /// # Errors
    /// [`SeamError`] for what cannot be welded, and whatever [`Self::build`] finds in the welded cloths.
    pub fn weld(&self, welding: Welding<'_>) -> Result<Option<Weld>, ModelError> {
        let is_sewn = |seam: &Seam| seam.weld && welding.sews;
        if !self.seams.iter().any(is_sewn) && self.tears.is_empty() {
            return Ok(None);
        }
        let mut first_stitch = 0;
        // What is welded of each seam, and what is left of it.
        let mut sewn = Vec::new();
        let mut left = Vec::new();
        for seam in &self.seams {
            let numbers = first_stitch..first_stitch + seam.stitches.len() as u32;
            first_stitch = numbers.end;
            if !is_sewn(seam) {
                left.push(seam.clone());
                continue;
            }
            let both = numbers.zip(seam.stitches.iter().copied());
            let (open, closed): (Vec<_>, Vec<_>) =
                both.partition(|(number, _)| welding.open.binary_search(number).is_ok());
            let of = |stitches: Vec<(u32, [u32; 2])>| {
                let stitches = stitches.into_iter().map(|(_, stitch)| stitch).collect();
                Seam { stitches, ..seam.clone() }
            };
            sewn.push(of(closed));
            left.push(of(open));
        }
        let mut builder = self.clone();
        builder.cloths.clear();
        builder.seams.clear();
        builder.tears.clear();
        builder.contact_maps.clear();
        let mut map = Vec::new();
        let mut maps = Vec::with_capacity(self.cloths.len());
        // Edges are numbered from cloth to cloth, as in the model.
        let mut first_edge = 0;
        for cloth in &self.cloths {
            let tear = self.tears.iter().find(|tear| tear.cloth == cloth.name);
            let edges = first_edge..first_edge + tear.map_or(0, |tear| tear.edges.len() as u32);
            let is_own = |&edge: &u32| edges.contains(&edge);
            let torn = welding.torn.iter().copied().filter(is_own).map(|edge| edge - edges.start);
            let torn: Vec<u32> = torn.collect();
            first_edge = edges.end;
            let (welded, of_cloth) =
                cloth_weld(cloth, &sewn, tear.map(|tear| (tear, &torn[..])), welding.open)?;
            let first = maps.iter().map(|(_, _, count)| count).sum::<u32>();
            map.extend(of_cloth.iter().map(|particle| first + particle));
            let count = of_cloth.iter().max().map_or(0, |last| last + 1);
            for map in self.contact_maps.iter().filter(|map| map.cloth == cloth.name) {
                builder = builder.contact_map(map.of_welded(&of_cloth, count));
            }
            // Gas leaves through a tear.
            let is_open = tear.is_some() && !torn.is_empty();
            builder.inflations.retain(|gas| !is_open || gas.cloth != cloth.name);
            maps.push((cloth.name.clone(), of_cloth, count));
            builder = builder.cloth(welded);
        }
        // Where four pieces meet, two open stitches of two seams may be between the same two vertices now: one of them is enough.
        let mut known = BTreeSet::new();
        for seam in &left {
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
            let mut is_new = |&([a, b], _): &([u32; 2], _)| {
                let mut ends = [(&seam.cloths[0], a), (&seam.cloths[1], b)];
                ends.sort_unstable();
                known.insert(ends)
            };
            tied.retain(&mut is_new);
            let (stitches, ties): (Vec<_>, Vec<_>) = tied.into_iter().unzip();
            if !stitches.is_empty() {
                let ties = if seam.ties.is_empty() { Vec::new() } else { ties };
                builder = builder.seam(Seam { stitches, ties, ..seam.clone() });
            }
        }
        Ok(Some(Weld { model: Arc::new(builder.build()?), map }))
    }
}

/// A cloth with its seams welded and its corners joined but where they are torn, and what its vertices become.
fn cloth_weld(
    cloth: &Cloth,
    seams: &[Seam],
    tear: Option<(&Tear, &[u32])>,
    open: &[u32],
) -> Result<(Cloth, Vec<u32>), ModelError> {
    let count = cloth.geometry.particle_count() as u32;
    let mut classes = VertexClasses::new(count as usize);
    let mut last = None;
    for seam in seams.iter().filter(|seam| seam.cloths.contains(&cloth.name)) {
        if seam.cloths[0] != seam.cloths[1] {
            let (seam, cloths) = (seam.name.clone(), seam.cloths.clone());
            return Err(SeamError::WeldBetweenCloths { seam, cloths }.into());
        }
        for &[a, b] in &seam.stitches {
            if let Some(&vertex) = [a, b].iter().find(|&&vertex| vertex >= count) {
                let (seam, cloth) = (seam.name.clone(), cloth.name.clone());
                return Err(SeamError::OutOfRange { seam, cloth, vertex, vertices: count }.into());
            }
            classes.join(a, b);
        }
        last = Some(&seam.name);
    }
    if last.is_none() && tear.is_none() {
        return Ok((cloth.clone(), (0..count).collect()));
    }
    let has_pattern = matches!(&cloth.material, ClothMaterial::Fabric(fabric) if matches!(fabric.rest, RestSource::Pattern { .. }));
    let mut mesh = match &cloth.geometry {
        Geometry::Mesh(mesh) if has_pattern || last.is_none() => mesh.clone(),
        Geometry::Grid(patch) if has_pattern => patch.mesh(Meshing::default()),
        _ => {
            let (seam, cloth) = (last.cloned().unwrap_or_default(), cloth.name.clone());
            return Err(SeamError::WeldWithoutPattern { seam, cloth }.into());
        }
    };
    if let Some((tear, torn)) = tear {
        let tears = Tears::of_cloth(tear, torn);
        if tears.corner_max().is_some_and(|corner| corner >= count) {
            return Err(ModelError::TearOfAnother { cloth: cloth.name.clone() });
        }
        tears.join(&mut classes, false);
        let places = tears.places(count as usize);
        part((&mesh.triangles, &places), (&classes.all(), None), &mut mesh.positions, TEAR_GAP);
    }
    mesh.is_sewn_in_part = !open.is_empty();
    let (mesh, map) = mesh_weld(mesh, &classes, &cloth.name)?;
    let mut pins: Vec<u32> =
        cloth.pins.iter().filter_map(|&pin| map.get(pin as usize).copied()).collect();
    pins.sort_unstable();
    pins.dedup();
    Ok((Cloth { geometry: Geometry::Mesh(mesh), pins, ..cloth.clone() }, map))
}

impl ContactMap {
    /// The same for a cloth whose vertices became those of `map`, of which there are `count`: what became one has the mean factor.
    fn of_welded(&self, map: &[u32], count: u32) -> Self {
        let mean = |values: &[f64]| {
            let mut sums = vec![[0.0; 2]; if values.is_empty() { 0 } else { count as usize }];
            for (value, &became) in values.iter().zip(map) {
                let [sum, members] = &mut sums[became as usize];
                *sum += value;
                *members += 1.0;
            }
            sums.into_iter().map(|[sum, members]| sum / members).collect()
        };
        let (distance, friction) = (mean(&self.distance), mean(&self.friction));
        Self { cloth: self.cloth.clone(), distance, friction }
    }
}

fn mesh_weld(
    mesh: TriangleMesh,
    classes: &VertexClasses,
    cloth: &str,
) -> Result<(TriangleMesh, Vec<u32>), ModelError> {
    let mut map = Vec::with_capacity(mesh.positions.len());
    let mut members: Vec<Vec<[f64; 3]>> = Vec::new();
    for (vertex, &position) in (0..).zip(&mesh.positions) {
        let name = classes.of(vertex);
        if name == vertex {
            map.push(members.len() as u32);
            members.push(Vec::new());
        } else {
            // The name of a class is its smallest vertex, which has been met.
            map.push(map[name as usize]);
        }
        members[map[vertex as usize] as usize].push(position);
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
    // What is one place keeps its bits.
    let mean = |places: &Vec<[f64; 3]>| match places.iter().all(|place| *place == places[0]) {
        true => places[0],
        false => {
            let sum: glam::DVec3 = places.iter().copied().map(glam::DVec3::from).sum();
            (sum / places.len() as f64).into()
        }
    };
    let positions = members.iter().map(mean).collect();
    // Folds beyond the mesh are told by whoever makes cloth of it.
    let became = |vertex: u32| map.get(vertex as usize).copied().unwrap_or(vertex);
    let folds = mesh.folds.iter();
    let folds = folds.map(|fold| MeshFold { edge: fold.edge.map(became), ..*fold }).collect();
    let (groups, attributes) = (Vec::new(), Vec::new());
    Ok((TriangleMesh { positions, triangles, folds, groups, attributes, ..mesh }, map))
}

impl State {
    /// Position, velocity and whether it is held of what particles become that are one from here on: with the centre of mass and the momentum of all,
    /// whose masses \[kg\] are given. A particle that is held holds those that become one with it. What they have alike already keeps its bits.
    ///
    /// # Panics
    /// Without members, and with one that the state does not have.
    #[must_use]
    pub fn joined(&self, members: &[usize], masses: &[f64]) -> ([f64; 3], [f64; 3], u8) {
        let held: Vec<usize> = members.iter().copied().filter(|&i| self.held[i] != 0).collect();
        let carriers = if held.is_empty() { members } else { &held };
        let mean = |values: &[[f64; 3]]| {
            let first = values[carriers[0]];
            if carriers.iter().all(|&i| values[i].map(f64::to_bits) == first.map(f64::to_bits)) {
                return first;
            }
            let mass: f64 = carriers.iter().map(|&i| masses[i]).sum();
            std::array::from_fn(|k| {
                carriers.iter().map(|&i| masses[i] * values[i][k]).sum::<f64>() / mass
            })
        };
        (mean(&self.positions), mean(&self.velocities), self.held[carriers[0]])
    }
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
        let mut all = State {
            // Contacts have other numbers now.
            slips: Vec::new(),
            ghosts: self.ghosts(&state.ghosts),
            positions: Vec::with_capacity(count),
            velocities: Vec::with_capacity(count),
            held: Vec::with_capacity(count),
            ..state.clone()
        };
        for of_one in &members {
            let (position, velocity, held) = state.joined(of_one, masses);
            all.positions.push(position);
            all.velocities.push(velocity);
            all.held.push(held);
        }
        all
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

    /// The first of those that became each particle of the welded model.
    #[must_use]
    pub fn firsts(&self) -> Vec<u32> {
        let mut firsts = vec![0; self.model.particle_count()];
        for (own, &became) in self.map.iter().enumerate().rev() {
            firsts[became as usize] = own as u32;
        }
        firsts
    }

    /// Ghosts of the welded model as particles of the model before: each by the first of those that became one.
    #[must_use]
    pub fn ghosts_expanded(&self, ghosts: &[Ghost]) -> Vec<Ghost> {
        let firsts = self.firsts();
        let first = |became: u32| firsts.get(became as usize).copied().unwrap_or_default();
        let before = |ghost: &Ghost| Ghost { particle: first(ghost.particle), ..ghost.clone() };
        ghosts.iter().map(before).collect()
    }

    /// A value for each particle of the model before, from one for each of the welded model.
    #[must_use]
    pub fn expand<T: Copy>(&self, values: &[T]) -> Vec<T> {
        self.map.iter().map(|&particle| values[particle as usize]).collect()
    }
}
