//! Checks that passed are not done again while nothing changed that they depend on: a program that passed is named by its own
//! content, by that of all files that tests may read, and by what the machine has.

use std::{
    collections::BTreeSet,
    env, fs,
    hash::{DefaultHasher, Hasher},
    io::{self, Read},
    path::{Path, PathBuf},
};

use crate::{artifacts::Artifact, command};

/// Packages whose tests read sources of Rust, which are no part of what names a program that passed.
const READS_SOURCES: [&str; 1] = ["xtask"];

/// Folders that hold what is made, not what is given.
const MADE: [&str; 2] = ["target", ".git"];

/// What tells that the machine has a GPU, or a driver of one.
const DEVICES: [&str; 3] = ["/dev/nvidia0", "/dev/dri", "/usr/share/vulkan/icd.d"];

/// What passed before, in the build folder.
#[derive(Default)]
pub(crate) struct Passed {
    /// Empty if nothing is kept.
    folder: PathBuf,
    /// Of all that every test may depend on.
    context: u64,
}

impl Passed {
    /// What passed with these programs at hand; nothing if it is to be done again.
    pub(crate) fn open(programs: &[Artifact], again: bool) -> Self {
        let root = command::root();
        let target =
            env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), Into::into);
        let folder = target.join("passed");
        if again {
            // What is not there need not be removed.
            let _ = fs::remove_dir_all(&folder);
        }
        let mut files = BTreeSet::new();
        list(root, &mut files);
        let mut context = DefaultHasher::new();
        for path in files {
            context.write(path.as_os_str().as_encoded_bytes());
            // A file that vanishes while it is read is one that changed.
            let _ = content(&path, &mut context);
        }
        for program in programs.iter().filter(|program| !program.is_test) {
            let _ = content(&program.path, &mut context);
        }
        for (name, value) in env::vars_os() {
            let of_ours = |prefix: &str| name.as_encoded_bytes().starts_with(prefix.as_bytes());
            if of_ours("CLOTH_") || of_ours("VK_") || name == "CXX" {
                context.write(name.as_encoded_bytes());
                context.write(value.as_encoded_bytes());
            }
        }
        for device in DEVICES {
            context.write_u8(u8::from(Path::new(device).exists()));
        }
        Self { folder, context: context.finish() }
    }

    /// What a program printed when it passed, if nothing has changed since.
    pub(crate) fn text(&self, program: &Artifact) -> Option<String> {
        fs::read_to_string(self.path(program)?).ok()
    }

    /// Notes that a program passed, and what it printed. If that fails it is run again, nothing else.
    pub(crate) fn note(&self, program: &Artifact, text: &str) {
        if let Some(path) = self.path(program) {
            let _ = fs::create_dir_all(&self.folder);
            let _ = fs::write(path, text);
        }
    }

    /// The file of a program that passed, unless it is to be run each time.
    fn path(&self, program: &Artifact) -> Option<PathBuf> {
        let has_none = self.folder.as_os_str().is_empty();
        if has_none
            || program
                .package
                .file_name()
                .is_some_and(|name| READS_SOURCES.iter().any(|of| name == *of))
        {
            return None;
        }
        let mut hasher = DefaultHasher::new();
        hasher.write_u64(self.context);
        content(&program.path, &mut hasher).ok()?;
        Some(self.folder.join(format!("{}-{:016x}", program.name, hasher.finish())))
    }
}

/// The files below a folder that are no sources of Rust, in the order of their names.
fn list(folder: &Path, files: &mut BTreeSet<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        match entry.file_type() {
            Ok(kind) if kind.is_dir() && !MADE.iter().any(|made| name == *made) => {
                list(&path, files);
            }
            Ok(kind) if kind.is_file() && path.extension().is_none_or(|of| of != "rs") => {
                files.insert(path);
            }
            _ => {}
        }
    }
}

/// Adds the content of a file.
fn content(path: &Path, hasher: &mut DefaultHasher) -> io::Result<()> {
    let mut file = fs::File::open(path)?;
    let mut bytes = vec![0; 1 << 20];
    loop {
        match file.read(&mut bytes)? {
            0 => return Ok(()),
            count => hasher.write(&bytes[..count]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn program(folder: &Path, package: &str) -> Artifact {
        Artifact {
            name: "program".into(),
            kind: "test".into(),
            is_test: true,
            path: folder.join("program"),
            package: folder.join(package),
        }
    }

    #[test]
    fn a_program_passed_until_it_or_what_it_reads_changes() {
        let folder = env::temp_dir().join(format!("cloth-passed-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("program"), "one").unwrap();
        let here = |context| Passed { folder: folder.join("passed"), context };
        let program = |package| program(&folder, package);
        here(1).note(&program("cloth"), "test result: ok. 3 passed");
        assert_eq!(here(1).text(&program("cloth")).as_deref(), Some("test result: ok. 3 passed"));
        assert_eq!(here(2).text(&program("cloth")), None, "a file changed");
        here(1).note(&program("xtask"), "test result: ok. 3 passed");
        assert_eq!(here(1).text(&program("xtask")), None, "its tests read sources");
        fs::write(folder.join("program"), "two").unwrap();
        assert_eq!(here(1).text(&program("cloth")), None, "the program changed");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn sources_of_rust_and_what_is_made_are_left_out() {
        let mut files = BTreeSet::new();
        list(command::root(), &mut files);
        assert!(files.contains(&command::root().join("README.md")));
        assert!(!files.iter().any(|path| path.extension().is_some_and(|of| of == "rs")));
        assert!(!files.iter().any(|path| path.starts_with(command::root().join("target"))));
    }
}
