//! Contact of cloth with itself: when the list of groups is built, and what happens if it was not
//! built often enough or rows do not fit.
//!
//! The device decides by itself whether to build the list, and checks at every use that it is complete
//! (`shared/group.wgsl`). The host only learns of it when it asks, after one frame or a few. If the list was incomplete
//! or a row too long, they are done again from their start, with the list built more often or with more room.
//! As results depend on pairs in contact alone, not on lists, a frame done again is the frame that
//! should have been.

mod frame;
pub(crate) mod policy;

pub(crate) use frame::{Command, OpenFrame, OpenFrames, Question};
