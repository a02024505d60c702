//! The thread that simulates.

use super::*;

/// Waits until what is shown is as expected.
fn wait(thread: &SimulationThread, what: &str, expected: impl Fn(&cloth_viewer::Shown) -> bool) {
    let start = Instant::now();
    while !expected(&thread.shown()) {
        assert!(start.elapsed() < Duration::from_secs(60), "never: {what}");
        assert!(thread.is_alive());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn the_thread_obeys_and_never_keeps_the_caller_waiting() {
    let gpu = gpu();
    let source = || Source::Scene(Box::new(scene()), CompileOptions::default());
    let thread = SimulationThread::start(&gpu, source(), "cpu", true, KEEP, || {});
    let frame = |shown: &cloth_viewer::Shown| shown.snapshot.as_ref().map(|s| s.frame);
    wait(&thread, "a first picture", |shown| frame(shown) == Some(0));
    thread.send(Command::Step);
    wait(&thread, "one step", |shown| frame(shown) == Some(1));
    assert!(thread.shown().snapshot.unwrap().paused);
    thread.send(Command::PauseToggle);
    wait(&thread, "it runs", |shown| frame(shown) > Some(3));
    thread.send(Command::PauseToggle);
    wait(&thread, "it waits", |shown| shown.snapshot.as_ref().unwrap().paused);
    thread.send(Command::CornerToggle(2));
    wait(&thread, "a pin less", |shown| shown.snapshot.as_ref().unwrap().held.len() == 1);
    thread.send(Command::Reset);
    wait(&thread, "the start", |shown| {
        frame(shown) == Some(0) && shown.snapshot.as_ref().unwrap().held.len() == 2
    });
    let wrong = Settings { time_step: -1.0, ..thread.shown().settings.unwrap() };
    thread.send(Command::Settings(wrong));
    wait(&thread, "a refusal", |shown| shown.settings_answered == 1);
    assert_eq!(thread.shown().message.unwrap().severity, Severity::Error);
    assert!((thread.shown().settings.unwrap().time_step - 2e-3).abs() < 1e-12);
    thread.send(Command::Open(source(), "abacus".into()));
    wait(&thread, "another refusal", |shown| shown.message_number == 2);
    thread.send(Command::Step);
    wait(&thread, "it still works", |shown| frame(shown) == Some(1));
}

#[test]
fn the_thread_looks_back_and_plays_on() {
    let gpu = gpu();
    let source = Source::Scene(Box::new(scene()), CompileOptions::default());
    let thread = SimulationThread::start(&gpu, source, "cpu", true, KEEP, || {});
    let view = |shown: &cloth_viewer::Shown| {
        shown.snapshot.as_ref().map(|s| (s.frame, s.is_past, s.paused))
    };
    for _ in 0..8 {
        thread.send(Command::Step);
    }
    wait(&thread, "eight frames", |shown| view(shown) == Some((8, false, true)));
    thread.send(Command::Seek(3));
    wait(&thread, "frame 3", |shown| view(shown) == Some((3, true, true)));
    thread.send(Command::CornerToggle(2));
    wait(&thread, "a refusal", |shown| shown.message.is_some());
    assert_eq!(thread.shown().message.unwrap().severity, Severity::Info);
    thread.send(Command::StepBack);
    wait(&thread, "the one before", |shown| view(shown) == Some((2, true, true)));
    thread.send(Command::Step);
    thread.send(Command::Step);
    wait(&thread, "two later", |shown| view(shown) == Some((4, true, true)));
    thread.send(Command::Seek(u64::MAX));
    wait(&thread, "the last one", |shown| view(shown) == Some((8, false, true)));
    thread.send(Command::Seek(0));
    wait(&thread, "the first one", |shown| view(shown) == Some((0, true, true)));
    thread.send(Command::PauseToggle);
    wait(&thread, "it goes on from the last one", |shown| {
        view(shown).is_some_and(|(frame, is_past, paused)| frame > 8 && !is_past && !paused)
    });
    thread.send(Command::Seek(5));
    wait(&thread, "frame 5", |shown| view(shown) == Some((5, true, true)));
    thread.send(Command::GoOnFromHere);
    thread.send(Command::PauseToggle);
    wait(&thread, "it went on from there", |shown| {
        shown
            .snapshot
            .as_ref()
            .is_some_and(|s| s.paused && !s.is_past && s.kept.unwrap().range == Some([0, s.frame]))
    });
}

#[test]
fn the_thread_saves_the_scene_with_its_settings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changed.toml");
    let gpu = gpu();
    let source = Source::Scene(Box::new(scene()), CompileOptions::default());
    let thread = SimulationThread::start(&gpu, source, "cpu", true, KEEP, || {});
    wait(&thread, "a first picture", |shown| shown.settings.is_some());
    let mut settings = thread.shown().settings.unwrap();
    settings.gravity = [0.0, 0.0, -1.62];
    settings.cloths[0].material.bend.stiffness = 2.5;
    thread.send(Command::Settings(settings.clone()));
    let save = |replace| Command::Save { path: path.clone(), replace };
    thread.send(save(false));
    wait(&thread, "it is saved", |shown| shown.message_number == 1);
    let saved = Scene::read(&path).unwrap();
    let engine = Engine::new(&gpu, saved, CompileOptions::default(), "cpu").unwrap();
    assert_eq!(engine.settings(), &settings);
    thread.send(save(false));
    wait(&thread, "a refusal", |shown| shown.message_number == 2);
    assert_eq!(thread.shown().message.unwrap().severity, Severity::Error);
    thread.send(save(true));
    wait(&thread, "it is replaced", |shown| shown.message_number == 3);
    assert_eq!(thread.shown().message.unwrap().severity, Severity::Info);
}

/// What a file dialog gives, or what is dropped, is opened by its path; a path that is nothing is refused and changes nothing.
#[test]
fn what_is_chosen_is_opened() {
    let folder = tempfile::tempdir().unwrap();
    let scene_file = folder.path().join("chosen.toml");
    std::fs::write(
        &scene_file,
        SCENE.replace("name = \"sheet\"\n    sim", "name = \"chosen\"\n    sim"),
    )
    .unwrap();
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for number in 0..3 {
        std::fs::write(folder.path().join(format!("leaf_{number:06}.obj")), mesh).unwrap();
    }
    let gpu = gpu();
    let first = Source::Scene(Box::new(scene()), CompileOptions::default());
    let thread = SimulationThread::start(&gpu, first, "cpu", true, KEEP, || {});
    let name = |shown: &cloth_viewer::Shown| shown.subject.as_ref().map(|s| s.name.clone());
    wait(&thread, "the first scene", |shown| name(shown).as_deref() == Some("sheet"));
    thread.send(Command::Open(Source::open_path(&scene_file).unwrap(), "cpu".into()));
    wait(&thread, "the scene", |shown| name(shown).as_deref() == Some("chosen"));
    for path in [folder.path().join("leaf_000001.obj"), folder.path().to_owned()] {
        thread.send(Command::Open(Source::open_path(&path).unwrap(), "cpu".into()));
        wait(&thread, "three frames", |shown| {
            shown.snapshot.as_ref().is_some_and(|snapshot| snapshot.recorded == Some(3))
        });
        thread.send(Command::Open(Source::open_path(&scene_file).unwrap(), "cpu".into()));
        wait(&thread, "the scene again", |shown| {
            shown.snapshot.as_ref().is_some_and(|snapshot| snapshot.recorded.is_none())
        });
    }
    assert!(Source::open_path(&folder.path().join("nothing.toml")).is_err());
    assert!(thread.is_alive());
}
