//! Follows the README word by word, as somebody does who has never seen the program, with a stopwatch.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::LazyLock,
    time::{Duration, Instant},
};

use tempfile::TempDir;

/// Read where the repository is: a package of the program has no folder above its own.
static README: LazyLock<String> = LazyLock::new(|| {
    fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../README.md")).unwrap()
});
/// How the README calls the program in a clone.
const IN_A_CLONE: &str = "cargo run --release -- ";
/// Longest time of a command. It is a bound for slow machines and programs that are built for tests: `cloth run drape`
/// takes 5 s as it is handed out.
const TIME_LIMIT: Duration = Duration::from_secs(240);
/// Longest time of the first command, in a program whose pictures are drawn by code that is hardly optimised, beside another test.
const FIRST_LIMIT: Duration = Duration::from_secs(120);
/// Commands that other tests run: this one is the test, and that one is a window.
const ELSEWHERE: [&str; 2] = ["cargo xtask test", "cloth view napkin.toml"];

/// The fenced blocks of the README in this language, each with the text before it.
fn blocks(language: &str) -> Vec<(&'static str, &'static str)> {
    let mut found = Vec::new();
    let mut rest = README.as_str();
    while let Some((before, after)) = rest.split_once("\n```") {
        let (word, after) = after.split_once('\n').unwrap();
        let (block, after) = after.split_once("```").unwrap();
        if word == language {
            found.push((before, block));
        }
        rest = after;
    }
    found
}

/// The commands of the README in their order, without what is said about them.
fn commands() -> Vec<String> {
    let lines = blocks("sh").into_iter().flat_map(|(_, block)| block.lines());
    let commands = lines.map(|line| line.split(" #").next().unwrap().trim().to_owned());
    commands.filter(|command| !command.is_empty()).collect()
}

/// A folder in which the README is followed.
struct Reader(TempDir);

impl Reader {
    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cloth"));
        command.current_dir(self.0.path()).args(arguments).output().unwrap()
    }

    /// What the program says when it follows a command.
    fn follows(&self, command: &str, arguments: &[&str]) -> String {
        let start = Instant::now();
        let output = self.run(arguments);
        let time = start.elapsed();
        let said =
            String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        // Points in contact let triangles through, and the audit says so.
        let is_found = output.status.code() == Some(5) && command.starts_with("cloth audit");
        assert!(output.status.success() || is_found, "`{command}`:\n{said}");
        eprintln!("{:6.1} s  {command}", time.as_secs_f64());
        let limit = if command.ends_with(" run drape") { FIRST_LIMIT } else { TIME_LIMIT };
        assert!(time < limit, "`{command}` took {time:?}");
        said.into_owned()
    }
}

/// The scene of one's own, written where the README says.
fn scene_saved(reader: &Reader) {
    let whole = |(_, block): &(&str, &str)| block.contains("[simulation]");
    let scenes: Vec<_> = blocks("toml").into_iter().filter(whole).collect();
    let [(before, scene)] = scenes[..] else { panic!("one scene is expected") };
    let sentence = before.lines().last().unwrap_or_default().to_owned()
        + before.trim_end().lines().last().unwrap_or_default();
    let name = sentence.split("Save this as `").nth(1).and_then(|rest| rest.split('`').next());
    fs::write(reader.path(name.expect("it says where to save the scene")), scene).unwrap();
}

/// Whether a GPU can be asked.
fn has_gpu(reader: &Reader, backend: &str) -> bool {
    let said = String::from_utf8(reader.run(&["backends"]).stdout).unwrap();
    said.contains(&format!("{backend}: available")) || {
        let part = said.split(&format!("{backend}: ")).nth(1).unwrap_or_default();
        let part = part.split("\n\n").next().unwrap_or_default();
        part.contains("adapter 0")
    }
}

#[test]
fn its_commands_do_what_it_says() {
    let reader = Reader(TempDir::new().unwrap());
    scene_saved(&reader);
    let commands = commands();
    assert!(commands.len() > 15, "{commands:?}");
    for command in &commands {
        if ELSEWHERE.contains(&command.as_str()) {
            continue;
        }
        let program = command.strip_prefix(IN_A_CLONE).or(command.strip_prefix("cloth "));
        let program = program.unwrap_or_else(|| panic!("nobody tries `{command}`"));
        let mut arguments: Vec<&str> = program.split(' ').collect();
        if arguments.contains(&"--gallery") {
            // All of them take minutes in a program that is built for tests.
            arguments.extend(["--scene", "quad"]);
        }
        if ["--solver", "--adaptive", "--backend", "--feedback"]
            .iter()
            .any(|word| arguments.contains(word))
        {
            // The same scene once more in another way: its beginning is enough, above all where a processor stands for a GPU.
            arguments.extend(["--frames", "4"]);
        }
        if arguments[0] == "render" {
            arguments.extend(["--frame-stride", "6"]);
        }
        let asked = arguments.iter().position(|&word| word == "--backend");
        let backend = asked.map(|place| arguments[place + 1]);
        let is_drawn = arguments[0] == "render";
        let is_built = match backend {
            Some("cuda") => cfg!(feature = "cuda"),
            Some(_) => cfg!(feature = "wgpu"),
            None => !is_drawn || cfg!(feature = "viewer"),
        };
        let is_there = match backend {
            Some("auto") | None if !is_drawn => true,
            Some("cuda") => has_gpu(&reader, "cuda"),
            _ => has_gpu(&reader, "wgpu"),
        };
        if is_built && is_there {
            reader.follows(command, &arguments);
        } else {
            // A program that cannot says what it lacks.
            let output = reader.run(&arguments);
            let said = String::from_utf8(output.stderr).unwrap();
            assert!(said.contains("error: "), "`{command}`: {said}");
            eprintln!("     -    {command}: {}", said.trim());
        }
    }
    for product in [
        "out/drape/drape.gif",
        "gallery/index.html",
        "gallery/quad_000120.png",
        "out/napkin/napkin.glb",
        "out/napkin/napkin.pc2",
        "napkin.mdd",
        "back.fysl",
        "napkin.fysl",
    ] {
        let length = fs::metadata(reader.path(product)).map(|file| file.len());
        assert!(length.unwrap_or(0) > 500, "{product}");
    }
    picture_is_good(&reader.path("out/drape"));
    blender_is_served(&reader, "napkin", "out/napkin", 61);
}

/// All frames of the first picture, in the size that is told, and not of one colour.
fn picture_is_good(folder: &Path) {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut clip = options.read_info(File::open(folder.join("drape.gif")).unwrap()).unwrap();
    assert_eq!((clip.width(), clip.height()), (800, 450));
    let mut frames = 0;
    while clip.read_next_frame().unwrap().is_some() {
        frames += 1;
    }
    assert_eq!(frames, 76);
    let last = image::open(folder.join("png/drape_000075.png")).unwrap().into_rgb8();
    let is_red = |p: &&image::Rgb<u8>| i32::from(p[0]) > i32::from(p[1]) + 60;
    let share =
        last.pixels().filter(is_red).count() as f64 / f64::from(last.width() * last.height());
    assert!((0.02..0.5).contains(&share), "{share} of the picture is cloth");
}

/// Numbers of a PC2 file: particles, frames, and positions of the first frame.
fn point_cache(path: &Path) -> (usize, usize, Vec<[f32; 3]>) {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert_eq!(&bytes[..12], b"POINTCACHE2\0");
    let whole = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let number = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let (particles, frames) = (whole(16), whole(28));
    // From frame 0 on, a sample for each.
    assert_eq!((whole(12), number(20), number(24)), (1, 0.0, 1.0));
    assert_eq!(bytes.len(), 32 + 12 * particles * frames);
    let first = (0..particles).map(|k| [0, 4, 8].map(|axis| number(32 + 12 * k + axis)));
    (particles, frames, first.collect())
}

/// What the recipe for Blender names is there: a mesh and caches whose points are those of the mesh, in its order and axes,
/// so that the modifier needs no other setting.
fn blender_is_served(reader: &Reader, name: &str, folder: &str, frames: usize) {
    for word in [
        "import the `.glb`",
        "import `NAME_mesh.obj` with forward axis Y and up axis Z",
        "Mesh Cache modifier with the `.pc2` or `.mdd` of the same name",
        "`NAME_CLOTH_mesh.obj` and `NAME_CLOTH.pc2`",
        "set the frame rate of the scene to the one that\n`cloth` prints",
    ] {
        assert!(README.contains(word), "the recipe changed, and so must this test: {word}");
    }
    let folder = reader.path(folder);
    let mesh = fs::read_to_string(folder.join(format!("{name}_mesh.obj"))).unwrap();
    let vertices: Vec<[f32; 3]> = mesh
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|line| {
            let mut numbers = line.split_whitespace().map(|word| word.parse().unwrap());
            std::array::from_fn(|_| numbers.next().unwrap())
        })
        .collect();
    assert!(mesh.lines().any(|line| line.starts_with("f ")));
    let (particles, samples, first) = point_cache(&folder.join(format!("{name}.pc2")));
    assert_eq!((particles, samples), (vertices.len(), frames));
    let apart = vertices.iter().flatten().zip(first.iter().flatten()).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f32::max) < 1e-5);
    // Upright in the file as in the scene: the napkin begins level at z = 0.37.
    assert!(name != "napkin" || vertices.iter().all(|vertex| (vertex[2] - 0.37).abs() < 1e-6));
    let glb = folder.join(format!("{name}.glb"));
    if name == "napkin" {
        let bytes = fs::read(glb).unwrap();
        assert_eq!(&bytes[..4], b"glTF");
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        assert_eq!(json["animations"].as_array().map(Vec::len), Some(1), "{}", json["animations"]);
        // y is up there.
        let heights = &json["accessors"][0]["min"];
        assert!((heights[1].as_f64().unwrap() - 0.37).abs() < 1e-6, "{heights}");
    }
}

/// Several cloths have a mesh and a cache each, called as the recipe says, and the rate is printed.
#[test]
fn several_cloths_have_files_of_their_own() {
    let reader = Reader(TempDir::new().unwrap());
    let cloth = |name: &str, height: f64| {
        format!(
            "[[cloth]]\nname = \"{name}\"\nmaterial.preset = \"jersey\"\n\
             geometry.grid = {{ columns = 4, rows = 3, spacing = 0.1, centre = [0, 0, {height}] }}\n"
        )
    };
    let text = "name = \"two\"\nsimulation = { frames = 2, frames_per_second = 24 }\n".to_owned();
    fs::write(reader.path("two.toml"), text + &cloth("upper", 2.0) + &cloth("lower", 1.0)).unwrap();
    let arguments = ["run", "two.toml", "--format", "pc2,mdd"];
    let output = reader.run(&arguments);
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("24"), "{said}");
    for name in ["two_upper", "two_lower"] {
        blender_is_served(&reader, name, "out/two", 3);
        assert!(reader.path(&format!("out/two/{name}.mdd")).exists());
    }
}

/// Commands that the text names exist.
#[test]
fn the_program_knows_every_command_in_the_text() {
    let reader = Reader(TempDir::new().unwrap());
    let mut tried = Vec::new();
    for part in README.split('`') {
        let Some(rest) = part.strip_prefix("cloth ") else { continue };
        let word = rest.split(' ').next().unwrap();
        if !word.is_empty() && word.chars().all(char::is_alphabetic) && !tried.contains(&word) {
            assert!(reader.run(&["help", word]).status.success(), "`cloth {word}`");
            tried.push(word);
        }
    }
    assert!(tried.len() >= 6, "{tried:?}");
}

#[test]
fn blocks_and_comments_are_told_from_commands() {
    assert_eq!(commands()[0], "cargo run --release -- run drape");
    assert!(commands().iter().all(|command| !command.contains('#') && !command.contains("  ")));
    assert_eq!(blocks("toml").len(), 2);
}
