//! What comes back from the device.

use super::*;

/// Bytes that come back from the device in a frame, on average over `frames` that are drawn.
fn bytes_of_frames(gpu: &Gpu, engine: &mut Engine, frames: u64) -> u64 {
    let before = gpu.backend().bytes_read();
    for _ in 0..frames {
        engine.step().unwrap();
        engine.snapshot(Overlays::default()).unwrap();
    }
    (gpu.backend().bytes_read() - before) / frames
}

/// Of a cloth of nine times as many particles no byte more comes back, with and without a pull.
#[test]
fn positions_never_leave_the_device() {
    let gpu = gpu();
    let fine = SCENE
        .replace(
            "columns = 15, rows = 15, spacing = 0.05",
            "columns = 45, rows = 45, spacing = 0.016",
        )
        .replace("time_step = 2e-3", "time_step = 1e-3");
    for text in [SCENE, &fine] {
        let scene = Scene::from_toml(text, "sheet.toml").unwrap();
        let mut engine = Engine::new(&gpu, scene, CompileOptions::default(), "wgpu").unwrap();
        // Frames are kept on the device, too.
        engine.keep_frames(KEEP).unwrap();
        let idle = bytes_of_frames(&gpu, &mut engine, 5);
        let ray = ray_to([0.0, 0.0, 0.36]);
        let before = gpu.backend().bytes_read();
        assert!(engine.grab_begin(&ray).unwrap().is_some());
        assert!(engine.pick(&ray).unwrap().is_some());
        assert_eq!(gpu.backend().bytes_read(), before, "solvers are not asked");
        for number in 0..6 {
            engine.grab_move(&ray_to([0.02 * f64::from(number), 0.0, 0.36]));
            let pulled = bytes_of_frames(&gpu, &mut engine, 10);
            assert_eq!(pulled, idle, "a pull brings nothing back");
        }
        assert!(idle < 640, "{idle} bytes");
        // What is asked for is counted: position and velocity of every particle.
        let before = gpu.backend().bytes_read();
        let state = engine.state().unwrap();
        assert!(state.positions.iter().all(|x| x[0].is_finite()));
        let size = 32 * state.positions.len() as u64;
        assert_eq!(gpu.backend().bytes_read() - before, size);
        engine.step().unwrap();
        let before = gpu.backend().bytes_read();
        engine.snapshot(Overlays { contacts: true, ..Overlays::default() }).unwrap();
        assert_eq!(gpu.backend().bytes_read() - before, size, "an overlay that the host computes");
    }
}

#[test]
fn bodies_exchange_impulses_alone() {
    let gpu = gpu();
    let scene = Scene::builtin("ball-on-sheet").unwrap();
    let mut engine = Engine::new(&gpu, scene, CompileOptions::default(), "wgpu").unwrap();
    let particles = engine.scene().model.particle_count() as u64;
    let bodies = engine.scene().model.colliders().len() as u64;
    let found = bytes_of_frames(&gpu, &mut engine, 2);
    let parts = (500.0 / engine.scene().frames_per_second).ceil() as u64;
    // The results of each exchange: figures, and an impulse of each body.
    assert!(found < parts * (640 + 192 * bodies), "{found} bytes in {parts} exchanges");
    assert!(found < 16 * particles, "{found} bytes, {particles} particles");
}
