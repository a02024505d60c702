//! The state of all bodies as bytes.
//!
//! Layout, little endian: version u32; digest of the world at its start u128, which stands for bodies, joints, colliders and the
//! version of the library; digest of the rest, keyed with the first, u128; then the state of the library (serde, in the
//! format of postcard) and the poses of the colliders.
//!
//! The library trusts the indices in its state. So nothing is read of it before the digest has shown that it is what was put down
//! for this very world.

use cloth_core::Pose;
use rapier3d_f64::prelude::{PhysicsWorld, RigidBodyHandle};
use serde::{Deserialize, Serialize};
use siphasher::sip128::{Hasher128, SipHasher13};
use std::hash::Hasher;

use crate::RigidError;

const VERSION: u32 = 1;
const HEADER_SIZE: usize = 4 + 16 + 16;

/// Translation and rotation of a collider.
type PoseNumbers = ([f64; 3], [f64; 4]);

#[derive(Serialize)]
struct Written<'a> {
    world: &'a PhysicsWorld,
    colliders: Vec<PoseNumbers>,
}

#[derive(Deserialize)]
struct Read {
    world: PhysicsWorld,
    colliders: Vec<PoseNumbers>,
}

const fn error(problem: &'static str) -> RigidError {
    RigidError::Snapshot { problem }
}

fn bytes_of(value: &impl Serialize) -> Result<Vec<u8>, RigidError> {
    postcard::to_stdvec(value).map_err(|_| error("the library cannot put their state down"))
}

/// A digest that stands for a world.
pub(crate) fn digest(world: &PhysicsWorld) -> Result<u128, RigidError> {
    Ok(keyed(&bytes_of(world)?, 0))
}

fn keyed(bytes: &[u8], key: u128) -> u128 {
    let mut hasher = SipHasher13::new_with_key(&key.to_le_bytes());
    hasher.write(bytes);
    hasher.finish128().as_u128()
}

/// The bytes of a world that was `start` at its start.
pub(crate) fn write(
    world: &PhysicsWorld,
    colliders: &[(RigidBodyHandle, Pose)],
    start: u128,
) -> Result<Vec<u8>, RigidError> {
    let numbers = |(_, pose): &(RigidBodyHandle, Pose)| (pose.translation, pose.rotation);
    let colliders = colliders.iter().map(numbers).collect();
    let content = bytes_of(&Written { world, colliders })?;
    let mut bytes = Vec::with_capacity(HEADER_SIZE + content.len());
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(start.to_le_bytes());
    bytes.extend(keyed(&content, start).to_le_bytes());
    bytes.extend(content);
    Ok(bytes)
}

/// The world of these bytes and the poses of its `colliders` colliders.
pub(crate) fn read(
    bytes: &[u8],
    start: u128,
    colliders: usize,
) -> Result<(PhysicsWorld, Vec<Pose>), RigidError> {
    const DAMAGED: RigidError = error("what was put down of them is damaged");
    let (version, rest) = bytes.split_first_chunk().ok_or(DAMAGED)?;
    if u32::from_le_bytes(*version) != VERSION {
        return Err(error("another version of the program put them down"));
    }
    let (found, rest) = rest.split_first_chunk().ok_or(DAMAGED)?;
    let (digest, content) = rest.split_first_chunk().ok_or(DAMAGED)?;
    if u128::from_le_bytes(*found) != start {
        return Err(error(
            "bodies, joints or colliders are not those that were put down, or another version of the program did it",
        ));
    }
    if u128::from_le_bytes(*digest) != keyed(content, start) {
        return Err(DAMAGED);
    }
    let Read { world, colliders: numbers } = postcard::from_bytes(content).map_err(|_| DAMAGED)?;
    if numbers.len() != colliders {
        return Err(DAMAGED);
    }
    let pose = |(translation, rotation)| Pose { translation, rotation };
    Ok((world, numbers.into_iter().map(pose).collect()))
}
