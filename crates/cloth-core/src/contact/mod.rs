//! Contact between the triangles of cloth (NUMERICS §15): which pairs can meet, where they touch, what that does, and the proof
//! that none passes another. All is pure functions of positions, which backends call for many pairs at once.

mod bodies;
mod body_impulses;
mod carrier;
mod certificate;
mod certifier;
pub mod device;
mod ghosts;
mod groups;
mod law;
mod particle_contacts;
mod plane;
mod records;
mod set;
mod stencil;
mod surface;
mod truncation;

pub use bodies::{BodyMotion, ContactBody};
pub use body_impulses::BodyImpulses;
pub use carrier::Carrier;
pub use certificate::{
    MARGIN, Split, certify, certify_at_start, certify_with_margin, closest_axis, is_apart,
};
pub use certifier::{CertifiedWays, Certifier, PairSearch, UnprovenPair, Ways};
pub use ghosts::{Ghost, GhostAnchor, GhostGuide};
pub(crate) use law::EXPLICIT_EIGENVALUE;
pub use law::{ContactAction, ContactLaw, EXCHANGE_INTERVAL};
pub use records::{Contact, ContactSlip, Contacts};
pub use set::{ContactEquation, ContactMotion, ContactSet, ContactState};
pub use stencil::{ContactKey, ContactKind, ContactStencil, may_touch};
pub use surface::{Candidate, ContactSurface};
pub use truncation::{SeparatingPlane, certificate_distance, is_proven};

use crate::Real;

#[inline(always)]
fn sub<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a + s b.
#[inline(always)]
fn plus<T: Real>(a: [T; 3], s: T, b: [T; 3]) -> [T; 3] {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

/// What a vector has along the plane of a normal of length 1.
#[inline(always)]
fn along_plane<T: Real>(v: [T; 3], normal: [T; 3]) -> [T; 3] {
    plus(v, -dot(v, normal), normal)
}
