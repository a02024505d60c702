//! Contact of cloth with itself and with other cloths (NUMERICS §8).

use crate::{
    ModelError,
    error::{in_range, not_negative, positive},
};

/// Contact of all cloths with themselves and each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfContact {
    /// Distance below which two particles, or two triangles, are in contact \[m\].
    pub distance: f64,
    /// What contact does.
    pub response: ContactResponse,
}

/// What cloth does to cloth that it touches. Impulses and penalties act between points, the particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactResponse {
    /// Approaching pairs exchange momentum along the normal, overlap is pushed apart. Pairs that
    /// are joined by a spring, or start closer than the contact distance, are left out.
    Impulse {
        /// Coefficient of restitution, 0 to 1.
        restitution: f64,
        /// Coulomb friction coefficient between cloths.
        friction: f64,
    },
    /// A spring with a damper between each pair in contact, no pair left out.
    Penalty {
        /// Stiffness \[N/m\].
        stiffness: f64,
        /// Damping along the normal \[N s/m\].
        damping: f64,
    },
    /// Triangles push each other apart, stick to each other, and are proven in every substep not to have gone through each other
    /// (NUMERICS §15). Within a cloth, what is closer than the distance at the start pushes only once it comes closer still.
    Triangles {
        /// Coulomb friction coefficient between cloths.
        friction: f64,
    },
}

impl SelfContact {
    /// Time \[s\] in which the impulse response takes back an overlap. Taken back all at once it
    /// works against the springs, and cloths that lie on each other ring without end.
    pub const RECOVERY_TIME: f64 = 5e-3;

    /// Share of an overlap that is taken back in a substep of `length` \[s\].
    #[must_use]
    pub fn recovery(length: f64) -> f64 {
        (length / Self::RECOVERY_TIME).min(1.0)
    }

    /// Substeps in which an integrator with large steps takes back an overlap, if that is longer than
    /// [`RECOVERY_TIME`](Self::RECOVERY_TIME). Its springs answer once in a substep: pushed apart
    /// faster than they can answer, cloths that lie on each other are stretched more and more.
    pub const RECOVERY_SUBSTEPS: f64 = 4.0;

    /// The length \[s\] that `contact_impulses` is told for a move of `part` \[s\] in a substep of
    /// `substep` \[s\]: it sets how much of an overlap is taken back.
    #[must_use]
    pub fn recovery_length(part: f64, substep: f64) -> f64 {
        part * (Self::RECOVERY_TIME / (Self::RECOVERY_SUBSTEPS * substep)).min(1.0)
    }

    /// Longest time \[s\] that particles move before contact is looked for again, in integrators
    /// with large steps. Cloths that meet at 3 m/s come 6 mm closer in it.
    pub const MOVE_TIME: f64 = 2e-3;

    /// Moves that a substep of `length` \[s\] is divided into.
    #[must_use]
    pub fn moves(length: f64) -> u32 {
        (length / Self::MOVE_TIME).ceil().max(1.0) as u32
    }

    /// Whether pairs joined by a spring or close at the start are left out.
    #[must_use]
    pub const fn excludes_neighbours(&self) -> bool {
        matches!(self.response, ContactResponse::Impulse { .. })
    }

    /// Whether it is between triangles rather than particles.
    #[must_use]
    pub const fn is_of_triangles(&self) -> bool {
        matches!(self.response, ContactResponse::Triangles { .. })
    }

    /// Coulomb friction coefficient between cloths; 0 for a response without friction.
    #[must_use]
    pub const fn friction(&self) -> f64 {
        match self.response {
            ContactResponse::Impulse { friction, .. } | ContactResponse::Triangles { friction } => {
                friction
            }
            ContactResponse::Penalty { .. } => 0.0,
        }
    }

    pub(crate) fn validate(&self) -> Result<(), ModelError> {
        positive(|| "distance of the self-contact".into(), self.distance)?;
        match self.response {
            ContactResponse::Impulse { restitution, friction } => {
                in_range(|| "restitution of the self-contact".into(), restitution, [0.0, 1.0])?;
                not_negative(|| "friction of the self-contact".into(), friction)?;
            }
            ContactResponse::Penalty { stiffness, damping } => {
                positive(|| "stiffness of the self-contact".into(), stiffness)?;
                not_negative(|| "damping of the self-contact".into(), damping)?;
            }
            ContactResponse::Triangles { friction } => {
                not_negative(|| "friction of the self-contact".into(), friction)?;
            }
        }
        Ok(())
    }
}
