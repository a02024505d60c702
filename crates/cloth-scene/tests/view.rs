//! What a scene says of its pictures.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use cloth_scene::{CompileOptions, Scene, SceneError};

fn compile(view: &str) -> Result<Option<cloth_scene::SceneView>, SceneError> {
    let text = format!(
        "view = {{ eye = [0, -3, 1], target = [0, 0, 0.5], {view} }}\n[[cloth]]\nmaterial.preset = 'denim'\n\
         geometry.grid = {{ columns = 3, rows = 3, spacing = 0.1 }}\n"
    );
    Ok(Scene::from_toml(&text, "t.toml")?.compile(&CompileOptions::default())?.view)
}

#[test]
fn pictures_show_strain_and_threads_if_the_scene_says_so() {
    let view = compile("strain = 0.05, threads = true").unwrap().unwrap();
    assert_eq!((view.strain, view.threads), (Some(0.05), true));
    let view = compile("field_of_view = 40").unwrap().unwrap();
    assert_eq!((view.strain, view.threads), (None, false));
}

#[test]
fn impossible_scales_are_refused_by_their_key() {
    for (view, says) in [
        ("strain = 0", "must be greater than zero"),
        ("strain = -0.1", "must be greater than zero"),
        ("strain = inf", "finite"),
        ("strain = 'red'", "expected f64"),
        ("threads = 'warp'", "expected a boolean"),
    ] {
        let message = compile(view).unwrap_err().to_string();
        let key = view.split(' ').next().unwrap();
        assert!(message.contains(key) && message.contains(says), "{view}: {message}");
    }
    let message = compile("thread = true").unwrap_err().to_string();
    assert!(message.contains("threads"), "{message}");
}
