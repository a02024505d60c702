//! What a generated case is made of, and how proptest chooses it.

use cloth_core::Stencil;
use proptest::{collection, prelude::*};

use super::surroundings::{COLLIDERS_MAX, FIELDS_SUMMED};

/// A generated case in words.
#[derive(Clone, Debug)]
pub struct Description {
    /// Seed of all random numbers.
    pub seed: u64,
    /// The cloths.
    pub pieces: Vec<Piece>,
    /// Where it all is.
    pub place: Place,
    /// What was done to the rest shape.
    pub deformation: Deformation,
    /// Whether some particles are held.
    pub pins: bool,
    /// Number of fields beside gravity: the first three uniform or drag, all others expressions.
    pub fields: usize,
    /// Whether there is air.
    pub air: bool,
    /// Number of colliders; they move and turn during the frame.
    pub colliders: usize,
    /// Contact of cloth with itself.
    pub contact: Contact,
    /// Whether springs are limited.
    pub strain_limit: bool,
    /// Whether bend springs have a rigidity, with which they buckle.
    pub buckling: bool,
}

/// One cloth.
#[derive(Clone, Copy, Debug)]
pub enum Piece {
    /// A regular patch.
    Grid {
        /// Particles along the first side.
        columns: u32,
        /// Particles along the second side.
        rows: u32,
        /// Its springs.
        stencil: Stencil,
    },
    /// A triangle mesh with jittered vertices and diagonals that run either way.
    Mesh {
        /// Cells along the first side.
        columns: u32,
        /// Cells along the second side.
        rows: u32,
        /// Whether some triangles are missing.
        holes: bool,
    },
    /// Such a mesh of fabric, its rest shape either a pattern or that in which it starts.
    Fabric {
        /// Cells along the first side.
        columns: u32,
        /// Cells along the second side.
        rows: u32,
        /// Whether some triangles are missing.
        holes: bool,
    },
    /// Particles joined at random; some stay without a spring.
    Network {
        /// Number of particles.
        particles: u32,
        /// Number of springs asked for.
        springs: u32,
    },
}

/// Where a case is. Hashing and rounding depend on it.
#[derive(Clone, Copy, Debug)]
pub enum Place {
    /// Around the origin, coordinates of both signs.
    Origin,
    /// A hundred metres away.
    Far,
}

/// What was done to the rest shape.
#[derive(Clone, Copy, Debug)]
pub enum Deformation {
    /// Every particle moved a little.
    Jitter,
    /// All stretched by about half.
    Stretched,
    /// All compressed to about half.
    Compressed,
    /// Folded over, one layer close to the other.
    Folded,
    /// Every particle moved, some pairs almost or exactly to the same place.
    Coinciding,
}

/// Contact of cloth with itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// None.
    Off,
    /// Exchange of momentum.
    Impulse,
    /// Springs between particles in contact.
    Penalty,
}

fn piece() -> impl Strategy<Value = Piece> {
    let stencil = prop_oneof![Just(Stencil::Neighbours12), Just(Stencil::Neighbours24)];
    prop_oneof![
        (2_u32..12, 2_u32..12, stencil).prop_map(|(columns, rows, stencil)| Piece::Grid {
            columns,
            rows,
            stencil
        }),
        (1_u32..9, 1_u32..9, any::<bool>()).prop_map(|(columns, rows, holes)| Piece::Mesh {
            columns,
            rows,
            holes
        }),
        (1_u32..60, 0_u32..150)
            .prop_map(|(particles, springs)| Piece::Network { particles, springs }),
    ]
}

/// All that a case can be.
pub fn description() -> impl Strategy<Value = Description> {
    let place = prop_oneof![3 => Just(Place::Origin), 1 => Just(Place::Far)];
    let deformation = prop_oneof![
        Just(Deformation::Jitter),
        Just(Deformation::Stretched),
        Just(Deformation::Compressed),
        Just(Deformation::Folded),
        Just(Deformation::Coinciding),
    ];
    let contact = prop_oneof![Just(Contact::Off), Just(Contact::Impulse), Just(Contact::Penalty)];
    let matter = (any::<u64>(), collection::vec(piece(), 1..4), place, deformation, any::<bool>());
    let surroundings =
        (0..3_usize, any::<bool>(), 0..5_usize, contact, any::<bool>(), any::<bool>());
    (matter, surroundings).prop_map(
        |(
            (seed, pieces, place, deformation, pins),
            (fields, air, colliders, contact, strain_limit, buckling),
        )| Description {
            seed,
            pieces,
            place,
            deformation,
            pins,
            // A third have expressions, a fifth a distance grid.
            fields: if seed % 3 == 0 { fields + FIELDS_SUMMED } else { fields },
            air,
            colliders: if seed % 5 == 0 { COLLIDERS_MAX } else { colliders },
            contact,
            strain_limit,
            buckling,
        },
    )
}

/// Cases whose cloths are made of fabric, one of them perhaps of springs. No two corners of a triangle are in the same place: there
/// the forces of a fold have no bound.
pub fn description_of_fabric() -> impl Strategy<Value = Description> {
    description().prop_map(|mut description| {
        for piece in description.pieces.iter_mut().rev().skip(description.seed as usize % 2) {
            *piece = match *piece {
                Piece::Grid { columns, rows, .. } => Piece::Fabric { columns, rows, holes: false },
                Piece::Mesh { columns, rows, holes } => Piece::Fabric { columns, rows, holes },
                Piece::Network { particles, .. } => {
                    Piece::Fabric { columns: particles % 5 + 1, rows: 3, holes: true }
                }
                fabric @ Piece::Fabric { .. } => fabric,
            };
        }
        if matches!(description.deformation, Deformation::Coinciding) {
            description.deformation = Deformation::Jitter;
        }
        description
    })
}
