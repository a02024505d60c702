//! The choice of what computes.

use std::{fs::File, io::BufReader};

use crate::place::{Place, TINY};

/// All coordinates in all frames, from the `npz` of a run.
fn positions(place: &Place, folder: &str) -> Vec<f32> {
    let file = File::open(place.path(&format!("{folder}/tiny.npz"))).unwrap();
    let mut archive = zip::ZipArchive::new(file).unwrap();
    let array = archive.by_name("positions.npy").unwrap();
    npyz::NpyFile::new(BufReader::new(array)).unwrap().into_vec().unwrap()
}

#[test]
#[cfg_attr(not(feature = "wgpu"), ignore = "needs the feature wgpu")]
fn the_gpu_gives_the_frames_that_the_cpu_gives() {
    let place = Place::with("tiny.toml", TINY);
    for backend in ["cpu", "wgpu"] {
        place.succeeds(&[
            "run",
            "tiny.toml",
            "--format",
            "npz",
            "--backend",
            backend,
            "--out",
            backend,
        ]);
    }
    let [cpu, gpu] = ["cpu", "wgpu"].map(|folder| positions(&place, folder));
    assert_eq!(cpu.len(), gpu.len());
    for (cpu, gpu) in cpu.iter().zip(&gpu) {
        assert!((cpu - gpu).abs() < 1e-5, "{cpu} {gpu}");
    }
}

/// Who asks for reports gets the time that each stage took, on the GPU, too.
#[test]
#[cfg_attr(not(feature = "wgpu"), ignore = "needs the feature wgpu")]
fn reports_have_the_times_of_stages() {
    let place = Place::with("tiny.toml", TINY);
    for backend in ["cpu", "wgpu"] {
        let run = ["run", "tiny.toml", "--format", "none", "--json", "--backend", backend];
        let lines = place.succeeds(&[&run[..], &["--out", backend]].concat());
        let last: serde_json::Value = serde_json::from_str(lines.lines().last().unwrap()).unwrap();
        let times = last["stage_times"].as_object().unwrap();
        let total: f64 = times.values().map(|time| time.as_f64().unwrap()).sum();
        assert!(times.contains_key("explicit_substep") && total > 0.0, "{backend}: {times:?}");
    }
}

#[test]
#[cfg_attr(not(feature = "wgpu"), ignore = "needs the feature wgpu")]
fn an_automatic_choice_says_what_it_took_and_why() {
    let place = Place::with("tiny.toml", TINY);
    let output = place.output(&["run", "tiny.toml", "--format", "none", "--backend", "auto"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{errors}");
    let line = errors.lines().find(|line| line.starts_with("backend: ")).unwrap();
    assert!(line.starts_with("backend: cpu (") && line.contains("not wgpu: "), "{line}");
}

#[test]
#[cfg_attr(not(feature = "wgpu"), ignore = "needs the feature wgpu")]
fn what_the_gpu_cannot_do_is_named() {
    let place = Place::with("tiny.toml", TINY);
    let message = place.fails(3, &["run", "tiny.toml", "--backend", "wgpu", "--precision", "f64"]);
    assert_eq!(message, "the wgpu backend does not support precision f64; choose another backend");
    let direct = ["--solver", "implicit", "--linear", "direct"];
    let message =
        place.fails(3, &[&["run", "tiny.toml", "--backend", "wgpu"][..], &direct].concat());
    assert_eq!(
        message,
        "the wgpu backend does not support the linear solver direct (it has cg and jacobi); choose \
         another backend"
    );
    let message = place.fails(1, &["run", "tiny.toml", "--backend", "wgpu", "--adapter", "abacus"]);
    assert!(message.contains("there is no adapter `abacus`; there are: 0 ("), "{message}");
    assert!(!place.path("out").exists());
}
