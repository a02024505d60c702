//! The triangles of a scene that intersect at one moment.

use std::{borrow::Cow, collections::HashMap, ops::Range, sync::Arc};

use cloth_audit::{Intersection, Intersections, Surface, intersections};
use cloth_core::{ColliderShape, GridSets, Model, Pose};

/// Counts triangles that intersect in states and stored frames of a model, see [`cloth_audit`].
///
/// Its surfaces are the cloths, in their order, and after them the colliders that have a surface of finite size. Planes are left
/// out; so are ropes and nets.
#[derive(Clone, Debug)]
pub struct SceneAudit {
    model: Arc<Model>,
    cloths: Vec<ClothSurface>,
    /// Colliders that are no planes.
    bodies: Vec<usize>,
    /// What seams make one.
    classes: Option<Vec<u32>>,
}

/// Positions \[m\] and triangles of a collider.
type Body<'a> = (Vec<[f64; 3]>, Cow<'a, [[u32; 3]]>);

/// The faces of a box, whose corner k has bit 2 of k for the upper side in x, bit 1 in y, bit 0 in z.
const BOX: [[u32; 3]; 12] = {
    let quads =
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let mut triangles = [[0; 3]; 12];
    let mut face = 0;
    while face < 6 {
        let [a, b, c, d] = quads[face];
        triangles[2 * face] = [a, b, c];
        triangles[2 * face + 1] = [a, c, d];
        face += 1;
    }
    triangles
};

/// A body whose surface goes through itself.
#[derive(Clone, Debug, PartialEq)]
pub struct FoldedBody {
    /// Name of the collider.
    pub name: String,
    /// How many of its shapes were looked at.
    pub looked: usize,
    /// How many of these go through themselves.
    pub folded: usize,
    /// Pairs of triangles that intersect in the worst of these.
    pub pairs: u64,
    /// When it has that shape \[s\].
    pub time: f64,
    /// A place there where two triangles meet, in the local frame of the body \[m\].
    pub place: [f64; 3],
}

#[derive(Clone, Debug)]
struct ClothSurface {
    particles: Range<usize>,
    /// By particles of the cloth.
    triangles: Vec<[u32; 3]>,
}

impl SceneAudit {
    /// For the cloths and colliders of `model`.
    #[must_use]
    pub fn new(model: &Arc<Model>) -> Self {
        let cloths = model.cloths().iter().map(|cloth| {
            let first = cloth.particles.start;
            let of_cloth = cloth.triangles.start as usize..cloth.triangles.end as usize;
            let triangles = model.triangles()[of_cloth].iter();
            ClothSurface {
                particles: first as usize..cloth.particles.end as usize,
                triangles: triangles.map(|triangle| triangle.map(|i| i - first)).collect(),
            }
        });
        let cloths = cloths.collect();
        let is_body = |&i: &usize| !matches!(model.colliders()[i].shape, ColliderShape::Plane);
        let bodies = (0..model.colliders().len()).filter(is_body).collect();
        let is_one = !model.seams().is_empty() || !model.tears().is_empty();
        let classes = is_one.then(|| model.seam_classes().all());
        Self { model: Arc::clone(model), cloths, bodies, classes }
    }

    /// Looks at particles at `positions` \[m\] and colliders at `poses` at `time` \[s\]. Missing particles make their triangles
    /// [unusable](Intersections::unusable); a mesh collider without a pose is where it was at the start.
    #[must_use]
    pub fn at(&self, positions: &[[f64; 3]], poses: &[Pose], time: f64) -> Intersections {
        let bodies: Vec<Body<'_>> =
            self.bodies.iter().filter_map(|&body| self.body(body, poses, time)).collect();
        let sewn: Vec<Cow<'_, [[u32; 3]]>> =
            self.cloths.iter().map(|cloth| self.sewn(cloth, positions)).collect();
        let cloths = self.cloths.iter().zip(&sewn).map(|(cloth, triangles)| {
            let positions = positions.get(cloth.particles.clone()).unwrap_or_default();
            Surface::cloth(positions, triangles)
        });
        let bodies =
            bodies.iter().map(|(positions, triangles)| Surface::body(positions, triangles));
        intersections(&cloths.chain(bodies).collect::<Vec<_>>())
    }

    /// The triangles of a cloth; those that a closed seam joins share its particles, as do those that are not torn apart.
    fn sewn<'a>(&self, cloth: &'a ClothSurface, positions: &[[f64; 3]]) -> Cow<'a, [[u32; 3]]> {
        let Some(classes) = &self.classes else { return Cow::Borrowed(&cloth.triangles) };
        let first = cloth.particles.start;
        let bits = |i: usize| positions.get(i).map(|place| place.map(f64::to_bits));
        // The first particle of each class at each place stands for all of them.
        let mut firsts = HashMap::new();
        let one = |own: usize| *firsts.entry((classes[own], bits(own))).or_insert(own - first);
        let ones: Vec<usize> = cloth.particles.clone().map(one).collect();
        let one = |i: u32| ones.get(i as usize).map_or(i, |one| *one as u32);
        cloth.triangles.iter().map(|triangle| triangle.map(one)).collect()
    }

    fn body(&self, body: usize, poses: &[Pose], time: f64) -> Option<Body<'_>> {
        let collider = &self.model.colliders()[body];
        let pose = poses.get(body).unwrap_or(&collider.pose);
        let (positions, triangles): (Vec<_>, Cow<'_, [_]>) = match &collider.shape {
            ColliderShape::Grid(grid) => {
                (grid.positions_at(time), (&grid.surface.triangles[..]).into())
            }
            ColliderShape::Surface(surface) => {
                (surface.positions_at(time), (&surface.triangles[..]).into())
            }
            ColliderShape::Box { half_extents: [x, y, z] } => {
                let sides = |extent: &f64| [-extent, *extent];
                let corners = sides(x).into_iter().flat_map(|x| {
                    let edges = sides(y).into_iter();
                    edges.flat_map(move |y| sides(z).into_iter().map(move |z| [x, y, z]))
                });
                (corners.collect(), (&BOX[..]).into())
            }
            shape @ (ColliderShape::Sphere { .. } | ColliderShape::Capsule { .. }) => {
                (shape.body_positions(GridSets::default()).into_owned(), shape.body_triangles()?)
            }
            ColliderShape::Plane => return None,
        };
        Some((positions.iter().map(|&at| pose.point(at)).collect(), triangles))
    }

    /// The bodies given as triangles whose surfaces go through themselves, in any of the shapes that they take in the scene. Of a body with more than `most`
    /// triangles in all shapes together, only every second, third and so on is looked at. Contact keeps cloth out of such a surface on both sides, so that what
    /// is caught where it closes is pinched.
    #[must_use]
    pub fn folded_bodies(&self, most: usize) -> Vec<FoldedBody> {
        let bodies = self.bodies.iter().map(|&body| &self.model.colliders()[body]);
        let folded = bodies.filter_map(|body| {
            let (triangles, count, [start, rate]) = match &body.shape {
                ColliderShape::Grid(grid) => {
                    (&grid.surface.triangles, grid.set_count(), [grid.start, grid.rate])
                }
                ColliderShape::Surface(surface) => {
                    (&surface.triangles, surface.sets.len(), [surface.start, surface.rate])
                }
                _ => return None,
            };
            let stride = (count * triangles.len()).div_ceil(most.max(1)).max(1);
            let mut found = FoldedBody {
                name: body.name.clone(),
                looked: 0,
                folded: 0,
                pairs: 0,
                time: 0.0,
                place: [0.0; 3],
            };
            for set in (0..count).step_by(stride) {
                let time = if set == 0 { start } else { start + set as f64 / rate };
                let positions = match &body.shape {
                    ColliderShape::Surface(surface) => Cow::Borrowed(&surface.sets[set][..]),
                    shape => shape.body_positions(shape.sets_at(time)),
                };
                let own = intersections(&[Surface::cloth(&positions, triangles)]);
                found.looked += 1;
                found.folded += usize::from(own.within > 0);
                if let Some(first) = own.first.filter(|_| own.within > found.pairs) {
                    (found.pairs, found.time, found.place) = (own.within, time, first.place);
                }
            }
            (found.folded > 0).then_some(found)
        });
        folded.collect()
    }

    /// Name of a surface.
    #[must_use]
    pub fn name(&self, surface: usize) -> &str {
        match surface.checked_sub(self.cloths.len()) {
            None => &self.model.cloths()[surface].name,
            Some(body) => &self.model.colliders()[self.bodies[body]].name,
        }
    }

    /// Where and what a pair is, in words.
    #[must_use]
    pub fn describe(&self, pair: &Intersection) -> String {
        let [a, b] = pair.surfaces.map(|surface| self.name(surface));
        let [i, j] = pair.triangles;
        let [x, y, z] = pair.place;
        format!("triangle {i} of `{a}` and {j} of `{b}` near [{x:.4}, {y:.4}, {z:.4}] m")
    }

    /// Names of the colliders that are no triangles.
    pub fn left_out(&self) -> impl Iterator<Item = &str> {
        let all = self.model.colliders().iter().enumerate();
        all.filter(|(i, _)| !self.bodies.contains(i)).map(|(_, collider)| collider.name.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cloth_scene::{CompileOptions, Scene};

    const SCENE: &str = r#"
        name = "two"
        [[cloth]]
        name = "low"
        geometry.grid = { columns = 5, rows = 5, spacing = 0.1 }
        material.preset = "jersey"
        [[cloth]]
        name = "high"
        geometry.grid = { columns = 4, rows = 4, spacing = 0.1, centre = [0, 0, 0.2] }
        material.preset = "jersey"
        [[collider]]
        name = "floor"
        shape.plane = {}
        translation = [0, 0, -1]
    "#;

    #[test]
    fn cloths_are_surfaces_of_their_own() {
        let scene = Scene::from_toml(SCENE, "two.toml").unwrap();
        let scene = scene.compile(&CompileOptions::default()).unwrap();
        let audit = SceneAudit::new(&scene.model);
        let mut positions = scene.model.positions().to_vec();
        assert!(audit.at(&positions, &[], 0.0).is_clean());
        assert_eq!(audit.left_out().collect::<Vec<_>>(), ["floor"]);
        // A corner of the high one below the low one: its only triangle goes through.
        positions[25][2] = -0.1;
        let found = audit.at(&positions, &[], 0.0);
        assert!(found.between > 0 && found.within == 0 && found.bodies == 0, "{found:?}");
        let text = audit.describe(&found.first.unwrap());
        assert!(text.contains("of `low` and 0 of `high` near"), "{text}");
        assert!(audit.at(&positions[..20], &[], 0.0).unusable > 0);
    }

    #[test]
    fn bodies_that_go_through_themselves_are_found_with_the_time() {
        let folded = |pose: &str, most: usize| {
            let wearer = format!("mannequin = {{ edge = 0.03, pose = [{pose}] }}");
            let text = SCENE.replace("plane = {}", &wearer);
            let scene = Scene::from_toml(&text, "two.toml").unwrap();
            let scene = scene.compile(&CompileOptions::default()).unwrap();
            SceneAudit::new(&scene.model).folded_bodies(most)
        };
        let raised = "{ time = 1, shoulder_left = { raise = 90 } }";
        assert_eq!(folded(raised, usize::MAX), []);
        // Its arm comes down into its hip.
        let bent = "{ time = 1, shoulder_left = { raise = 45 } }, { time = 2, shoulder_left = { raise = 0 } }";
        let all = folded(bent, usize::MAX);
        let [found] = &all[..] else { panic!("{all:?}") };
        assert_eq!((&*found.name, found.time), ("floor", 2.0));
        assert!(found.pairs > 0 && 0 < found.folded && found.folded < found.looked, "{found:?}");
        let few = folded(bent, 20_000);
        let [few] = &few[..] else { panic!("{few:?}") };
        assert!(0 < few.folded && few.looked < found.looked, "{few:?}");
    }

    #[test]
    fn a_box_is_twelve_triangles() {
        let text = SCENE.replace("plane = {}", "box.half_extents = [0.1, 0.2, 0.3]");
        let scene = Scene::from_toml(&text, "two.toml").unwrap();
        let scene = scene.compile(&CompileOptions::default()).unwrap();
        let audit = SceneAudit::new(&scene.model);
        assert_eq!(audit.left_out().count(), 0);
        let positions = scene.model.positions();
        // Above, across each of its six faces, and inside, where no faces are.
        let at =
            |place: [f64; 3]| audit.at(positions, &[Pose::from_translation(place)], 0.0).bodies;
        assert_eq!([at([0.0, 0.0, -0.301]), at([0.0, 0.0, 0.501])], [0, 0]);
        assert!(at([0.0, 0.0, -0.299]) > 0 && at([0.0, 0.0, 0.499]) > 0);
        let sides = [[0.299, 0.0], [-0.299, 0.0], [0.0, 0.399], [0.0, -0.399]];
        for [x, y] in sides {
            assert!(at([x, y, 0.0]) > 0, "{x} {y}");
            assert_eq!(at([1.02 * x, 1.02 * y, 0.0]), 0, "{x} {y}");
        }
    }
}
