//! What couples the particles of a model: one list for all that follows from it.
//!
//! A new energy adds a kind here. Which blocks of a kernel wait for which others, which particles hang together, the pattern of
//! the matrix, how far a particle reaches, what can be changed at the same time: all of that is derived from the list, and so
//! holds for the new kind as soon as it is in it.

mod blocks;
mod colouring;
mod incidence;
mod neighbours;
mod pieces;
mod regions;
mod sliced;

pub use blocks::BlockDependencies;
pub use colouring::{Colouring, SpringColouring};
pub use incidence::Incidence;
pub use neighbours::Neighbours;
pub use regions::{ColourRegion, ColourRegions};
pub use sliced::SlicedRows;

use super::{FabricFold, FabricTriangle, Model, Springs};
use crate::fabric::bending::PATCH;

/// A way in which particles act on each other. Each kind couples a fixed number of particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum InteractionKind {
    /// A spring with a damper between two particles (NUMERICS §2).
    Spring,
    /// A triangle of fabric that stretches and shears (NUMERICS §11).
    Membrane,
    /// The folds that tell the curvature of a triangle of fabric: the vertices of its patch (NUMERICS §12).
    Bending,
    /// A fold alone, which is what bending adds to the matrix: an edge and the third corners of its triangles (NUMERICS §12).
    Fold,
    /// The air on the three particles of a triangle (NUMERICS §3).
    AirTriangle,
}

impl InteractionKind {
    /// All kinds.
    pub const ALL: [Self; 5] =
        [Self::Spring, Self::Membrane, Self::Bending, Self::Fold, Self::AirTriangle];

    /// Number of particles that an interaction of the kind couples.
    #[must_use]
    pub const fn arity(self) -> usize {
        match self {
            Self::Spring => 2,
            Self::Membrane | Self::AirTriangle => 3,
            Self::Fold => 4,
            Self::Bending => PATCH,
        }
    }

    /// Its name in words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Spring => "spring",
            Self::Membrane => "membrane of fabric",
            Self::Bending => "bending of fabric",
            Self::Fold => "fold of fabric",
            Self::AirTriangle => "air on a triangle",
        }
    }

    /// Whether it has blocks off the diagonal of the matrix of an implicit step. Air has not: its derivative by the velocity of
    /// the particle itself is all that is taken. Nor has bending: its folds have.
    #[must_use]
    pub const fn is_in_matrix(self) -> bool {
        match self {
            Self::Spring | Self::Membrane | Self::Fold => true,
            Self::Bending | Self::AirTriangle => false,
        }
    }
}

/// All interactions of one kind.
#[derive(Clone, Copy, Debug)]
pub struct InteractionList<'a> {
    kind: InteractionKind,
    particles: Particles<'a>,
}

/// Where the particles of a list are kept.
#[derive(Clone, Copy, Debug)]
enum Particles<'a> {
    Springs(&'a Springs),
    Triangles(&'a [[u32; 3]]),
    Fabric(&'a [FabricTriangle]),
    Patches(&'a [[u32; PATCH]]),
    Folds(&'a [FabricFold]),
}

impl<'a> InteractionList<'a> {
    /// The kind.
    #[must_use]
    pub const fn kind(&self) -> InteractionKind {
        self.kind
    }

    /// Number of interactions.
    #[must_use]
    pub fn len(&self) -> usize {
        match self.particles {
            Particles::Springs(springs) => springs.len(),
            Particles::Triangles(triangles) => triangles.len(),
            Particles::Fabric(triangles) => triangles.len(),
            Particles::Patches(patches) => patches.len(),
            Particles::Folds(folds) => folds.len(),
        }
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The particles of each interaction in order, as many as the kind couples.
    pub fn for_each(&self, mut visit: impl FnMut(&[u32])) {
        match self.particles {
            Particles::Springs(springs) => {
                springs.iter().for_each(|spring| visit(&spring.particles));
            }
            Particles::Triangles(triangles) => {
                triangles.iter().for_each(|triangle| visit(triangle));
            }
            Particles::Fabric(triangles) => {
                triangles.iter().for_each(|triangle| visit(&triangle.particles));
            }
            Particles::Patches(patches) => patches.iter().for_each(|patch| visit(patch)),
            Particles::Folds(folds) => folds.iter().for_each(|fold| visit(&fold.particles)),
        }
    }
}

/// The interactions of a model, a list for each kind that it has.
#[derive(Clone, Debug)]
pub struct Interactions<'a> {
    particle_count: usize,
    lists: Vec<InteractionList<'a>>,
}

impl<'a> Interactions<'a> {
    /// Number of particles of the model.
    #[must_use]
    pub const fn particle_count(&self) -> usize {
        self.particle_count
    }

    /// The lists, in the order of [`InteractionKind::ALL`], those that are empty left out.
    #[must_use]
    pub fn lists(&self) -> &[InteractionList<'a>] {
        &self.lists
    }

    /// The list of a kind, if it is not empty.
    #[must_use]
    pub fn list(&self, kind: InteractionKind) -> Option<&InteractionList<'a>> {
        self.lists.iter().find(|list| list.kind == kind)
    }

    /// Keeps the lists of some kinds.
    pub fn retain(&mut self, keep: impl Fn(InteractionKind) -> bool) {
        self.lists.retain(|list| keep(list.kind));
    }

    /// Those of fabric alone that have blocks off the diagonal of the matrix of an implicit step.
    #[must_use]
    pub fn of_fabric(mut self) -> Self {
        let is_kept = |kind| matches!(kind, InteractionKind::Membrane | InteractionKind::Fold);
        self.lists.retain(|list| is_kept(list.kind));
        self
    }

    /// Those alone that have blocks off the diagonal of the matrix of an implicit step.
    #[must_use]
    pub fn in_matrix(mut self) -> Self {
        self.lists.retain(|list| list.kind.is_in_matrix());
        self
    }

    /// The particles of each interaction of each kind in order.
    pub fn for_each(&self, mut visit: impl FnMut(&[u32])) {
        self.lists.iter().for_each(|list| list.for_each(&mut visit));
    }

    /// Each pair of particles that an interaction couples, the smaller one first; as often as there are such interactions.
    pub fn for_each_pair(&self, mut visit: impl FnMut(u32, u32)) {
        self.for_each(|particles| {
            for (place, &a) in particles.iter().enumerate() {
                // On a border a particle stands in two places.
                let others = particles[..place].iter().filter(|&&b| b != a);
                others.for_each(|&b| visit(a.min(b), a.max(b)));
            }
        });
    }

    /// Largest distance of the numbers of two particles that an interaction couples.
    #[must_use]
    pub fn reach(&self) -> u32 {
        let mut reach = 0;
        self.for_each_pair(|a, b| reach = reach.max(b - a));
        reach
    }
}

impl Model {
    /// All that couples its particles.
    #[must_use]
    pub fn interactions(&self) -> Interactions<'_> {
        let particles = |kind| match kind {
            InteractionKind::Spring => Particles::Springs(&self.springs),
            InteractionKind::Membrane => Particles::Fabric(self.elements.triangles()),
            InteractionKind::Bending => Particles::Patches(self.elements.patches()),
            InteractionKind::Fold => Particles::Folds(self.elements.folds()),
            InteractionKind::AirTriangle if self.air.is_none() => Particles::Triangles(&[]),
            InteractionKind::AirTriangle => Particles::Triangles(&self.triangles),
        };
        let list = |kind| InteractionList { kind, particles: particles(kind) };
        let lists = InteractionKind::ALL.into_iter().map(list);
        Interactions {
            particle_count: self.particle_count(),
            lists: lists.filter(|list| !list.is_empty()).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        Air, BlockDependencies, Cloth, Geometry, GridPatch, InteractionKind, MaterialPreset, Model,
        ModelBuilder, Neighbours,
    };

    fn patch(side: u32, air: Option<Air>) -> Model {
        let geometry = Geometry::Grid(GridPatch::horizontal(side, 0.02, 0.0));
        let material = MaterialPreset::ALL[0].material(0.02);
        let name = "cloth".to_owned();
        let cloth =
            Cloth { name, geometry, material: material.into(), pins: vec![], velocity: [0.0; 3] };
        let builder = ModelBuilder::new().cloth(cloth);
        let builder = match air {
            Some(air) => builder.air(air),
            None => builder,
        };
        builder.build().unwrap()
    }

    #[test]
    fn rows_of_a_patch_wait_for_the_rows_beside_them() {
        let model = patch(10, None);
        let found = BlockDependencies::new(&model.interactions(), 5, |particle| particle / 20);
        assert_eq!(found.rows, [0, 1, 3, 5, 7, 8]);
        assert_eq!(found.blocks, [1, 0, 2, 1, 3, 2, 4, 3]);
    }

    #[test]
    fn air_couples_the_corners_of_triangles_but_not_in_the_matrix() {
        let model =
            patch(4, Some(Air { density: 1.204, wind_velocity: [1.0, 0.0, 0.0], gust: None }));
        let interactions = model.interactions();
        assert_eq!(interactions.lists().len(), 2);
        let air = interactions.list(InteractionKind::AirTriangle).unwrap();
        assert_eq!(air.len(), model.triangles().len());
        air.for_each(|particles| assert_eq!(particles.len(), InteractionKind::AirTriangle.arity()));
        let matrix = interactions.in_matrix();
        assert!(matrix.list(InteractionKind::AirTriangle).is_none());
        assert_eq!(patch(4, None).interactions().lists().len(), 1);
    }

    #[test]
    fn neighbours_are_what_springs_join() {
        let model = patch(6, None);
        let neighbours = Neighbours::new(&model.interactions());
        let springs = model.springs();
        assert_eq!(neighbours.pairs().count(), springs.len());
        for a in 0..36 {
            for b in (0..36).filter(|&b| b != a) {
                assert_eq!(neighbours.joins(a, b), springs.joins(a, b));
            }
        }
        assert_eq!(model.interactions().reach(), 12, "two rows up");
    }
}
