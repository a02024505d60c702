//! Runs the program as its users do.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

mod audit;
mod backend;
mod bad_input;
mod commands;
mod fysl;
mod honesty;
mod place;
mod rope;
mod run;
mod solvers;
