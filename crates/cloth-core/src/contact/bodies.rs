//! Bodies in contact of triangles: colliders whose vertices go where they are told (NUMERICS §15).

use std::{
    collections::{HashMap, hash_map::Entry},
    ops::Range,
};

use crate::{
    ColliderShape, Error, GridSets, Model, Pose, Real, State,
    stepper::{ColliderState, FramePlan},
};

use super::{Carrier, dot, sub};

/// A body may go so far in a substep, whatever its size \[m\].
const JUMP_MIN: f64 = 0.1;

fn length<T: Real>(v: [T; 3]) -> f64 {
    dot(v, v).sqrt().to_f64()
}

/// Nodes of a plane.
const PLANE_NODES: u32 = 3;

/// A collider that is triangles of infinite mass, or a plane.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactBody {
    /// Its number among the colliders of the model.
    pub collider: u32,
    /// Its nodes: the numbers that its vertices have among those of particles, which come first.
    pub nodes: Range<u32>,
    /// Coulomb friction coefficient between it and cloth.
    pub friction: f64,
    /// The vertex of the shape that each node is. Vertices that are always in one place are one node.
    vertices: Vec<u32>,
    /// The first node of a plane, along its sides \[m\].
    plane_origin: Option<[f64; 2]>,
    /// By nodes; what has no area as two corners are one node is left out.
    triangles: Vec<[u32; 3]>,
}

impl ContactBody {
    /// The bodies of a model.
    pub(super) fn all(model: &Model) -> Vec<Self> {
        let mut first = model.particle_count() as u32;
        let mut bodies = Vec::new();
        for (number, collider) in model.colliders().iter().enumerate() {
            if model.is_contact_plane(number) {
                let nodes = first..first + PLANE_NODES;
                first = nodes.end;
                bodies.push(Self {
                    collider: number as u32,
                    nodes,
                    friction: collider.friction,
                    plane_origin: Some(plane_origin(&collider.pose)),
                    vertices: Vec::new(),
                    triangles: Vec::new(),
                });
            } else if model.is_contact_body(number) {
                let body = Self::new(number as u32, &collider.shape, (first, collider.friction));
                first = body.nodes.end;
                bodies.push(body);
            }
        }
        bodies
    }

    fn new(collider: u32, shape: &ColliderShape, (first, friction): (u32, f64)) -> Self {
        let source = shape.body_triangles().unwrap_or_default();
        let class = places(shape);
        let count = class.len();
        // Only what a triangle has is a node.
        let mut node_of_class = vec![None; count];
        let mut vertices = Vec::new();
        let mut triangles = Vec::with_capacity(source.len());
        for corners in source.iter() {
            let classes = corners.map(|corner| class[corner as usize]);
            if classes[0] == classes[1] || classes[1] == classes[2] || classes[2] == classes[0] {
                continue;
            }
            let mut triangle = [0; 3];
            for k in 0..3 {
                let node = node_of_class[classes[k] as usize].get_or_insert_with(|| {
                    vertices.push(corners[k]);
                    first + vertices.len() as u32 - 1
                });
                triangle[k] = *node;
            }
            triangles.push(triangle);
        }
        let nodes = first..first + vertices.len() as u32;
        Self { collider, nodes, friction, plane_origin: None, vertices, triangles }
    }

    /// Its triangles, by nodes.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The nodes of a plane: a point of it, and two that are 1 m from there in directions at right angles; its normal is the one that these two
    /// turn about. Nothing for what has triangles.
    #[must_use]
    pub fn plane(&self) -> Option<[u32; 3]> {
        let first = self.nodes.start;
        self.plane_origin.map(|_| [first, first + 1, first + 2])
    }

    /// Appends the positions of its nodes \[m\], where its collider is so.
    fn positions<T: Real>(
        &self,
        shape: &ColliderShape,
        place: &BodyPlace,
        mut put: impl FnMut([T; 3]),
    ) {
        let mut put_local = |x: [f64; 3]| {
            put(std::array::from_fn(|k| {
                let [a, b, c] = place.rotation[k];
                T::from_f64(place.translation[k] + ((a * x[0] + b * x[1]) + c * x[2]))
            }));
        };
        if let Some([u, v]) = self.plane_origin {
            return [[u, v, 0.0], [u + 1.0, v, 0.0], [u, v + 1.0, 0.0]]
                .into_iter()
                .for_each(put_local);
        }
        let local = shape.body_positions(place.sets);
        self.vertices.iter().for_each(|&vertex| put_local(local[vertex as usize]));
    }
}

/// The place of a plane that is nearest to the origin of all, along its sides \[m\]: the farther nodes are from there the more of what they say is rounded.
fn plane_origin(pose: &Pose) -> [f64; 2] {
    let (rows, x) = (pose.rotation_rows(), pose.translation);
    [0, 1].map(|side| -(0..3).map(|k| rows[k][side] * x[k]).sum::<f64>())
}

/// For each vertex of a shape the first one that is in one place with it in all sets of positions.
fn places(shape: &ColliderShape) -> Vec<u32> {
    let mut class = vec![0; shape.body_positions(GridSets::default()).len()];
    // Those that are in one place with others in all sets before.
    let mut shared: Vec<u32> = (0..class.len() as u32).collect();
    for set in 0..shape_sets(shape) {
        if shared.is_empty() {
            break;
        }
        let positions = shape.body_positions(GridSets { index: set, next: set, share: 0.0 });
        let mut first = HashMap::with_capacity(shared.len());
        let mut is_shared = vec![false; class.len()];
        for &vertex in &shared {
            let own = &mut class[vertex as usize];
            // -0 and 0 are one place.
            let place = positions[vertex as usize].map(|component| (component + 0.0).to_bits());
            match first.entry((*own, place)) {
                Entry::Occupied(entry) => {
                    *own = *entry.get();
                    is_shared[*own as usize] = true;
                }
                Entry::Vacant(entry) => *own = *entry.insert(vertex),
            }
        }
        shared.retain(|&vertex| is_shared[class[vertex as usize] as usize]);
    }
    class
}

/// Sets of positions that a shape has.
fn shape_sets(shape: &ColliderShape) -> u32 {
    match shape {
        ColliderShape::Grid(grid) => grid.set_count().max(1) as u32,
        ColliderShape::Surface(surface) => surface.sets.len() as u32,
        _ => 1,
    }
}

/// Where a body is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct BodyPlace {
    translation: [f64; 3],
    rotation: [[f64; 3]; 3],
    sets: GridSets,
}

impl BodyPlace {
    fn of_pose(pose: &Pose, sets: GridSets) -> Self {
        Self { translation: pose.translation, rotation: pose.rotation_rows(), sets }
    }

    const fn of_state(state: &ColliderState) -> Self {
        Self { translation: state.translation, rotation: state.rotation, sets: state.sets }
    }
}

/// Where the nodes of all bodies are at the start and at the end of a substep.
#[derive(Clone, Debug)]
pub struct BodyMotion<T> {
    bodies: Vec<ContactBody>,
    /// Places of the bodies at the end and at the start.
    places: Vec<BodyPlace>,
    places_start: Vec<BodyPlace>,
    places_kept: Vec<BodyPlace>,
    /// Those of all substeps of the frame, set by set; one set if nothing moves.
    planned: Vec<BodyPlace>,
    /// Whether bodies go too far in the substep to take anything along.
    jumps: Vec<bool>,
    /// Whether they go like what is rigid, and turn by less than a radian.
    rigid: Vec<bool>,
    /// Whether a start or an end has changed since the two were last compared.
    has_changed: bool,
    /// Of all nodes, behind the particles \[m\].
    start: Vec<[T; 3]>,
    end: Vec<[T; 3]>,
    kept: Vec<[T; 3]>,
    /// The first node.
    first: u32,
}

impl<T: Real> BodyMotion<T> {
    /// The bodies of a model in its initial state.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        Self::of_bodies(ContactBody::all(model), model)
    }

    /// The same, of bodies that are known.
    #[must_use]
    pub fn of_bodies(bodies: Vec<ContactBody>, model: &Model) -> Self {
        let mut motion = Self {
            bodies,
            places: Vec::new(),
            places_start: Vec::new(),
            places_kept: Vec::new(),
            planned: Vec::new(),
            jumps: Vec::new(),
            rigid: Vec::new(),
            has_changed: true,
            start: Vec::new(),
            end: Vec::new(),
            kept: Vec::new(),
            first: model.particle_count() as u32,
        };
        motion.state_write(model, &model.initial_state());
        motion
    }

    /// Whether there are any.
    #[inline(always)]
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// A state has been given from outside: bodies are there at the start of the next substep.
    pub fn state_write(&mut self, model: &Model, state: &State) {
        let place = |body: &ContactBody| {
            let number = body.collider as usize;
            let collider = &model.colliders()[number];
            let pose = state.colliders.get(number).unwrap_or(&collider.pose);
            BodyPlace::of_pose(pose, collider.shape.sets_at(state.time))
        };
        self.places = self.bodies.iter().map(place).collect();
        self.end.clear();
        for (body, place) in self.bodies.iter().zip(&self.places) {
            let shape = &model.colliders()[body.collider as usize].shape;
            body.positions(shape, place, |x| self.end.push(x));
        }
        self.substep_end();
        self.keep();
        self.planned.clear();
        self.has_changed = true;
        self.compare();
    }

    /// A frame begins, or what is left of one.
    pub fn frame_begin(&mut self, plan: &FramePlan) {
        self.planned.clear();
        if self.is_empty() {
            return;
        }
        for states in plan.colliders.chunks(plan.collider_count.max(1)) {
            let of = |body: &ContactBody| states.get(body.collider as usize);
            self.planned.extend(self.bodies.iter().filter_map(of).map(BodyPlace::of_state));
        }
    }

    /// Puts bodies where they are at the end of a substep of the frame. Returns whether nodes start or end elsewhere than when this was last called.
    pub fn substep_begin(&mut self, model: &Model, index: usize) -> bool {
        let count = self.bodies.len();
        let sets = self.planned.len() / count.max(1);
        if sets == 0 {
            return std::mem::take(&mut self.has_changed);
        }
        let planned = &self.planned[index.min(sets - 1) * count..];
        for ((body, place), now) in self.bodies.iter().zip(&mut self.places).zip(planned) {
            if now == place {
                continue;
            }
            *place = *now;
            self.has_changed = true;
            let first = (body.nodes.start - self.first) as usize;
            let mut slots = self.end[first..first + body.nodes.len()].iter_mut();
            let shape = &model.colliders()[body.collider as usize].shape;
            body.positions(shape, place, |x| {
                if let Some(slot) = slots.next() {
                    *slot = x;
                }
            });
        }
        if self.has_changed {
            self.compare();
        }
        std::mem::take(&mut self.has_changed)
    }

    /// Works out what follows from where bodies start and end.
    fn compare(&mut self) {
        let all = 0..self.bodies.len();
        let jumps =
            |body: usize| self.places_start[body] != self.places[body] && self.is_jump(body);
        self.jumps = all.clone().map(jumps).collect();
        let rigid = |body: usize| {
            let (from, to) = (&self.places_start[body], &self.places[body]);
            // The trace of R' R is 1 + 2 cos of the angle.
            let trace: f64 = (from.rotation.iter().flatten())
                .zip(to.rotation.iter().flatten())
                .map(|(a, b)| a * b)
                .sum();
            from.sets == to.sets && trace > 1.0 + 2.0 * 1.0_f64.cos()
        };
        self.rigid = all.map(rigid).collect();
    }

    /// The substep stands: the next one starts where it has ended.
    pub fn substep_end(&mut self) {
        self.has_changed |= self.moves() || self.places_start != self.places;
        self.start.clone_from(&self.end);
        self.places_start.clone_from(&self.places);
    }

    /// Keeps where bodies are, for a substep that may be taken back.
    pub fn keep(&mut self) {
        self.kept.clone_from(&self.start);
        self.places_kept.clone_from(&self.places_start);
    }

    /// Takes it back. Where they are at the end follows from the next substep.
    pub fn restore(&mut self) {
        self.has_changed = true;
        self.start.clone_from(&self.kept);
        self.places_start.clone_from(&self.places_kept);
    }

    /// Positions of all nodes at the start of the substep \[m\], ascending.
    #[must_use]
    pub fn start(&self) -> &[[T; 3]] {
        &self.start
    }

    /// Those at its end.
    #[must_use]
    pub fn end(&self) -> &[[T; 3]] {
        &self.end
    }

    /// Where they are when a certificate begins: at the start, or at the end for one that goes on from an iterate.
    #[must_use]
    pub fn way_start(&self, goes_on: bool) -> &[[T; 3]] {
        if goes_on { &self.end } else { &self.start }
    }

    /// Whether any node moves in the substep.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.start != self.end
    }

    /// Velocity of a node in a substep of `length` \[s\].
    #[inline(always)]
    #[must_use]
    pub fn velocity(&self, node: u32, length: T) -> [T; 3] {
        let at = (node - self.first) as usize;
        sub(self.end[at], self.start[at]).map(|component| component / length)
    }

    /// The collider that a node belongs to.
    #[must_use]
    pub fn collider_of(&self, node: u32) -> Option<usize> {
        Some(self.bodies[self.body_of(node)?].collider as usize)
    }

    /// Where cloth is pinched, and by whom: says what a certificate that has found no way means for the bodies.
    #[must_use]
    pub fn error_name(&self, model: &Model, error: Error) -> Error {
        let Error::Pinched { particles, place, .. } = &error else { return error };
        let place = *place;
        let of_body = |node: &u32| self.body_of(*node).filter(|&body| self.way(body) > 0.0);
        let bodies = || particles.iter().filter_map(|node| self.body_of(*node));
        let Some(body) = particles.iter().find_map(of_body).or_else(|| bodies().next()) else {
            return error;
        };
        let collider = model.colliders()[self.bodies[body].collider as usize].name.clone();
        if self.is_jump(body) {
            return Error::BodyJumps { collider, way: self.way(body), place };
        }
        match error {
            Error::Pinched { all, .. } => Error::PinchedByBody { collider, place, all },
            error => error,
        }
    }

    /// The longest way of the nodes of a body in the substep \[m\].
    fn way(&self, body: usize) -> f64 {
        let ways = self.range(body).map(|at| sub(self.end[at], self.start[at]));
        ways.fold(0.0, |most, way| most.max(length(way)))
    }

    /// Whether a body goes further than it is long, and than what is no way for anything.
    fn is_jump(&self, body: usize) -> bool {
        let way = self.way(body);
        if way <= JUMP_MIN {
            return false;
        }
        let bound = |pick: fn(f64, f64) -> f64, from: f64| {
            self.range(body).fold([from; 3], |bound, at| {
                std::array::from_fn(|axis| pick(bound[axis], self.start[at][axis].to_f64()))
            })
        };
        let [low, high] = [bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY)];
        way > length::<f64>(sub(high, low))
    }

    fn range(&self, body: usize) -> Range<usize> {
        let Range { start, end } = self.bodies[body].nodes;
        (start - self.first) as usize..(end - self.first) as usize
    }

    fn body_of(&self, node: u32) -> Option<usize> {
        let number = self.bodies.partition_point(|body| body.nodes.end <= node);
        let body = self.bodies.get(number)?;
        body.nodes.contains(&node).then_some(number)
    }
}

impl<T: Real> Carrier<T> for BodyMotion<T> {
    fn jumps(&self, node: u32) -> bool {
        self.body_of(node).is_some_and(|body| self.jumps.get(body) == Some(&true))
    }

    fn faces(&self) -> Vec<[u32; 3]> {
        let all = self.bodies.iter().flat_map(|body| body.triangles());
        all.map(|face| face.map(|node| node - self.first)).collect()
    }

    fn body(&self, node: u32) -> Option<u32> {
        let body = self.body_of(node)?;
        self.rigid[body].then_some(body as u32)
    }

    fn way(&self, body: u32, place: [T; 3]) -> [T; 3] {
        let (from, to) = (&self.places_start[body as usize], &self.places[body as usize]);
        let arm: [f64; 3] = std::array::from_fn(|k| place[k].to_f64() - from.translation[k]);
        let local: [f64; 3] =
            std::array::from_fn(|k| (0..3).map(|row| from.rotation[row][k] * arm[row]).sum());
        std::array::from_fn(|k| {
            let turned: f64 = (0..3).map(|j| to.rotation[k][j] * local[j]).sum();
            T::from_f64((to.translation[k] - from.translation[k]) + (turned - arm[k]))
        })
    }
}
