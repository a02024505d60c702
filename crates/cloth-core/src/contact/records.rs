//! Contacts as whoever looks at a simulation sees them.

use super::ContactKey;

/// What friction remembers of a contact from one substep to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSlip {
    /// Its name.
    pub key: ContactKey,
    /// How far its points have slipped along each other while they stick \[m\].
    pub slip: [f64; 3],
}

/// Two features of cloth that push each other apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Its name, the same as long as the same features touch.
    pub key: ContactKey,
    /// Particles of both features.
    pub particles: [u32; 4],
    /// Weights of the particles: sum w_a x_a goes from the second point to the first. Those of the first feature are positive and
    /// 1 together, those of the second negative.
    pub weights: [f64; 4],
    /// Distance of both points \[m\].
    pub gap: f64,
    /// Distance at which the force begins \[m\].
    pub reach: f64,
    /// Unit vector from the second point to the first.
    pub normal: [f64; 3],
    /// Force along the normal that pushes both apart \[N\], not negative.
    pub force: f64,
    /// Force of friction on the first point \[N\].
    pub friction: [f64; 3],
    /// How far the first point is displaced along the plane of contact from where it sticks to the second \[m\].
    pub slip: [f64; 3],
    /// Whether both stick to each other.
    pub sticks: bool,
}

/// All contacts between the triangles of cloths, as last computed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    /// Each of them, ascending by key.
    pub contacts: Vec<Contact>,
}
