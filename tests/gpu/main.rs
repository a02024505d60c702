//! What only a backend on a GPU has: limits of devices, their loss, buffers that others share.

mod buffers;
mod contact;
mod limits;
mod loss;
mod rig;
