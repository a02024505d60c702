//! The CUDA kernels of a whole frame, run on the processor, give the bits of the CPU backend: what can be known of them on a
//! machine without a GPU. Threads take turns in orders drawn by lot, so that a missing barrier shows.
#![cfg(target_os = "linux")]

mod compiler;
mod contact;
mod linear;
mod program;
mod scene;
mod schwarz;

use harness::{backends::cpu, bits::first_difference, checks::PatchFrames};
use program::{Form, Program, Share};

const fn form(module: &'static str, options: &'static [&'static str], threads: u32) -> Form {
    Form { module, options, share: Share::Tiles, threads }
}

const fn mesh(module: &'static str, options: &'static [&'static str], threads: u32) -> Form {
    Form { module, options, share: Share::Particles, threads }
}

/// Sides of a patch of several tiles along both, the last ones not full; and one that is small enough for a block for each tile.
const LARGE: [u32; 2] = [70, 43];
const SMALL: [u32; 2] = [43, 20];
/// One that is folded far from most of its tiles: some touch others, some nothing.
const BROAD: [u32; 2] = [200, 19];
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

/// The text with a part of it changed.
fn replaced(text: &str, right: &str, wrong: &str) -> String {
    assert!(text.contains(right), "the kernel has no longer `{right}`");
    text.replace(right, wrong)
}

fn check(form: &Form, sides: [u32; 2], contact: bool, blocks: &[u32]) {
    check_edited(form, sides, contact, blocks, |text| text);
}

#[test]
fn meshes() {
    check(&mesh("explicit_substep", &["packed"], 256), LARGE, false, &[3, 2]);
}

#[test]
fn patches() {
    check(&form("explicit_substep", &["table", "grid", "stencil"], 256), LARGE, false, &[4, 6]);
}

/// A bead that every particle would have passed unseen is found on their paths, by each way through a substep; without the look at paths
/// it is not.
#[test]
fn paths_through_a_collider() {
    let patch =
        |sides| PatchFrames { thrown: true, frames: &[1, 2], ..PatchFrames::explicit(sides) };
    for (form, sides) in [
        (mesh("explicit_substep", &["packed"], 256), LARGE),
        (form("explicit_substep", &["table", "grid", "stencil"], 256), SMALL),
    ] {
        let patch = patch(sides);
        let expected = patch.run(&cpu(2)).expect("the CPU simulates the patch");
        let blocks = if sides == SMALL { TILES } else { 3 };
        let (state, _) = Program::of(&form, |text| text).run(&patch, blocks, 1);
        assert_eq!(first_difference(&expected, &state), None, "{}", form.module);
        let blind = |text: String| {
            let looks = "path.length_squared > surface.distance * surface.distance";
            replaced(&text, looks, "false")
        };
        let (state, _) = Program::of(&form, blind).run(&patch, blocks, 1);
        assert_ne!(
            first_difference(&expected, &state),
            None,
            "{}: no path met the bead",
            form.module
        );
    }
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
        replaced(&text, "#define GROUPS_FEW 1024", "#define GROUPS_FEW 0")
    });
    let roomy =
        form("explicit_substep", &["penalty", "table", "grid", "many_registers", "stencil"], 256);
    check(&roomy, SMALL, true, &[TILES, TILES, TILES]);
}

#[test]
fn large_patches_with_contact() {
    let flat = form("explicit_substep_flat", &[], 128);
    check(&flat, LARGE, true, &[4, 1, 7]);
    check(&flat, BROAD, true, &[4, 3]);
    // Regions that are left in almost every substep; groups that are looked at one by one; and room for few of them at once.
    for (right, wrong) in [
        ("s.list_margin + share", "(real)0.02 * s.list_margin + share"),
        (
            "bool is_flat = group_is_flat(s, row, column, lane, substep.tick)",
            "bool is_flat = false",
        ),
        ("TOGETHER = COLUMNS * ROWS / GROUP", "TOGETHER = 2"),
    ] {
        check_edited(&flat, BROAD, true, &[3], |text| replaced(&text, right, wrong));
    }
}

/// Threads of a block, fewer than on a device.
const STAGES_THREADS: u32 = 64;

/// The form for models in which stages follow the pass, its text changed by `edit`, and the CPU: the final states and contacts.
fn stages(
    patch: &PatchFrames,
    options: &'static [&'static str],
    region: Option<usize>,
    edit: impl Fn(String) -> String,
) -> bool {
    let share = Share::Stages(region);
    let form = Form { module: "explicit_substep_stages", options, share, threads: STAGES_THREADS };
    let program = Program::of(&form, |text| {
        edit(replaced(&text, "#define THREADS 512", &format!("#define THREADS {STAGES_THREADS}")))
    });
    let expected = patch.run(&cpu(2)).expect("the CPU simulates the patch");
    [3, 4].into_iter().all(|blocks| {
        let (state, contacts) = program.run(patch, blocks, blocks - 3);
        assert_eq!(contacts > 0, patch.contact || patch.impulses, "{contacts} contacts");
        first_difference(&expected, &state).is_none()
    })
}

#[test]
fn substeps_of_several_stages() {
    let plain = PatchFrames::explicit(LARGE);
    let impulses = PatchFrames { impulses: true, ..plain.clone() };
    let penalty = PatchFrames { contact: true, ..plain.clone() };
    let limited = |sweeps, patch: &PatchFrames| PatchFrames { sweeps, ..patch.clone() };
    let same = |text| text;
    assert!(stages(&impulses, &["impulses", "packed", "many_registers"], None, same));
    let crowded = |text: String| replaced(&text, "PARTNERS_KEPT 24", "PARTNERS_KEPT 1");
    assert!(stages(&impulses, &["impulses"], None, crowded));
    // Of 3010 particles: in the last, blocks have one region each.
    for (sweeps, region) in [(1, Some(64)), (2, None), (2, Some(1024))] {
        assert!(stages(&limited(sweeps, &plain), &["limits"], region, same), "{sweeps} {region:?}");
        assert!(stages(&limited(sweeps, &impulses), &["impulses", "limits"], region, same));
    }
    assert!(stages(&limited(1, &penalty), &["penalty", "limits", "packed"], Some(64), same));
}

#[test]
fn substeps_of_fabric() {
    let plain = PatchFrames { fabric: true, ..PatchFrames::explicit(LARGE) };
    let same = |text| text;
    assert!(stages(&plain, &["fabric", "extras"], None, same));
    let penalty = PatchFrames { contact: true, ..plain.clone() };
    assert!(stages(&penalty, &["penalty", "fabric", "extras"], None, same));
    let impulses = PatchFrames { impulses: true, ..plain.clone() };
    assert!(stages(&impulses, &["impulses", "fabric", "extras"], None, same));
    let limited = PatchFrames { sweeps: 2, ..plain.clone() };
    let with_limits: &'static [&str] = &["limits", "fabric", "extras"];
    assert!(stages(&limited, with_limits, None, same));
    for (right, wrong) in [
        ("sweep < s.limit_sweeps; sweep++", "sweep < s.limit_sweeps; sweep += 2"),
        ("(stretch - ratio) / total / stretch", "(stretch - ratio) / total"),
        ("shift[a] = shift[a] + minus(", "shift[a] = shift[a] + ("),
    ] {
        let edit = |text: String| replaced(&text, right, wrong);
        assert!(!stages(&limited, with_limits, None, edit), "`{wrong}` is not found");
    }
    // Barriers that are not there, derivatives of other vertices, damping left out, a fold taken the longer way around.
    for (right, wrong) in [
        ("if (!PENALTY) meet();", ""),
        (
            "meet();\n        for (uint k = own; k < s.element_count",
            "for (uint k = own; k < s.element_count",
        ),
        (
            "meet();\n        for (uint k = own; k < s.fold_count",
            "for (uint k = own; k < s.fold_count",
        ),
        ("gradient[vertex] * -sum", "gradient[3 - vertex] * -sum"),
        ("still * state.x + moving * state.y", "still * state.x"),
        ("real with_sign = steep != (x < 0) ? -within : within;", "real with_sign = -within;"),
        ("if (law.damping > 0)", "if (law.damping < 0)"),
    ] {
        let edit = |text: String| replaced(&text, right, wrong);
        assert!(!stages(&plain, &["fabric", "extras"], None, edit), "`{wrong}` is not found");
    }
}

/// Barriers that are not there, a sweep that is not done, crowds that are not counted.
#[test]
fn faults_of_several_stages_are_found() {
    let patch = PatchFrames { impulses: true, sweeps: 2, ..PatchFrames::explicit(LARGE) };
    for (right, wrong) in [
        (
            "real share = w / total / (real)max(crowd, crowds[j]);",
            "real share = w / total / (real)crowd;",
        ),
        (
            "if (k < region.owned) v[k] = part.motion.v[particles[k]];",
            "if (k < region.owned) v[k] = {0, 0, 0, part.motion.v[particles[k]].w};",
        ),
        ("sweep <= s.limit_sweeps; sweep++", "sweep <= s.limit_sweeps; sweep += 2"),
        (
            "if (i < region.owned) v[i] = limit_velocity",
            "if (i + 1 < region.owned) v[i] = limit_velocity",
        ),
    ] {
        let edit = |text: String| replaced(&text, right, wrong);
        assert!(!stages(&patch, &["impulses", "limits"], Some(64), edit), "`{wrong}` is not found");
    }
}

/// Faults in a kernel are found: a sum in another order, a barrier that is not there, and contacts that are not looked for.
#[test]
fn faults_are_found() {
    let pass = form("explicit_substep", &["table", "grid", "stencil"], 256);
    let flat = form("explicit_substep_flat", &[], 128);
    let faults = [
        (&pass, "uint kind = STENCIL_KINDS - 1 - k;", "uint kind = k;"),
        (&flat, "STENCIL_KINDS - 1 - n, first", "n, first"),
        (&flat, "if (roughs != 0 || !is_alone) {", "if (roughs != 0) {"),
        (&flat, "if (roughs != 0 || !is_alone) {", "if (!is_alone) {"),
        (&flat, "lane < listed && !(clear &&", "lane < listed && !("),
        (&flat, "squared[j] + least[j] >= enough", "true"),
    ];
    for (form, right, wrong) in faults {
        let contact = form.module == flat.module;
        let patch = patch(if contact { BROAD } else { LARGE }, contact);
        let expected = patch.run(&cpu(2)).expect("the CPU simulates the patch");
        let program = Program::of(form, |text| replaced(&text, right, wrong));
        let (state, _) = program.run(&patch, 3, 1);
        assert!(first_difference(&expected, &state).is_some(), "`{wrong}` is not found");
    }
}
