//! What only a backend on a GPU has: limits of devices, their loss, buffers that others share.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

mod buffers;
mod contact;
mod limits;
mod loss;
mod rig;
