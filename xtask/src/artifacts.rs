//! What cargo builds: programs, by name and place.

use std::{
    path::{Path, PathBuf},
    process::Stdio,
};

use serde_json::Value;

use crate::command::{self, cargo};

/// A program that cargo built.
#[derive(Clone, Debug)]
pub(crate) struct Artifact {
    /// Name of the target.
    pub(crate) name: String,
    /// Kind of the target as cargo calls it: `bin`, `example`, `test`, `lib`, `bench`.
    pub(crate) kind: String,
    /// Whether it runs tests.
    pub(crate) is_test: bool,
    /// Where it is.
    pub(crate) path: PathBuf,
    /// Folder of the package that it belongs to.
    pub(crate) package: PathBuf,
}

/// Builds with these arguments of cargo and lists the programs that came of it.
///
/// # Errors
/// Why cargo failed.
pub(crate) fn build(arguments: &[&str]) -> Result<Vec<Artifact>, String> {
    let mut command = cargo(arguments);
    // The benchmark says of which sources it was made, also where they are not.
    if let Some(revision) = command::revision() {
        command.env("CLOTH_REVISION", revision);
    }
    command.args(["--message-format", "json-render-diagnostics"]).stderr(Stdio::inherit());
    let output = command.output().map_err(|error| error.to_string())?;
    if !output.status.success() {
        return Err(format!("cargo {}: {}", arguments.join(" "), output.status));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    Ok(text.lines().filter_map(|line| artifact(&serde_json::from_str(line).ok()?)).collect())
}

/// The program that a message of cargo tells of, if it tells of one.
fn artifact(message: &Value) -> Option<Artifact> {
    let target = message.get("target")?;
    Some(Artifact {
        name: target.get("name")?.as_str()?.to_owned(),
        kind: target.get("kind")?.get(0)?.as_str()?.to_owned(),
        is_test: message.get("profile")?.get("test")?.as_bool()?,
        path: message.get("executable")?.as_str()?.into(),
        package: Path::new(message.get("manifest_path")?.as_str()?).parent()?.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_message_of_a_program_is_told_from_others() {
        let message = |executable: Value| {
            json!({
                "reason": "compiler-artifact",
                "manifest_path": "/there/cloth/Cargo.toml",
                "target": { "name": "simulation", "kind": ["test"] },
                "profile": { "test": true },
                "executable": executable,
            })
        };
        let found = artifact(&message(json!("/there/target/simulation-0"))).unwrap();
        assert_eq!((found.name.as_str(), found.kind.as_str()), ("simulation", "test"));
        assert!(found.is_test);
        assert_eq!(found.package, Path::new("/there/cloth"));
        assert!(artifact(&message(Value::Null)).is_none(), "a library has no program");
        assert!(artifact(&json!({ "reason": "build-finished", "success": true })).is_none());
    }
}
