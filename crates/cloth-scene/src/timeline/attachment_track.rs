//! Where a collider carries the particles that are attached to it.

use cloth_core::{Anchor, AnchorSpring, ColliderShape, ForceControl, PinAction, PinControl, Pose};
use glam::{DMat3, DQuat, DVec3};

use super::{ColliderTrack, FrameSpan};

/// Particles that one collider holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AttachmentTrack {
    /// Index into the colliders of the model.
    pub(crate) collider: u32,
    /// Its pose at the start.
    pub(crate) pose: Pose,
    /// Its shape.
    pub(crate) shape: ColliderShape,
    /// The particles.
    pub(crate) holds: Vec<Held>,
    /// Stiffness \[N/m\] and damping \[N s/m\] of each, or none if they are held by force.
    pub(crate) spring: Option<[f64; 2]>,
    /// When they are let go \[s\].
    pub(crate) release: Option<f64>,
}

/// A particle that is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Held {
    /// Its number in the composite model.
    pub(crate) particle: u32,
    /// Where it is held.
    pub(crate) hold: Hold,
    /// By which its spring is multiplied.
    pub(crate) weight: f64,
}

/// A place that a collider carries along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Hold {
    /// In its local frame \[m\].
    Local([f64; 3]),
    /// In the frame of a triangle of its surface.
    Face {
        /// Vertices of the triangle.
        corners: [u32; 3],
        /// Weights of the corners of the closest point.
        weights: [f64; 3],
        /// From there to the place, along the first edge, across it, and along the normal \[m\].
        offset: [f64; 3],
    },
}

impl Hold {
    /// A place \[m\] of the local frame, as seen from a point of a triangle of a surface with these vertices.
    pub(crate) fn on_face(
        positions: &[[f64; 3]],
        corners: [u32; 3],
        weights: [f64; 3],
        place: [f64; 3],
    ) -> Self {
        let (point, frame) = face(positions, corners, weights);
        let offset = frame.transpose() * (DVec3::from(place) - point);
        Self::Face { corners, weights, offset: offset.into() }
    }

    fn place(&self, positions: &[[f64; 3]]) -> DVec3 {
        match *self {
            Self::Local(place) => place.into(),
            Self::Face { corners, weights, offset } => {
                let (point, frame) = face(positions, corners, weights);
                point + frame * DVec3::from(offset)
            }
        }
    }
}

/// A point of a triangle, and the axes along its first edge, across it, and along the normal.
fn face(positions: &[[f64; 3]], corners: [u32; 3], weights: [f64; 3]) -> (DVec3, DMat3) {
    let at = |corner: u32| positions.get(corner as usize).copied().map_or(DVec3::ZERO, DVec3::from);
    let [a, b, c] = corners.map(at);
    let along = (b - a).normalize_or(DVec3::X);
    let normal = (b - a).cross(c - a).normalize_or(along.any_orthonormal_vector());
    let point = weights[0] * a + weights[1] * b + weights[2] * c;
    (point, DMat3::from_cols(along, normal.cross(along), normal))
}

impl AttachmentTrack {
    /// Whether it is over when a frame begins.
    fn is_over(&self, span: &FrameSpan) -> bool {
        self.release.is_some_and(|release| span.is_after(release))
    }

    /// Where all particles are held at `time` \[s\].
    fn places(
        &self,
        tracks: &[ColliderTrack],
        time: f64,
    ) -> impl Iterator<Item = (&Held, [f64; 3])> {
        let track = tracks.iter().find(|track| track.collider == self.collider);
        let pose = track.map_or(self.pose, |track| track.pose(time));
        let rotation = DQuat::from_array(pose.rotation);
        let is_of_faces = self.holds.iter().any(|held| matches!(held.hold, Hold::Face { .. }));
        let positions = match is_of_faces {
            true => self.shape.body_positions(self.shape.sets_at(time)).into_owned(),
            false => Vec::new(),
        };
        self.holds.iter().map(move |held| {
            let place = rotation * held.hold.place(&positions) + DVec3::from(pose.translation);
            (held, place.into())
        })
    }

    /// What becomes of particles that are held by force in a frame.
    pub(crate) fn pins(
        &self,
        tracks: &[ColliderTrack],
        span: &FrameSpan,
    ) -> impl Iterator<Item = PinControl> {
        let track = tracks.iter().find(|track| track.collider == self.collider);
        let moves = self.shape.changes() || track.is_some_and(|track| track.moves_in(span));
        let is_held = self.spring.is_none() && !self.is_over(span) && moves;
        let ends = self.spring.is_none() && self.release.is_some_and(|at| span.begins_at(at));
        let places = is_held.then(|| self.places(tracks, span.end));
        let moved = places
            .into_iter()
            .flatten()
            .map(|(held, place)| (held.particle, PinAction::MoveTo(place)))
            .map(|(particle, action)| PinControl { particle, action });
        let released = ends.then_some(&self.holds).into_iter().flatten();
        let released =
            released.map(|held| PinControl { particle: held.particle, action: PinAction::Release });
        moved.chain(released)
    }

    /// The springs on particles that are held by them in a frame.
    pub(crate) fn forces(
        &self,
        tracks: &[ColliderTrack],
        span: &FrameSpan,
    ) -> impl Iterator<Item = ForceControl> {
        let spring = self.spring.filter(|_| !self.is_over(span));
        spring.into_iter().flat_map(move |[stiffness, damping]| {
            let middle = 0.5 * (span.start + span.end);
            self.places(tracks, middle).map(move |(held, place)| ForceControl {
                particle: held.particle,
                force: [0.0; 3],
                spring: Some(AnchorSpring {
                    anchor: Anchor::At(place),
                    stiffness: held.weight * stiffness,
                    damping: held.weight * damping,
                    reach: f64::INFINITY,
                }),
            })
        })
    }
}
