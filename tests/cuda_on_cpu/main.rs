//! The CUDA kernels of a whole frame, run on the processor, give the bits of the CPU backend: what can be known of them on a
//! machine without a GPU. Threads take turns in orders drawn by lot, so that a missing barrier shows.
#![cfg(target_os = "linux")]

mod program;
mod scene;

use harness::{backends::cpu, bits::first_difference, checks::PatchFrames};
use program::{Form, Program};

const fn form(module: &'static str, options: &'static [&'static str], threads: u32) -> Form {
    Form { module, options, is_mesh: false, threads }
}

const fn mesh(module: &'static str, options: &'static [&'static str], threads: u32) -> Form {
    Form { module, options, is_mesh: true, threads }
}

/// Sides of a patch of several tiles along both, the last ones not full; and one that is small enough for a block for each tile.
const LARGE: [u32; 2] = [70, 43];
const SMALL: [u32; 2] = [43, 20];
/// Tiles of the small one.
const TILES: u32 = 2 * 3;

fn patch(sides: [u32; 2], contact: bool) -> PatchFrames {
    PatchFrames { contact, ..PatchFrames::explicit(sides) }
}

/// The form, its text changed by `edit`, gives the bits of the CPU with so many blocks, in order and by lot.
fn check_edited(
    form: &Form,
    sides: [u32; 2],
    contact: bool,
    blocks: &[u32],
    edit: impl Fn(String) -> String,
) {
    let patch = patch(sides, contact);
    let expected = patch.run(&cpu(2)).expect("the CPU simulates the patch");
    let program = Program::of(form, edit);
    for (seed, &blocks) in blocks.iter().enumerate() {
        let (state, contacts) = program.run(&patch, blocks, seed as u32);
        assert_eq!(first_difference(&expected, &state), None, "{blocks} blocks, seed {seed}");
        assert_eq!(contacts > 0, contact, "{contacts} contacts");
    }
}

fn check(form: &Form, sides: [u32; 2], contact: bool, blocks: &[u32]) {
    check_edited(form, sides, contact, blocks, |text| text);
}

#[test]
fn meshes() {
    check(&mesh("explicit_substep", &["packed"], 256), LARGE, false, &[3, 2]);
    check(&mesh("explicit_substep_mesh", &[], 640), LARGE, false, &[2, 3, 4]);
}

#[test]
fn patches() {
    check(&form("explicit_substep", &["table", "grid", "stencil"], 256), LARGE, false, &[4, 6]);
    check(&form("explicit_substep_tiles", &[], 128), LARGE, false, &[4, 1, 3, 7]);
    check(&form("explicit_substep_patch", &[], 256), SMALL, false, &[TILES, TILES]);
}

#[test]
fn meshes_with_contact() {
    check(&mesh("explicit_substep", &["penalty", "packed"], 256), LARGE, true, &[3, 2]);
}

#[test]
fn patches_with_contact() {
    let tiles = form("explicit_substep", &["penalty", "table", "grid", "stencil"], 256);
    check(&tiles, LARGE, true, &[3, 6]);
    // The list of groups as it is built where these are many.
    check_edited(&tiles, LARGE, true, &[6, 3], |text| {
        let few = "#define GROUPS_FEW 1024";
        assert!(text.contains(few), "the kernel has no longer `{few}`");
        text.replace(few, "#define GROUPS_FEW 0")
    });
    let wide = form("explicit_substep", &["penalty", "table", "grid", "wide", "stencil"], 256);
    check(&wide, SMALL, true, &[TILES, TILES, TILES]);
}

/// Faults in a kernel are found: a sum in another order, and a barrier that is not there.
#[test]
fn faults_are_found() {
    let patch = patch(LARGE, false);
    let expected = patch.run(&cpu(2)).expect("the CPU simulates the patch");
    let tiles = form("explicit_substep_tiles", &[], 128);
    let faults = [
        ("STENCIL_KINDS - 1 - n, first", "n, first"),
        (
            "int above = slot_above(place);\n            __syncthreads();",
            "int above = slot_above(place);",
        ),
    ];
    for (right, wrong) in faults {
        let program = Program::of(&tiles, |text| {
            assert!(text.contains(right), "the kernel has no longer `{right}`");
            text.replace(right, wrong)
        });
        let (state, _) = program.run(&patch, 3, 1);
        assert!(first_difference(&expected, &state).is_some(), "`{wrong}` is not found");
    }
}
