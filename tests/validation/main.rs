//! Whole simulations against answers that are known from mechanics, through the public solver.

#![expect(clippy::unwrap_used, reason = "a rig that fails is a test that fails")]

mod buckling;
mod chain;
mod colliders;
mod control;
mod control_forces;
mod convergence;
mod energy;
mod free_flight;
mod friction;
mod implicit_colliders;
mod implicit_energy;
mod implicit_jacobian;
mod implicit_linear;
mod implicit_matrix;
mod implicit_newton;
mod implicit_oscillator;
mod implicit_rig;
mod implicit_stability;
mod implicit_stack;
mod internal_forces;
mod midpoint;
mod oscillator;
mod rig;
mod rigid_bodies;
mod self_contact;
mod semi_implicit;
mod stability;
mod stable_step;
mod time_step;
mod tunnelling;
