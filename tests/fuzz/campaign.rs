//! Inputs one after the other for a time, and those that were kept.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use crate::{
    arguments::{CampaignArguments, ReplayArguments},
    finding::{self, Harm},
    processor::{Processor, Reading},
    targets::{self, Target},
    worker::Order,
};

/// Time in which a finding is made smaller.
const SHRINKING: Duration = Duration::from_secs(30);

/// What became of the inputs of a target.
#[derive(Default)]
struct Tally {
    accepted: u64,
    refused: u64,
    /// Harm that a second reading did not show.
    passing: Vec<String>,
    /// Findings by cause, how often, and where the first one is kept.
    findings: BTreeMap<String, (Harm, u64, PathBuf)>,
}

type Tallies = Mutex<BTreeMap<&'static str, Tally>>;

/// Tries inputs; whether none did harm.
pub(crate) fn run(arguments: &CampaignArguments) -> Result<bool, String> {
    let chosen = chosen(&arguments.targets)?;
    let end = Instant::now() + Duration::from_secs(arguments.seconds);
    let next = AtomicU64::new(0);
    let tallies = Tallies::default();
    let most = arguments.inputs.unwrap_or(u64::MAX);
    let work = || -> io::Result<()> {
        let mut processor = Processor::new(arguments.limits);
        while Instant::now() < end {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= most {
                break;
            }
            let target = chosen[(number % chosen.len() as u64) as usize];
            one(arguments, target, number, &mut processor, &tallies)?;
        }
        Ok(())
    };
    thread::scope(|scope| {
        let jobs: Vec<_> = (0..arguments.jobs.max(1)).map(|_| scope.spawn(work)).collect();
        jobs.into_iter().try_for_each(|job| match job.join() {
            Ok(result) => result.map_err(|error| error.to_string()),
            Err(_) => Err("a thread panicked".into()),
        })
    })?;
    let tallies = tallies.into_inner().unwrap_or_else(PoisonError::into_inner);
    println!("seed {}, {} s, {} jobs", arguments.seed, arguments.seconds, arguments.jobs);
    Ok(print(&tallies))
}

/// The targets of these names, or all but those that do harm on purpose.
fn chosen(names: &[String]) -> Result<Vec<&'static Target>, String> {
    if names.is_empty() {
        return Ok(targets::all().iter().filter(|target| !target.is_trap).collect());
    }
    let find = |name: &String| {
        let known = targets::all().iter().map(|target| target.name).collect::<Vec<_>>().join(", ");
        targets::named(name).ok_or_else(|| format!("unknown target `{name}`; there are: {known}"))
    };
    names.iter().map(find).collect()
}

/// Has one input read, again alone if it did harm, and smaller if it did again.
fn one(
    arguments: &CampaignArguments,
    target: &'static Target,
    number: u64,
    processor: &mut Processor,
    tallies: &Tallies,
) -> io::Result<()> {
    let order = Order::Made { target: target.name, seed: arguments.seed, number };
    let harm = match processor.read(&order)? {
        Ok(reading) => {
            let mut tallies = tallies.lock().unwrap_or_else(PoisonError::into_inner);
            let tally = tallies.entry(target.name).or_default();
            match reading {
                Reading::Accepted => tally.accepted += 1,
                Reading::Refused => tally.refused += 1,
            }
            return Ok(());
        }
        Err(harm) => harm,
    };
    let again = processor.read_alone(&order)?;
    let mut guard = tallies.lock().unwrap_or_else(PoisonError::into_inner);
    let tally = guard.entry(target.name).or_default();
    let Err(harm) = again else {
        tally.passing.push(format!("input {number}: {harm}"));
        return Ok(());
    };
    if let Some((_, count, _)) = tally.findings.get_mut(&harm.key()) {
        *count += 1;
        return Ok(());
    }
    // Known from here on, so that nobody else makes another of the same cause smaller.
    tally.findings.insert(harm.key(), (harm.clone(), 1, PathBuf::new()));
    drop(guard);
    let input = targets::input(target, arguments.seed, number);
    let input = shrunk(target, input, &harm, processor)?;
    let path = finding::keep(&arguments.regressions, target.name, &input)?;
    println!("{}, input {number}: {harm}\n    kept as {}", target.name, path.display());
    let mut tallies = tallies.lock().unwrap_or_else(PoisonError::into_inner);
    let tally = tallies.entry(target.name).or_default();
    if let Some((_, _, kept)) = tally.findings.get_mut(&harm.key()) {
        *kept = path;
    }
    Ok(())
}

/// The input without what does not matter to its harm: parts are left out, smaller ones each time.
fn shrunk(
    target: &Target,
    mut input: Vec<u8>,
    harm: &Harm,
    processor: &mut Processor,
) -> io::Result<Vec<u8>> {
    let end = Instant::now() + SHRINKING;
    let file = tempfile::NamedTempFile::new()?;
    let path = file.path().display().to_string();
    let mut part = input.len() / 2;
    while part > 0 {
        let mut start = 0;
        while start < input.len() {
            if Instant::now() > end {
                return Ok(input);
            }
            let stop = (start + part).min(input.len());
            let without = [&input[..start], &input[stop..]].concat();
            fs::write(&path, &without)?;
            let order = Order::File { target: target.name, path: &path };
            match processor.read(&order)? {
                Err(found) if found.key() == harm.key() => input = without,
                _ => start = stop,
            }
        }
        part /= 2;
    }
    Ok(input)
}

/// Prints a table; whether there is no finding.
fn print(tallies: &BTreeMap<&'static str, Tally>) -> bool {
    println!("{:<12} {:>9} {:>9} {:>9}", "target", "accepted", "refused", "findings");
    for (name, tally) in tallies {
        let Tally { accepted, refused, findings, .. } = tally;
        println!("{name:<12} {accepted:>9} {refused:>9} {:>9}", findings.len());
    }
    for (name, tally) in tallies {
        for (harm, count, path) in tally.findings.values() {
            println!("finding: {name}, {count} times: {harm} ({})", path.display());
        }
        for passing in &tally.passing {
            println!("not seen again: {name}, {passing}");
        }
    }
    let findings: usize = tallies.values().map(|tally| tally.findings.len()).sum();
    let inputs: u64 = tallies.values().map(|tally| tally.accepted + tally.refused).sum();
    println!("{inputs} inputs without harm, {findings} findings");
    findings == 0
}

/// Reads kept inputs; whether none does harm any more.
pub(crate) fn replay(arguments: &ReplayArguments) -> Result<bool, String> {
    let mut files = Vec::new();
    for path in &arguments.paths {
        collect(path, &mut files).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    files.sort();
    let mut processor = Processor::new(arguments.limits);
    let mut is_good = true;
    for path in &files {
        let folder = path.parent().and_then(Path::file_name).unwrap_or_default();
        let target = targets::named(&folder.to_string_lossy())
            .ok_or_else(|| format!("{}: its folder is not named after a target", path.display()))?;
        let text = path.display().to_string();
        let order = Order::File { target: target.name, path: &text };
        match processor.read_alone(&order).map_err(|error| error.to_string())? {
            Ok(_) => {}
            Err(harm) => {
                is_good = false;
                println!("{text}: {harm}");
            }
        }
    }
    println!("{} inputs read again", files.len());
    Ok(is_good)
}

/// All files at or below `path`, but for notes.
fn collect(path: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    if path.is_dir() {
        for entry in fs::read_dir(path)? {
            collect(&entry?.path(), files)?;
        }
    } else if path.extension().is_none_or(|extension| extension != "md") {
        files.push(path.to_owned());
    }
    Ok(())
}
