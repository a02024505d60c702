//! Contact of cloth with itself: when the candidate list is built, and what happens if it was not
//! built often enough or does not fit.
//!
//! The device decides by itself whether to build the list, and checks at every use that it is complete
//! (`shared/contact_list.wgsl`). The host only learns of it after a frame. If the list was incomplete or
//! too long, the frame is done again from its start, with the list built more often or with more room.
//! As results depend on pairs in contact alone, not on lists, a frame done again is the frame that
//! should have been.

mod frame;
pub(crate) mod policy;

pub(crate) use frame::{Command, OpenFrame};
