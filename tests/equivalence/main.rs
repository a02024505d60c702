//! Every backend computes what NUMERICS.md says, stage by stage and as a whole.

mod cuda_bits;
mod cuda_sanitized;
mod implicit_stages;
mod invariants;
mod negative_control;
mod reference;
mod reproducibility;
mod stages;
mod trajectory;
