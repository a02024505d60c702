//! Meshes that change their shape.

use std::sync::Arc;

use cloth_core::{BodySurface, ColliderShape, TriangleMesh};
use cloth_io::vertex_normals;
use cloth_rigid::DistanceGridPlan;

use crate::{SceneAnimation, SceneError, SceneMesh};

use super::{
    Check, CompileOptions, mesh,
    solid::{self, Plans},
};

/// Most key frames of an animation.
pub(super) const FRAMES_MAX: u32 = 10_000;

/// Sets of distances that an animation takes, as far as can be told before its files are read.
pub(super) fn sets(animation: &SceneAnimation) -> u64 {
    // A cache says itself how many it has, and is read later.
    u64::from(animation.frames.unwrap_or(1)) + blend_steps(animation)
}

/// Sets from the mesh at rest to that before the first key frame.
fn blend_steps(animation: &SceneAnimation) -> u64 {
    let steps = animation.blend.map_or(0.0, |blend| (blend * animation.rate).round());
    if animation.rest.is_some() { (steps as u64).clamp(1, u64::from(FRAMES_MAX)) } else { 0 }
}

/// The signed distances of a mesh that changes its shape; errors are about `key`.
pub(super) fn compile(
    check: &Check<'_>,
    key: &str,
    name: &str,
    animation: &SceneAnimation,
    options: &CompileOptions,
    plans: &mut Plans,
) -> Result<ColliderShape, SceneError> {
    let reader = Reader { check, key, animation, options };
    reader.numbers_check()?;
    let mut meshes = match &animation.cache {
        Some(cache) => reader.cached(cache)?,
        None => reader.files()?,
    };
    reader.count_check(meshes.len())?;
    if let Some(rest) = reader.rest(&meshes)? {
        meshes.splice(0..0, rest);
        reader.count_check(meshes.len())?;
    }
    if plans.of_triangles() {
        return Ok(ColliderShape::Surface(Arc::new(surface(animation, meshes))));
    }
    let size = (animation.cells, solid::MARGIN);
    let plan = DistanceGridPlan::sequence(name, &meshes, animation.rate, size)
        .and_then(|plan| plan.waiting(animation.start).with_skin(animation.skin));
    Ok(plans.draft(key, plan.map_err(|error| solid::place(check, key, &error))?))
}

/// The triangles of a mesh that changes its shape, in its skin.
fn surface(animation: &SceneAnimation, meshes: Vec<TriangleMesh>) -> BodySurface {
    let triangles = meshes.first().map(|mesh| mesh.triangles.clone()).unwrap_or_default();
    let out = |mesh: TriangleMesh| {
        if animation.skin == 0.0 {
            return mesh.positions;
        }
        let normals = vertex_normals(&mesh.positions, &mesh.triangles);
        let pairs = mesh.positions.iter().zip(&normals);
        pairs.map(|(x, n)| [0, 1, 2].map(|k| x[k] + animation.skin * n[k])).collect()
    };
    let sets = meshes.into_iter().map(out).collect();
    BodySurface { triangles, sets, rate: animation.rate, start: animation.start }
}

struct Reader<'a> {
    check: &'a Check<'a>,
    key: &'a str,
    animation: &'a SceneAnimation,
    options: &'a CompileOptions,
}

impl Reader<'_> {
    fn wrong(&self, field: &str, problem: String) -> SceneError {
        let place = self.check.place(&format!("{}.{field}", self.key));
        SceneError::Value { place, problem }
    }

    fn numbers_check(&self) -> Result<(), SceneError> {
        let Self { check, key, animation, .. } = self;
        check.positive(&format!("{key}.rate"), animation.rate)?;
        for (field, value) in [("start", animation.start), ("skin", animation.skin)] {
            check.not_negative(&format!("{key}.{field}"), value)?;
        }
        match (animation.blend, &animation.rest) {
            (Some(_), None) => {
                let problem = "says how long the mesh at rest takes to the first key frame, and there is none: give `rest`, or remove it";
                return Err(check.error(&format!("{key}.blend"), problem));
            }
            (Some(blend), Some(_)) => check.positive(&format!("{key}.blend"), blend)?,
            (None, Some(_)) => {
                let problem = "is a mesh at rest that needs time to become the first key frame: give `blend`, in seconds";
                return Err(check.error(&format!("{key}.rest"), problem));
            }
            (None, None) => {}
        }
        solid::cells_check(check, key, animation.cells)
    }

    fn count_check(&self, count: usize) -> Result<(), SceneError> {
        if (1..=FRAMES_MAX as usize).contains(&count) {
            return Ok(());
        }
        let problem = format!("{count} key frames: give 1 to {FRAMES_MAX}");
        Err(self.wrong("frames", problem))
    }

    /// The mesh in a file, in its place.
    fn mesh(&self, file: &str) -> Result<TriangleMesh, SceneError> {
        let SceneAnimation { scale, rotation, translation, .. } = *self.animation;
        let mesh = SceneMesh { file: file.to_owned(), scale, rotation, translation };
        mesh::compile(self.check, self.key, &mesh, self.options)
    }

    /// A mesh for each file.
    fn files(&self) -> Result<Vec<TriangleMesh>, SceneError> {
        let SceneAnimation { file, first, .. } = self.animation;
        if !file.contains("{}") {
            let problem = format!(
                "`{file}` has no `{{}}` in the place of the number; if one file is moved by a point cache, name that as `cache`"
            );
            return Err(self.wrong("file", problem));
        }
        let Some(frames) = self.animation.frames else {
            let problem = "needs `frames`, the number of files";
            return Err(self.check.error(&format!("{}.file", self.key), problem));
        };
        self.count_check(frames as usize)?;
        let mut meshes: Vec<TriangleMesh> = Vec::with_capacity(frames as usize);
        let named =
            |number: u32| file.replace("{}", &(u64::from(*first) + u64::from(number)).to_string());
        for number in 0..frames {
            let mesh = self.mesh(&named(number))?;
            if let Some(one) = meshes.first() {
                self.same_check("file", [(&named(0), one), (&named(number), &mesh)])?;
            }
            meshes.push(mesh);
        }
        Ok(meshes)
    }

    /// One file, moved by a point cache.
    fn cached(&self, cache: &str) -> Result<Vec<TriangleMesh>, SceneError> {
        let SceneAnimation { file, first, frames, .. } = self.animation;
        let mesh = self.mesh(file)?;
        let outside = || SceneError::MeshOutside {
            place: self.check.place(&format!("{}.cache", self.key)),
            file: cache.to_owned(),
        };
        let directory = &self.check.origin().directory;
        let path = mesh::resolve(directory, cache, self.options).ok_or_else(outside)?;
        let place = || self.check.place(&format!("{}.cache", self.key));
        let read = cloth_io::point_cache_read(&path)
            .map_err(|source| SceneError::Mesh { place: place(), source })?;
        let [points, vertices] = [read.points, mesh.positions.len()];
        if points != vertices {
            let problem = format!(
                "`{cache}` moves {points} vertices, and the mesh `{file}` has {vertices}: export both from the same mesh"
            );
            return Err(self.wrong("cache", problem));
        }
        let found = read.samples.len();
        let end = frames.map_or(found as u64, |frames| u64::from(*first) + u64::from(frames));
        if u64::from(*first) >= end || end > found as u64 {
            let problem = format!(
                "`{cache}` has {found} key frames, and those from {first} to {end} are asked for: correct `first` or `frames`"
            );
            return Err(self.wrong("cache", problem));
        }
        let SceneAnimation { scale, rotation, translation, .. } = *self.animation;
        let moved = |positions: Vec<[f64; 3]>| {
            let mut mesh =
                TriangleMesh { positions, triangles: mesh.triangles.clone(), ..Default::default() };
            let placed = (scale, rotation, translation);
            mesh::transform(self.check, self.key, placed, &mut mesh).map(|()| mesh)
        };
        let taken =
            read.samples.into_iter().skip(*first as usize).take((end as usize) - *first as usize);
        taken.map(moved).collect()
    }

    /// The meshes from that at rest to before the first key frame, if there is one.
    fn rest(&self, meshes: &[TriangleMesh]) -> Result<Option<Vec<TriangleMesh>>, SceneError> {
        let (Some(file), Some(first)) = (&self.animation.rest, meshes.first()) else {
            return Ok(None);
        };
        let rest = self.mesh(file)?;
        self.same_check("rest", [("the first key frame", first), (file, &rest)])?;
        let steps = blend_steps(self.animation);
        let step = |number: u64| {
            let part = number as f64 / steps as f64;
            let share = part * part * (3.0 - 2.0 * part);
            let pairs = rest.positions.iter().zip(&first.positions);
            let positions = pairs.map(|(a, b)| [0, 1, 2].map(|k| a[k] + share * (b[k] - a[k])));
            TriangleMesh {
                positions: positions.collect(),
                triangles: first.triangles.clone(),
                ..TriangleMesh::default()
            }
        };
        Ok(Some((0..steps).map(step).collect()))
    }

    /// Refuses meshes that are not one that moves.
    fn same_check(
        &self,
        field: &str,
        [(first, one), (name, other)]: [(&str, &TriangleMesh); 2],
    ) -> Result<(), SceneError> {
        let counts = |mesh: &TriangleMesh| [mesh.positions.len(), mesh.triangles.len()];
        let ([a, b], [c, d]) = (counts(one), counts(other));
        let what = if [a, b] != [c, d] {
            format!("has {c} vertices and {d} triangles, and {first} has {a} and {b}")
        } else if let Some(face) = (0..b).find(|&face| one.triangles[face] != other.triangles[face])
        {
            let [own, those] = [other, one].map(|mesh| mesh.triangles[face]);
            format!("has a triangle {face} of vertices {own:?}, and {first} one of {those:?}")
        } else {
            return Ok(());
        };
        let problem = format!(
            "`{name}` {what}: an animation moves the vertices of one mesh; export all key frames with the same vertex order"
        );
        Err(self.wrong(field, problem))
    }
}
