//! Small scenes that ask for much time or memory. Bounds on time are far above what is needed, so that they hold on
//! slow machines, and far below what the defects took.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::{
    fmt::Write,
    time::{Duration, Instant},
};

use cloth_scene::{CompileOptions, Scene, SceneError};

#[track_caller]
fn within<T>(seconds: u64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    assert!(start.elapsed() < Duration::from_secs(seconds), "took {:?}", start.elapsed());
    result
}

#[test]
fn two_hundred_thousand_opening_brackets_are_read_in_one_pass() {
    for text in ["<".repeat(200_000), "<a".repeat(100_000), "<a b='".repeat(40_000)] {
        let error = within(60, || Scene::from_fysl(&text, "deep.fysl")).unwrap_err();
        assert!(error.to_string().contains("nested deeper than 64 levels"), "{error}");
    }
    for text in ["<!--".repeat(50_000), "<?".repeat(100_000), "<![CDATA[".repeat(20_000)] {
        let error = within(60, || Scene::from_fysl(&text, "open.fysl")).unwrap_err();
        assert!(matches!(error, SceneError::Syntax { .. }), "{error}");
    }
}

/// Particles and joints as FYSL, with `end` after each element.
fn network(particles: u32, end: &str) -> String {
    let mut text = format!(
        "<fysl version=\"1.0\">{end}<scene name=\"net\"/><actors><group id=\"1\" name=\"g\">\
         <particles width=\"{particles}\">{end}"
    );
    for id in 1..=particles {
        write!(text, "<particle id=\"{id}\" position=\"{id} 0 0\"/>{end}").unwrap();
    }
    for id in 1..particles {
        let to = id + 1;
        write!(text, "<joint type=\"stretch\" from=\"{id}\" to=\"{to}\"/>{end}").unwrap();
    }
    text + "</particles><fabric preset=\"jersey\" mass=\"0.001\"/></group></actors></fysl>"
}

/// In a file of two megabytes; on lines of their own, and all on one line.
#[test]
fn twenty_thousand_particles_with_joints_are_read_in_linear_time() {
    for end in ["\n", ""] {
        let text = network(20_000, end);
        let scene = within(60, || Scene::from_fysl(&text, "net.fysl")).unwrap();
        let compiled = within(60, || scene.compile(&CompileOptions::default())).unwrap();
        assert_eq!(compiled.model.springs().len(), 19_999);
    }
    // Places are right all the same.
    let text = network(3000, "").replace("to=\"2001\"", "to=\"9999\"");
    let column = text.find("to=\"9999\"").unwrap() + 1;
    let message = Scene::from_fysl(&text, "net.fysl").unwrap_err().to_string();
    assert!(message.contains(&format!("line 1, column {column}: ")), "{message}");
}

#[test]
fn joints_of_rigid_bodies_do_not_build_the_world_again() {
    let mut text = String::from(
        "name = \"chain\"\n[[cloth]]\nname = \"c\"\nmaterial.preset = \"denim\"\n\
         geometry.grid = { columns = 2, rows = 2, spacing = 0.1 }\n",
    );
    for body in 0..600 {
        write!(
            text,
            "[[rigid]]\nname = \"b{body}\"\nmass = 1\nshape.sphere.radius = 0.1\n\
             translation = [{body}, 0, 0]\n"
        )
        .unwrap();
    }
    for body in 1..600 {
        let before = body - 1;
        write!(
            text,
            "[[rigid_joint]]\nkind = \"ball\"\nfrom = \"b{before}\"\nto = \"b{body}\"\n\
             anchor = [{body}, 0, 0]\n"
        )
        .unwrap();
    }
    let scene = Scene::from_toml(&text, "chain.toml").unwrap();
    let compiled = within(60, || scene.compile(&CompileOptions::default())).unwrap();
    assert_eq!(compiled.rigid_joints.len(), 599);
    // What is wrong with one of them is said at its line.
    let wrong = text.replacen("anchor = [300, 0, 0]", "anchor = [300, 0, 0]\naxis = [0, 0, 1]", 1);
    let line = 1 + wrong[..wrong.find("axis").unwrap()].matches('\n').count() - 4;
    let scene = Scene::from_toml(&wrong, "chain.toml").unwrap();
    let message = scene.compile(&CompileOptions::default()).unwrap_err().to_string();
    assert!(message.contains(&format!("line {line}, ")), "{message}");
}

fn pinned(side: u32, pins: &str, events: &str) -> Scene {
    let text = format!(
        "name = \"p\"\n[[cloth]]\nname = \"c\"\nmaterial.preset = \"denim\"\npins = [{pins}]\n\
         geometry.grid = {{ columns = {side}, rows = {side}, spacing = 0.1 }}\n{events}"
    );
    Scene::from_toml(&text, "p.toml").unwrap()
}

#[test]
fn pins_that_are_named_again_and_again_are_looked_for_once() {
    let corners = vec!["\"corners\", \"all\""; 50_000].join(",");
    let scene = pinned(300, &corners, "");
    let compiled = within(60, || scene.compile(&CompileOptions::default())).unwrap();
    assert_eq!(compiled.model.pins().len(), 90_000);
    // A row has one name, so that there are no more names than rows.
    let zeros = pinned(5, "\"row-01\"", "");
    let message = zeros.compile(&CompileOptions::default()).unwrap_err().to_string();
    assert!(message.contains("unknown set of particles `row-01`"), "{message}");
}

#[test]
fn events_that_name_too_many_particles_are_refused() {
    let mut events = String::new();
    for number in 0..3000 {
        write!(
            events,
            "[[event]]\ntime = {number}\ncloth = \"c\"\npins = [\"all\"]\n\
             action.move = {{ offset = [0, 0, 1], duration = 1 }}\n"
        )
        .unwrap();
    }
    let scene = pinned(100, "\"all\"", &events);
    let message = within(60, || scene.compile(&CompileOptions::default())).unwrap_err().to_string();
    assert!(message.contains("at most 16777216 are possible"), "{message}");
    let scene = pinned(10, "\"all\"", &events);
    within(60, || scene.compile(&CompileOptions::default())).unwrap();
}

#[test]
fn a_long_key_is_not_copied_into_the_path_of_each_key_below() {
    let mut text = format!("name = \"k\"\n[{}]\n", "k".repeat(1_000_000));
    for number in 0..50_000 {
        writeln!(text, "k{number} = 1").unwrap();
    }
    let error = within(60, || Scene::from_toml(&text, "k.toml")).unwrap_err();
    assert!(matches!(error, SceneError::Unknown(_)), "{error:.200}");
}

#[test]
fn counts_that_would_hang_a_gpu_have_caps() {
    for (key, most) in [
        ("implicit.iterations", 10_000),
        ("implicit.newton_iterations", 100),
        ("implicit.constraint_passes", 100),
        ("strain_limit.sweeps", 1000),
    ] {
        let compile = |count: u32| {
            let mut text = format!("name = \"c\"\nsimulation.{key} = {count}\n");
            text += "[[cloth]]\nname = \"c\"\nmaterial.preset = \"denim\"\n";
            text += "geometry.grid = { columns = 2, rows = 2, spacing = 0.1 }\n";
            Scene::from_toml(&text, "c.toml").unwrap().compile(&CompileOptions::default())
        };
        compile(most).unwrap();
        for count in [most + 1, u32::MAX] {
            let message = compile(count).unwrap_err().to_string();
            let expected = format!("`simulation.{key}` is {count}: give at most {most}");
            assert!(message.contains("line 2, ") && message.contains(&expected), "{message}");
        }
    }
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_no_scenes() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.toml");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let device = folder.path().join("zero.fysl");
    std::os::unix::fs::symlink("/dev/zero", &device).unwrap();
    for path in [&pipe, &device] {
        let error = within(60, || Scene::read(path)).unwrap_err();
        assert!(error.to_string().contains("not a regular file"), "{error}");
    }
}
