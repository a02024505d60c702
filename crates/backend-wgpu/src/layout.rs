//! The structs that host and device share, field by field as in WGSL.
//!
//! A test holds the offset of every field and the size of every struct against the layout that naga
//! computes for the WGSL struct of the same name.

use bytemuck::{Pod, Zeroable};

macro_rules! shared_struct {
    ($(#[$meta:meta])* $name:ident { $($(#[$field_meta:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
        pub(crate) struct $name { $($(#[$field_meta])* pub(crate) $field: $type,)* }

        #[cfg(test)]
        impl $name {
            /// Name and offset \[byte\] of every field.
            const FIELDS: &[(&'static str, usize)] =
                &[$((stringify!($field), std::mem::offset_of!($name, $field)),)*];
        }
    };
}

shared_struct! {
    /// `shared/model.wgsl`.
    Model {
        acceleration: [f32; 3],
        particle_count: u32,
        drag_rate: [f32; 3],
        offset: f32,
        contact_distance: f32,
        contact_stiffness: f32,
        contact_damping: f32,
        contact_restitution: f32,
        contact_friction: f32,
        colliders_in_pass: u32,
        measure_blocks: u32,
        solve_blocks: u32,
        solve_repeats: u32,
        zero: u32,
        element_count: u32,
        fold_count: u32,
    }
}

shared_struct! {
    /// `shared/substep.wgsl`.
    Substep {
        wind: [f32; 3],
        length: f32,
        serial: u32,
        collider_first: u32,
        collider_count: u32,
        contact_recovery: f32,
        time: f32,
        flags: u32,
        contact_tick: u32,
        clock: f32,
        anchor_offset: [f32; 3],
        padding: f32,
    }
}

/// The last substep of a frame: contacts are counted.
pub(crate) const FLAG_COUNT_CONTACTS: u32 = 1;

shared_struct! {
    /// `shared/status.wgsl`.
    Status {
        stopped: u32,
        invalid: u32,
        contact_stale: u32,
        contact_built: u32,
        contact_rebuilds: u32,
        contact_table: u32,
        contact_large: u32,
        contact_listed: u32,
        contact_group_needed: u32,
        contact_needed: u32,
        contact_spilled: [u32; 2],
        broken: u32,
    }
}

/// No substep has left a number that is not finite.
pub(crate) const STOPPED_NEVER: u32 = u32::MAX;
/// A list of groups was used too long.
pub(crate) const INVALID_LIST: u32 = 1;
/// Rows of groups or of particles did not fit.
pub(crate) const INVALID_OVERFLOW: u32 = 2;
/// A linear solver needs more iterations than were recorded.
pub(crate) const INVALID_ITERATIONS: u32 = 4;
/// A substep needs more solves than were recorded.
pub(crate) const INVALID_PASSES: u32 = 8;

shared_struct! {
    /// `shared/call.wgsl`.
    Call {
        vector_from: u32,
        vector_to: u32,
        from_scale: f32,
        to_scale: f32,
        amount: f32,
        tolerance: f32,
        iterations_max: u32,
        flags: u32,
        pass_number: u32,
        pass_count: u32,
        reach: u32,
        level: u32,
        value_x: f32,
        value_y: f32,
        value_z: f32,
    }
}

/// The flags of a [`Call`].
pub(crate) const CALL_ITERATE: u32 = 1;
pub(crate) const CALL_BLOCKS: u32 = 2;
pub(crate) const CALL_FROM_SOLUTION: u32 = 4;
pub(crate) const CALL_DEFERRED: u32 = 8;
pub(crate) const CALL_REFERENCE: u32 = 16;
pub(crate) const CALL_REFINE: u32 = 32;
pub(crate) const CALL_ODD: u32 = 64;
pub(crate) const CALL_SCHWARZ: u32 = 128;
pub(crate) const CALL_SOLVE: u32 = 256;
pub(crate) const CALL_SECOND: u32 = 512;
pub(crate) const CALL_ENERGY: u32 = 1024;
pub(crate) const CALL_RESTARTS: u32 = 2048;

shared_struct! {
    /// `shared/solve.wgsl`.
    SolveState {
        phase: u32,
        iteration: u32,
        gamma: f32,
        residual: f32,
        reference: f32,
        alpha_before: f32,
        gamma_before: f32,
        omega: f32,
        halvings: u32,
        energy: f32,
        padding_1: u32,
        padding_2: u32,
    }
}

shared_struct! {
    /// `shared/solve.wgsl`.
    Solve {
        current: SolveState,
        next: SolveState,
        changed: u32,
        constrained: u32,
        released: u32,
        scalar: f32,
        outcome_iterations: u32,
        outcome_phase: u32,
        outcome_residual: f32,
        solves: u32,
        solves_unconverged: u32,
        iterations: u32,
        residual_max: f32,
        energy_before: f32,
        iterations_most: [u32; 4],
        energy_stride: u32,
        energy_filled: u32,
        energy_last: u32,
        padding: u32,
        energy_sums: [[f32; 4]; 16],
    }
}

/// Phases of a solve.
pub(crate) const SOLVE_RUNNING: u32 = 1;
pub(crate) const SOLVE_CONVERGED: u32 = 2;
pub(crate) const SOLVE_ENDED: u32 = 3;
pub(crate) const SOLVE_INDEFINITE: u32 = 5;

shared_struct! {
    /// `shared/group.wgsl`.
    Contact {
        group_count: u32,
        group_capacity: u32,
        cell_mask: u32,
        entries_capacity: u32,
        margin: f32,
        horizon: f32,
        lead: f32,
        cells_per_metre: f32,
    }
}

shared_struct! {
    /// `shared/collider.wgsl`.
    Collider {
        translation: [f32; 3],
        shape: u32,
        linear_velocity: [f32; 3],
        friction: f32,
        angular_velocity: [f32; 3],
        restitution: f32,
        row_x: [f32; 3],
        size_x: f32,
        row_y: [f32; 3],
        size_y: f32,
        row_z: [f32; 3],
        size_z: f32,
    }
}

shared_struct! {
    /// `shared/air.wgsl`.
    AirCloth {
        pressure: f32,
        friction: f32,
        gas: f32,
        gas_start: f32,
        gas_end: f32,
        padding: f32,
    }
}

shared_struct! {
    /// `shared/colour.wgsl`.
    Colour {
        first: u32,
        count: u32,
        ratio: f32,
        padding_0: u32,
    }
}

shared_struct! {
    /// `shared/pair_task.wgsl`.
    PairTask {
        reach: f32,
        length: f32,
        delta: f32,
        distance: f32,
        flags: u32,
        group_count: u32,
        pair_count: u32,
        pair_capacity: u32,
        found_capacity: u32,
        moved_blocks: u32,
        edge_count: u32,
        node_count: u32,
        own_group_count: u32,
        pair_first: u32,
        padding_0: u32,
        padding_1: u32,
    }
}

shared_struct! {
    /// `pins_write.wgsl`.
    Pin {
        position: [f32; 4],
        velocity: [f32; 3],
        particle: u32,
        has_position: u32,
        has_velocity: u32,
        padding_0: u32,
        padding_1: u32,
    }
}

shared_struct! {
    /// `shared/control_forces.wgsl`.
    ControlForce {
        force: [f32; 3],
        particle: u32,
        anchor: [f32; 3],
        stiffness: f32,
        before: [f32; 3],
        damping: f32,
        reach: f32,
        is_here: u32,
        padding_0: u32,
        padding_1: u32,
    }
}

#[cfg(test)]
mod tests {
    use cloth_kernels::WGSL_MODULES;

    use super::*;

    /// Every WGSL struct of that name, in any module, has these fields at these offsets.
    fn check(name: &str, fields: &[(&str, usize)], size: usize) {
        let mut found = 0;
        for module in WGSL_MODULES {
            for options in module.option_sets() {
                let text = module.compose(&options).unwrap();
                let parsed = naga::front::wgsl::parse_str(&text).unwrap();
                for (_, definition) in parsed.types.iter() {
                    let naga::TypeInner::Struct { members, span } = &definition.inner else {
                        continue;
                    };
                    if definition.name.as_deref() != Some(name) {
                        continue;
                    }
                    found += 1;
                    assert_eq!(*span as usize, size, "size of {name} in {}", module.name);
                    let members = members
                        .iter()
                        .map(|member| (member.name.as_deref().unwrap(), member.offset as usize));
                    assert!(members.eq(fields.iter().copied()), "{name} in {}", module.name);
                }
            }
        }
        assert!(found > 0, "no module has a struct {name}");
    }

    #[test]
    fn structs_have_the_layout_of_their_wgsl_twins() {
        check("Model", Model::FIELDS, size_of::<Model>());
        check("Substep", Substep::FIELDS, size_of::<Substep>());
        check("Status", Status::FIELDS, size_of::<Status>());
        check("Call", Call::FIELDS, size_of::<Call>());
        check("SolveState", SolveState::FIELDS, size_of::<SolveState>());
        check("Solve", Solve::FIELDS, size_of::<Solve>());
        check("Contact", Contact::FIELDS, size_of::<Contact>());
        check("Collider", Collider::FIELDS, size_of::<Collider>());
        check("AirCloth", AirCloth::FIELDS, size_of::<AirCloth>());
        check("Colour", Colour::FIELDS, size_of::<Colour>());
        check("Pin", Pin::FIELDS, size_of::<Pin>());
        check("PairTask", PairTask::FIELDS, size_of::<PairTask>());
        check("ControlForce", ControlForce::FIELDS, size_of::<ControlForce>());
    }
}
