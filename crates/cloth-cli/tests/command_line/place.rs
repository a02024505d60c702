//! A folder to run the program in, and scenes small enough to run it often.

use std::{
    fs,
    path::PathBuf,
    process::{Child, Command, Output, Stdio},
};

use tempfile::TempDir;

/// A patch of 6 x 6 particles that hangs from two corners over a ball: a millisecond per frame.
pub(crate) const TINY: &str = r#"name = "tiny"

[simulation]
frames = 3
frames_per_second = 30
time_step = 1e-3

[[cloth]]
name = "patch"
pins = ["bottom-left", "bottom-right"]
geometry.grid = { columns = 6, rows = 6, spacing = 0.05, centre = [0, 0, 0.5] }

[cloth.material]
thickness = 0.002
mass.per_area = 0.2
stretch = { stiffness = 20 }
shear = { stiffness = 10 }
bend = { stiffness = 1 }

[[collider]]
name = "ball"
shape.sphere.radius = 0.1
translation = [0, 0, 0.35]
"#;

/// A scene around the mesh `mesh.obj`.
pub(crate) const MESH: &str = r#"name = "meshed"

[simulation]
frames = 2
time_step = 1e-4

[[cloth]]
name = "shirt"
geometry.mesh.file = "mesh.obj"
material.preset = "jersey"
"#;

/// A square of two triangles.
pub(crate) const SQUARE: &str = "v 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 1 2 3\nf 1 3 4\n";

/// An empty folder that goes away.
pub(crate) struct Place {
    folder: TempDir,
}

impl Place {
    pub(crate) fn new() -> Self {
        Self { folder: TempDir::new().unwrap() }
    }

    /// A folder with the file `name` in it.
    pub(crate) fn with(name: &str, content: impl AsRef<[u8]>) -> Self {
        let place = Self::new();
        place.write(name, content);
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The program in this folder, with small pictures where it runs a scene.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cloth"));
        command.current_dir(self.folder.path()).args(arguments);
        if arguments.first() == Some(&"run") {
            command.args(["--picture-size", "32x18"]);
        }
        command
    }

    pub(crate) fn output(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    pub(crate) fn start(&self, arguments: &[&str]) -> Child {
        let mut command = self.command(arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    }

    /// What the program prints where it does what it is asked to.
    #[track_caller]
    pub(crate) fn succeeds(&self, arguments: &[&str]) -> String {
        let output = self.output(arguments);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {errors}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// The one sentence with which the program refuses, after `error: `.
    #[track_caller]
    pub(crate) fn fails(&self, code: i32, arguments: &[&str]) -> String {
        let output = self.output(arguments);
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {errors}");
        let messages: Vec<_> =
            errors.lines().filter_map(|line| line.strip_prefix("error: ")).collect();
        assert_eq!(messages.len(), 1, "{errors}");
        assert!(!errors.contains("panicked"), "{errors}");
        messages[0].to_owned()
    }
}
