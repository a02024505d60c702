//! Attachments: from names to places on colliders and rigid bodies, and to springs between cloths.

use std::collections::BTreeSet;

use cloth_core::{Cloth, Collider, ColliderShape, Geometry, Meshing, Seam, SeamTie, TriangleMesh};
use cloth_rigid::{ClosestPoint, ClosestPoints, RigidError};
use glam::{DQuat, DVec3};

use crate::{
    Scene, SceneAttachment, SceneError,
    error::SceneUnknown,
    timeline::{AttachmentTrack, Held, Hold},
};

use super::{
    Check,
    pins::{NAMED_MAX, PinSets},
    rigid_hold::{HeldPoint, RigidHold},
};

/// Corners of less weight have no spring.
const WEIGHT_MIN: f64 = 1e-3;
/// Shortest spring to another cloth \[m\]: one of no length has no direction.
const LENGTH_MIN: f64 = 1e-4;
/// When springs have their length \[s\]: at once.
const CLOSING: [f64; 2] = [0.0, 1e-3];

/// What attachments ask of cloths: where these are at the start, one for each cloth; empty if there are none.
#[derive(Default)]
pub(super) struct ClothSurfaces {
    list: Vec<TriangleMesh>,
}

impl ClothSurfaces {
    /// Keeps the surface of the next cloth.
    pub(super) fn add(&mut self, scene: &Scene, cloth: &Cloth) {
        if scene.attachments.is_empty() {
            return;
        }
        let bare = |positions: Vec<[f64; 3]>, triangles| TriangleMesh {
            positions,
            triangles,
            ..TriangleMesh::default()
        };
        self.list.push(match &cloth.geometry {
            Geometry::Mesh(mesh) => bare(mesh.positions.clone(), mesh.triangles.clone()),
            Geometry::Grid(patch) => patch.mesh(Meshing::default()),
            Geometry::Network(network) => bare(network.positions.clone(), Vec::new()),
        });
    }

    /// The first particle of a cloth.
    fn first(&self, cloth: usize) -> u32 {
        self.list[..cloth].iter().map(|mesh| mesh.positions.len() as u32).sum()
    }
}

/// The cloth that an attachment is of.
fn cloth_of<'a>(scene: &'a Scene, attachment: &'a SceneAttachment) -> Option<&'a str> {
    match (&attachment.cloth, &scene.cloths[..]) {
        (Some(name), _) => Some(name),
        (None, [cloth]) => Some(&cloth.name),
        (None, _) => None,
    }
}

/// What attachments are.
#[derive(Default)]
pub(super) struct Attachments {
    /// Those to other cloths.
    pub(super) seams: Vec<Seam>,
    /// Those to colliders.
    pub(super) tracks: Vec<AttachmentTrack>,
    /// Those to rigid bodies.
    pub(super) rigid_holds: Vec<RigidHold>,
}

/// The rigid body of a name.
fn body_of(scene: &Scene, name: &str) -> Option<usize> {
    scene.rigids.iter().position(|rigid| rigid.name == name)
}

/// The particles of the cloth called `name` that colliders hold by force.
pub(super) fn held(
    scene: &Scene,
    check: &Check<'_>,
    name: &str,
    sets: &PinSets,
) -> Result<Vec<u32>, SceneError> {
    let mut held = Vec::new();
    for (index, attachment) in scene.attachments.iter().enumerate() {
        let is_forced = attachment.stiffness.is_none() && body_of(scene, &attachment.to).is_none();
        if is_forced && cloth_of(scene, attachment) == Some(name) {
            held.extend(vertices(check, index, attachment, sets)?);
        }
    }
    Ok(held)
}

/// The particles that an attachment names, ascending.
fn vertices(
    check: &Check<'_>,
    index: usize,
    attachment: &SceneAttachment,
    sets: &PinSets,
) -> Result<Vec<u32>, SceneError> {
    let key = format!("attachment[{index}].vertices");
    if attachment.vertices.is_empty() {
        return Err(check.error(&key, "is empty: name the vertices that are held"));
    }
    let mut named = Vec::new();
    for pin in &attachment.vertices {
        named.extend(sets.resolve(check, &key, pin)?);
        if named.len() as u64 > NAMED_MAX {
            let problem = format!("name more than {NAMED_MAX} particles in all: name fewer sets");
            return Err(check.error(&key, &problem));
        }
    }
    named.sort_unstable();
    named.dedup();
    Ok(named)
}

/// The attachments of a scene. `colliders` are its own, and behind them those that its rigid bodies are.
pub(super) fn compile(
    scene: &Scene,
    check: &Check<'_>,
    (surfaces, pin_sets): (&ClothSurfaces, &[PinSets]),
    colliders: &[Collider],
) -> Result<Attachments, SceneError> {
    let Attachments { mut seams, mut tracks, mut rigid_holds } = Attachments::default();
    let mut sprung = BTreeSet::new();
    for (index, attachment) in scene.attachments.iter().enumerate() {
        let key = format!("attachment[{index}]");
        let hook = Hook { check, key: &key, attachment };
        hook.numbers_check()?;
        let Some(name) = cloth_of(scene, attachment) else {
            return Err(check.error(&key, "does not say which cloth it is of: give `cloth`"));
        };
        let number_of = |name: &str| scene.cloths.iter().position(|cloth| cloth.name == name);
        let known_cloths = || scene.cloths.iter().map(|cloth| cloth.name.clone());
        let Some(cloth) = number_of(name) else {
            let place = check.place(&format!("{key}.cloth"));
            return Err(SceneUnknown::error(place, "cloth", name, known_cloths().collect()));
        };
        let particles = vertices(check, index, attachment, &pin_sets[cloth])?;
        let own = &surfaces.list[cloth];
        if let Some(far) = particles.iter().find(|&&i| i as usize >= own.positions.len()) {
            let count = own.positions.len();
            let problem = format!(
                "names vertex {far}, and cloth {name:?} has {count}: vertices count from 0"
            );
            return Err(check.error(&format!("{key}.vertices"), &problem));
        }
        let weights = hook.weights(&pin_sets[cloth], own.positions.len())?;
        let places: Vec<Place> = particles
            .iter()
            .map(|&vertex| Place {
                vertex,
                at: own.positions[vertex as usize],
                weight: weights[vertex as usize],
            })
            .filter(|place| place.weight > 0.0)
            .collect();
        let to = &attachment.to;
        let first = surfaces.first(cloth);
        let own = scene.colliders.iter().position(|collider| collider.name == *to);
        let body = body_of(scene, to);
        // Later springs on a particle would take the place of earlier ones.
        let has_springs = body.is_some() || own.is_some() && attachment.stiffness.is_some();
        if let Some(twice) =
            places.iter().find(|place| has_springs && !sprung.insert(first + place.vertex))
        {
            let problem = format!(
                "names vertex {}, which another attachment holds by a spring already: name it in one of them",
                twice.vertex
            );
            return Err(check.error(&format!("{key}.vertices"), &problem));
        }
        if let Some(number) = own {
            tracks.push(hook.to_collider((number as u32, &colliders[number]), first, &places)?);
        } else if let Some(body) = body {
            let solid = &colliders[scene.colliders.len() + body];
            rigid_holds.push(hook.to_rigid((body, solid), first, &places)?);
        } else if let Some(other) = number_of(to) {
            seams.push(hook.to_cloth([name, to], &surfaces.list[other], &places)?);
        } else {
            let known = scene.colliders.iter().map(|collider| collider.name.clone());
            let known = known.chain(scene.rigids.iter().map(|rigid| rigid.name.clone()));
            let known = known.chain(known_cloths()).collect();
            let place = check.place(&format!("{key}.to"));
            return Err(SceneUnknown::error(place, "collider, rigid body or cloth", to, known));
        }
    }
    Ok(Attachments { seams, tracks, rigid_holds })
}

/// A vertex that is held.
struct Place {
    /// Its number in its cloth.
    vertex: u32,
    /// Where it is at the start \[m\].
    at: [f64; 3],
    /// By which its stiffness is multiplied.
    weight: f64,
}

/// One attachment.
struct Hook<'a> {
    check: &'a Check<'a>,
    key: &'a str,
    attachment: &'a SceneAttachment,
}

impl Hook<'_> {
    fn numbers_check(&self) -> Result<(), SceneError> {
        let Self { check, key, attachment } = self;
        check.positive(&format!("{key}.reach"), attachment.reach)?;
        if let Some(stiffness) = attachment.stiffness {
            check.positive(&format!("{key}.stiffness"), stiffness)?;
        }
        if let Some(damping) = attachment.damping {
            check.not_negative(&format!("{key}.damping"), damping)?;
            if attachment.stiffness.is_none() {
                let problem = "belongs to a hold with `stiffness`, which is not given: give both, or remove it";
                return Err(check.error(&format!("{key}.damping"), problem));
            }
        }
        attachment
            .release
            .map_or(Ok(()), |release| check.not_negative(&format!("{key}.release"), release))
    }

    /// The weight of each vertex of its cloth.
    fn weights(&self, sets: &PinSets, count: usize) -> Result<Vec<f64>, SceneError> {
        let Self { check, key, attachment } = self;
        let Some(name) = &attachment.weights else { return Ok(vec![1.0; count]) };
        let key = format!("{key}.weights");
        if attachment.stiffness.is_none() {
            let problem =
                "belongs to a hold with `stiffness`, which is not given: give both, or remove it";
            return Err(check.error(&key, problem));
        }
        let values = sets.values(check, &key, name)?;
        let of = |i: usize| f64::from(values.get(i).copied().unwrap_or_default());
        if let Some(i) = (0..count).find(|&i| !of(i).is_finite() || of(i) < 0.0) {
            let problem = format!("is {} at vertex {i}: a weight is 0 or more", of(i));
            return Err(check.error(&key, &problem));
        }
        Ok((0..count).map(of).collect())
    }

    /// An error if a vertex is farther away than it may be.
    fn reach_check(&self, vertex: u32, distance: f64) -> Result<(), SceneError> {
        let SceneAttachment { to, reach, .. } = self.attachment;
        if distance <= *reach {
            return Ok(());
        }
        let problem = format!(
            "is {reach} m, and vertex {vertex} is {distance:.4} m from {to:?}: move it there, name other vertices, or give a larger reach"
        );
        Err(self.check.error(&format!("{}.reach", self.key), &problem))
    }

    fn closest(&self, mesh: &TriangleMesh) -> Result<ClosestPoints, SceneError> {
        let of = |error: RigidError| {
            super::solid::place(self.check, &format!("{}.to", self.key), &error)
        };
        ClosestPoints::new(&self.attachment.to, mesh).map_err(of)
    }

    /// Vertices of the cloth whose particles begin at `first`, on a collider.
    fn to_collider(
        &self,
        (number, collider): (u32, &Collider),
        first: u32,
        places: &[Place],
    ) -> Result<AttachmentTrack, SceneError> {
        let SceneAttachment { stiffness, damping, release, .. } = self.attachment;
        Ok(AttachmentTrack {
            collider: number,
            pose: collider.pose,
            shape: collider.shape.clone(),
            holds: self.holds(collider, first, places)?,
            spring: stiffness.map(|stiffness| [stiffness, damping.unwrap_or(0.0)]),
            release: *release,
        })
    }

    /// The same, on a rigid body, which is the collider `solid` for the cloth.
    fn to_rigid(
        &self,
        (body, solid): (usize, &Collider),
        first: u32,
        places: &[Place],
    ) -> Result<RigidHold, SceneError> {
        let point = |Held { particle, hold, weight }: Held| match hold {
            Hold::Local(place) => Some(HeldPoint { particle, place, weight }),
            // No shape of a rigid body changes.
            Hold::Face { .. } => None,
        };
        let points = self.holds(solid, first, places)?.into_iter().filter_map(point).collect();
        let &SceneAttachment { stiffness, damping, release, .. } = self.attachment;
        Ok(RigidHold { body, points, stiffness, damping, release })
    }

    /// Where a solid holds vertices.
    fn holds(
        &self,
        collider: &Collider,
        first: u32,
        places: &[Place],
    ) -> Result<Vec<Held>, SceneError> {
        let Collider { shape, pose, .. } = collider;
        let rotation = DQuat::from_array(pose.rotation).inverse();
        let local = |at: [f64; 3]| -> [f64; 3] {
            (rotation * (DVec3::from(at) - DVec3::from(pose.translation))).into()
        };
        let is_mesh = matches!(shape, ColliderShape::Grid(_) | ColliderShape::Surface(_));
        let triangles = shape.body_triangles().filter(|_| is_mesh);
        let mesh = triangles.map(|triangles| TriangleMesh {
            positions: shape.body_positions(shape.sets_at(0.0)).into_owned(),
            triangles: triangles.to_vec(),
            ..TriangleMesh::default()
        });
        let surface = mesh.as_ref().map(|mesh| self.closest(mesh)).transpose()?;
        let mut holds = Vec::with_capacity(places.len());
        for &Place { vertex, at, weight } in places {
            let at = local(at);
            let hold = match (&mesh, &surface) {
                (Some(mesh), Some(surface)) => {
                    let ClosestPoint { face, weights, distance } = surface.of(at);
                    self.reach_check(vertex, distance)?;
                    let corners = mesh.triangles[face as usize];
                    match shape.changes() {
                        true => Hold::on_face(&mesh.positions, corners, weights, at),
                        false => Hold::Local(at),
                    }
                }
                _ => {
                    self.reach_check(vertex, distance(shape, at))?;
                    Hold::Local(at)
                }
            };
            holds.push(Held { particle: first + vertex, hold, weight });
        }
        Ok(holds)
    }

    /// Springs from vertices to the corners of the triangles of another cloth that are closest.
    fn to_cloth(
        &self,
        [name, other]: [&str; 2],
        mesh: &TriangleMesh,
        places: &[Place],
    ) -> Result<Seam, SceneError> {
        let Self { check, key, attachment } = self;
        let Some(stiffness) = attachment.stiffness else {
            let problem = format!(
                "is the cloth {other:?}, to which only springs can hold: give `stiffness`, or put both into one cloth and sew them"
            );
            return Err(check.error(&format!("{key}.to"), &problem));
        };
        if name == other {
            let problem = format!(
                "is the cloth {name:?} itself: name another one, or sew its vertices by a `[[seam]]`"
            );
            return Err(check.error(&format!("{key}.to"), &problem));
        }
        if attachment.release.is_some() {
            let problem = "is for holds of colliders: a cloth does not let go; remove it";
            return Err(check.error(&format!("{key}.release"), problem));
        }
        if mesh.triangles.is_empty() {
            let problem = format!(
                "is the cloth {other:?}, which has no triangles that could hold: name another, or attach its vertices to {name:?} instead"
            );
            return Err(check.error(&format!("{key}.to"), &problem));
        }
        let surface = self.closest(mesh)?;
        let (mut stitches, mut ties) = (Vec::new(), Vec::new());
        for &Place { vertex, at, weight: goal } in places {
            let ClosestPoint { face, weights, distance } = surface.of(at);
            self.reach_check(vertex, distance)?;
            for (corner, weight) in mesh.triangles[face as usize].into_iter().zip(weights) {
                if weight >= WEIGHT_MIN {
                    let to = DVec3::from(mesh.positions[corner as usize]);
                    stitches.push([vertex, corner]);
                    let length = DVec3::from(at).distance(to).max(LENGTH_MIN);
                    ties.push(SeamTie { length, share: goal * weight });
                }
            }
        }
        Ok(Seam {
            cloths: [name.to_owned(), other.to_owned()],
            stiffness,
            damping: attachment.damping,
            closing: CLOSING,
            weld: false,
            ties,
            ..Seam::new(attachment.name.clone(), name, stitches)
        })
    }
}

/// Distance of a point of the local frame from the surface of a solid \[m\]; zero for shapes that are meshes.
fn distance(shape: &ColliderShape, at: [f64; 3]) -> f64 {
    let at = DVec3::from(at);
    match *shape {
        ColliderShape::Plane => at.z.abs(),
        ColliderShape::Sphere { radius } => (at.length() - radius).abs(),
        ColliderShape::Capsule { half_length, radius } => {
            let along = at.z.clamp(-half_length, half_length);
            ((at - DVec3::new(0.0, 0.0, along)).length() - radius).abs()
        }
        ColliderShape::Box { half_extents } => {
            let beyond = at.abs() - DVec3::from(half_extents);
            (beyond.max(DVec3::ZERO).length() + beyond.max_element().min(0.0)).abs()
        }
        ColliderShape::Grid(_) | ColliderShape::Surface(_) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_from_solids() {
        let half_extents = [1.0, 2.0, 3.0];
        for (shape, at, expected) in [
            (ColliderShape::Plane, [5.0, 1.0, -0.25], 0.25),
            (ColliderShape::Sphere { radius: 2.0 }, [0.0, 1.5, 0.0], 0.5),
            (ColliderShape::Capsule { half_length: 1.0, radius: 0.5 }, [0.0, 3.0, 5.0], 4.5),
            (ColliderShape::Capsule { half_length: 1.0, radius: 0.5 }, [0.75, 0.0, 0.5], 0.25),
            (ColliderShape::Box { half_extents }, [4.0, 6.0, 0.0], 5.0),
            (ColliderShape::Box { half_extents }, [0.25, 0.0, 0.0], 0.75),
        ] {
            assert!((distance(&shape, at) - expected).abs() < 1e-12, "{shape:?} {at:?}");
        }
    }
}
