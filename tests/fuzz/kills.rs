//! Runs that are killed at random moments, resumed, and compared with runs that were left alone.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    os::unix::process::CommandExt,
    path::{Path, PathBuf},
    process::{Command, ExitStatus, Stdio},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use fastrand::Rng;
use nix::{
    sys::signal::{Signal, killpg},
    unistd::Pid,
};
use tempfile::TempDir;

use crate::arguments::KillArguments;

/// Frames from one checkpoint to the next.
const CHECKPOINT_EVERY: u64 = 3;
/// What runs write beside the frames: formats with files of single frames, and one that is made at the end.
const FORMATS: &str = "obj,npz";
/// The scene that is run, if it is cut down.
const CUT_DOWN: &str = "scene.toml";
/// Kills from one line that counts them to the next.
const SAID_EVERY: u64 = 100;
/// Time after which a run hangs.
const PATIENCE: Duration = Duration::from_secs(600);
/// Time that the other processes of a run that was killed have to go as well.
const LAST_BREATH: Duration = Duration::from_secs(2);

/// A scene on a backend.
struct Case {
    scene: String,
    backend: String,
    /// The folder of a run that was left alone, with the scene if it was cut down, and how long it took.
    whole: TempDir,
    time: Duration,
}

/// What was done, beside what was found.
#[derive(Default)]
struct Counts {
    kills: AtomicU64,
    /// Runs that went on from a checkpoint.
    resumed: AtomicU64,
    /// Those that ended before their first checkpoint, and began anew.
    anew: AtomicU64,
}

/// Kills runs; whether nothing was lost.
pub(crate) fn run(arguments: &KillArguments) -> Result<bool, String> {
    let cases = cases(arguments)?;
    let findings = Mutex::new(Vec::new());
    let counts = Counts::default();
    let next = AtomicU64::new(0);
    let work = || {
        while counts.kills.load(Ordering::Relaxed) < arguments.kills {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let case = &cases[(number % cases.len() as u64) as usize];
            let mut rng = Rng::with_seed(arguments.seed.wrapping_mul(1 << 32).wrapping_add(number));
            if let Err(problem) = one(arguments, case, &mut rng, &counts) {
                let problem =
                    format!("run {number}, {} on {}: {problem}", case.scene, case.backend);
                println!("finding: {problem}");
                findings.lock().unwrap_or_else(PoisonError::into_inner).push(problem);
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..arguments.jobs.max(1) {
            scope.spawn(work);
        }
    });
    let findings = findings.into_inner().unwrap_or_else(PoisonError::into_inner);
    let Counts { kills, resumed, anew } = counts;
    println!(
        "{} kills of runs of {} cases, {} resumed, {} begun anew, {} findings",
        kills.into_inner(),
        cases.len(),
        resumed.into_inner(),
        anew.into_inner(),
        findings.len()
    );
    Ok(findings.is_empty())
}

/// All scenes on all backends, each run once to its end.
fn cases(arguments: &KillArguments) -> Result<Vec<Case>, String> {
    let scenes: Vec<String> = if arguments.scenes.is_empty() {
        let built_in = cloth::scene::builtin_scenes();
        built_in.iter().map(|scene| scene.name.to_owned()).collect()
    } else {
        arguments.scenes.clone()
    };
    let backends: Vec<String> = if arguments.backends.is_empty() {
        ["cpu", "reference", "cuda", "wgpu"].map(str::to_owned).into()
    } else {
        arguments.backends.clone()
    };
    let mut cases = Vec::new();
    for backend in &backends {
        for scene in &scenes {
            let whole = TempDir::new().map_err(|error| error.to_string())?;
            let start = Instant::now();
            if let Some(side) = arguments.side {
                cut_down(scene, side, whole.path())?;
            }
            let file = whole.path().join(CUT_DOWN);
            let run = Run { scene, file: arguments.side.map(|_| file.as_path()), backend };
            let mut command = command(arguments, run, whole.path(), Start::New);
            let status = ended(&mut command, None).map_err(|error| error.to_string())?;
            if status.success() {
                let (scene, backend) = (scene.clone(), backend.clone());
                cases.push(Case { scene, backend, whole, time: start.elapsed() });
                continue;
            }
            // A backend that the machine lacks, or that lacks what the scene needs, says so with its own code.
            println!("not run here: {scene} on {backend}: {status}: {}", log(whole.path()));
            if !arguments.backends.is_empty() {
                return Err(format!("{scene} on {backend} cannot be run"));
            }
        }
    }
    if cases.is_empty() { Err("nothing can be run".into()) } else { Ok(cases) }
}

/// Writes a scene with small patches beside the run that is left alone.
fn cut_down(scene: &str, side: u32, folder: &Path) -> Result<(), String> {
    let small = harness::scenes::small(scene, side).map_err(|error| error.to_string())?;
    let text = small.to_toml().map_err(|error| error.to_string())?;
    fs::write(folder.join(CUT_DOWN), text).map_err(|error| error.to_string())
}

/// How a run begins.
#[derive(Clone, Copy)]
enum Start {
    New,
    Resumed,
    Anew,
}

/// What is run.
#[derive(Clone, Copy)]
struct Run<'a> {
    scene: &'a str,
    /// The scene cut down, in place of the built-in one.
    file: Option<&'a Path>,
    backend: &'a str,
}

fn command(arguments: &KillArguments, run: Run, folder: &Path, start: Start) -> Command {
    let mut command = Command::new(&arguments.program);
    command.arg("run").arg(run.file.unwrap_or(Path::new(run.scene)));
    command.args(["--backend", run.backend, "--format", FORMATS, "--threads", "2"]);
    if run.backend == "reference" {
        // It has no other.
        command.args(["--precision", "f64"]);
    }
    command.args(["--frames", &arguments.frames.to_string()]);
    command.args(["--checkpoint-every", &CHECKPOINT_EVERY.to_string()]);
    command.arg("--out").arg(folder.join("run"));
    match start {
        Start::New => {}
        Start::Resumed => drop(command.arg("--resume")),
        Start::Anew => drop(command.arg("--overwrite")),
    }
    command.stdin(Stdio::null()).stdout(Stdio::null());
    if let Ok(log) = fs::File::create(folder.join("log")) {
        command.stderr(log);
    }
    command
}

/// The last line that a run wrote to stderr.
fn log(folder: &Path) -> String {
    let text = fs::read_to_string(folder.join("log")).unwrap_or_default();
    text.lines().last().unwrap_or_default().to_owned()
}

/// Runs a command to its end, or up to a moment at which it gets a signal.
///
/// The signal goes to all processes of the run: a program that only starts another one would leave that behind, at work
/// in the folder.
fn ended(command: &mut Command, moment: Option<(Duration, Signal)>) -> io::Result<ExitStatus> {
    let mut child = command.process_group(0).spawn()?;
    let group = Pid::from_raw(child.id().cast_signed());
    let start = Instant::now();
    let mut pending = moment;
    loop {
        if let Some(status) = child.try_wait()? {
            await_all_of(group);
            return Ok(status);
        }
        if let Some((at, signal)) = pending
            && start.elapsed() >= at
        {
            killpg(group, signal)?;
            pending = None;
        }
        if start.elapsed() > PATIENCE {
            killpg(group, Signal::SIGKILL)?;
            child.wait()?;
            return Err(io::Error::other("it hangs"));
        }
        thread::sleep(Duration::from_millis(1));
    }
}

/// Waits until no process of a group is left, but not for one that nobody collects.
fn await_all_of(group: Pid) {
    let start = Instant::now();
    while killpg(group, None).is_ok() && start.elapsed() < LAST_BREATH {
        thread::sleep(Duration::from_millis(1));
    }
}

/// Kills a run, perhaps several times, until one ends by itself, and compares what it left.
fn one(
    arguments: &KillArguments,
    case: &Case,
    rng: &mut Rng,
    counts: &Counts,
) -> Result<(), String> {
    let folder = TempDir::new().map_err(|error| error.to_string())?;
    let run = folder.path().join("run");
    let mut start = Start::New;
    loop {
        let last = matches!(start, Start::Resumed | Start::Anew) && rng.u8(..3) > 0;
        let moment = (!last).then(|| {
            let signal = match rng.u8(..10) {
                0 => Signal::SIGTERM,
                1 => Signal::SIGINT,
                _ => Signal::SIGKILL,
            };
            (case.time.mul_f64(rng.f64()), signal)
        });
        let file = case.whole.path().join(CUT_DOWN);
        let what = Run {
            scene: &case.scene,
            file: arguments.side.map(|_| file.as_path()),
            backend: &case.backend,
        };
        let mut command = command(arguments, what, folder.path(), start);
        let status = ended(&mut command, moment).map_err(|error| error.to_string())?;
        if status.success() {
            let outcome = compare(case.whole.path(), folder.path(), arguments.frames);
            return outcome.map_err(|problem| kept(problem, folder, case));
        }
        let Some((at, signal)) = moment.filter(|(_, signal)| is_of(status, *signal)) else {
            return Err(format!("{status}: {}", log(folder.path())));
        };
        let kills = counts.kills.fetch_add(1, Ordering::Relaxed) + 1;
        if kills.is_multiple_of(SAID_EVERY) {
            println!("{kills} kills");
        }
        let problem = |text: String| format!("{signal} after {at:?}: {text}");
        let frames = frames(&run, &case.whole.path().join("run"), arguments.frames);
        let saved = checkpoint_frame(&run);
        // The frames since the last checkpoint may be computed again, no others.
        let next = saved.map_or(0, |saved| saved + 1) + CHECKPOINT_EVERY;
        if frames > next + 1 {
            return Err(problem(format!(
                "{frames} frames are there, a checkpoint after {saved:?}"
            )));
        }
        if saved.is_some_and(|saved| frames < saved + 1) {
            return Err(problem(format!("a checkpoint after {saved:?}, but {frames} frames")));
        }
        let count;
        (start, count) = match saved {
            Some(_) => (Start::Resumed, &counts.resumed),
            None => (Start::Anew, &counts.anew),
        };
        count.fetch_add(1, Ordering::Relaxed);
    }
}

/// A problem, with where the run is kept that has it, beside the one that was left alone.
fn kept(problem: String, folder: TempDir, case: &Case) -> String {
    let folder = folder.keep();
    let place = folder.join("whole");
    match files(case.whole.path()) {
        Ok(files) => files.into_iter().for_each(|(name, bytes)| {
            let file = place.join(name);
            // What cannot be kept is not there to look at, and the problem is told all the same.
            let _ = file.parent().map(fs::create_dir_all);
            let _ = fs::write(file, bytes);
        }),
        Err(error) => println!("{}: {error}", case.whole.path().display()),
    }
    format!("{problem}; kept in {}", folder.display())
}

/// Whether a process ended as one does that got this signal: by it, or with the code that stands for it.
fn is_of(status: ExitStatus, signal: Signal) -> bool {
    use std::os::unix::process::ExitStatusExt;

    status.signal() == Some(signal as i32) || status.code() == Some(128 + signal as i32)
}

/// Complete frames in the store of a run, by the size that those of a whole run have.
fn frames(run: &Path, whole: &Path, frames: u64) -> u64 {
    const HEADER: u64 = 64;
    let size = |folder: &Path| {
        fs::metadata(folder.join("frames.bin")).map_or(0, |metadata| metadata.len())
    };
    let record = size(whole).saturating_sub(HEADER) / (frames + 1);
    size(run).saturating_sub(HEADER) / record.max(1)
}

/// The frame of the checkpoint of a run, if it has one.
fn checkpoint_frame(run: &Path) -> Option<u64> {
    let bytes = fs::read(run.join("checkpoint.bin")).ok()?;
    // After magic, version, precision and fingerprint; what is shorter is no checkpoint, which the run itself will say.
    let word = bytes.get(24..32).and_then(|word| word.first_chunk()).copied();
    Some(word.map_or(0, u64::from_le_bytes))
}

/// Every file of a run that was resumed is that of the whole one, and there are no others.
fn compare(whole: &Path, resumed: &Path, frames: u64) -> Result<(), String> {
    let [whole, resumed] = [whole, resumed].map(|folder| files(&folder.join("run")));
    let (whole, resumed) =
        (whole.map_err(|error| error.to_string())?, resumed.map_err(|error| error.to_string())?);
    let names: BTreeSet<_> = whole.keys().chain(resumed.keys()).collect();
    for name in names {
        let shown = name.display();
        match (whole.get(name), resumed.get(name)) {
            // Reports have times that pass in the world.
            (Some(_), Some(resumed)) if name == Path::new("report.jsonl") => {
                let lines = resumed.iter().filter(|byte| **byte == b'\n').count() as u64;
                if lines != frames {
                    return Err(format!("{lines} reports of {frames} frames"));
                }
            }
            (Some(whole), Some(resumed)) if whole != resumed => {
                return Err(format!("`{shown}` is another one"));
            }
            (Some(_), Some(_)) => {}
            (Some(_), None) => return Err(format!("`{shown}` is missing")),
            (None, _) => return Err(format!("`{shown}` was left behind")),
        }
    }
    Ok(())
}

/// All files below a folder.
fn files(folder: &Path) -> io::Result<BTreeMap<PathBuf, Vec<u8>>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next)? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap_or(&path).to_owned();
                found.insert(name, fs::read(&path)?);
            }
        }
    }
    Ok(found)
}
