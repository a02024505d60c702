//! `cloth validate`.

use std::{
    fs,
    io::{Write, stdout},
    time::Instant,
};

use cloth::{BackendOptions, Precision, backend_open};
use cloth_laboratory::{
    EXPERIMENTS, Experiment, Flaw, Laboratory, Outcome, Thoroughness, page, table,
};

use crate::{
    arguments::ValidateArguments,
    failure::{Failure, WriteError},
    foreign::hushed,
    say::{self, Shown},
};

/// Experiments that did not measure what is expected.
#[derive(Debug, thiserror::Error)]
#[error("{} of {of} experiments failed: {}", names.len(), names.join(", "))]
struct Failed {
    names: Vec<&'static str>,
    of: usize,
}

pub(crate) fn validate(arguments: &ValidateArguments) -> Result<(), Failure> {
    // Names of devices come from elsewhere.
    let mut out = Shown(stdout().lock());
    let experiments = chosen(&arguments.names)?;
    if arguments.list {
        for Experiment { name, title, source, .. } in experiments {
            writeln!(out, "{name}: {title}\n  expected: {source}")?;
        }
        return Ok(());
    }
    let options =
        BackendOptions { adapter: arguments.adapter.clone(), ..BackendOptions::default() };
    let backend = hushed(|| backend_open(&arguments.backend, &options))?;
    let info = backend.info();
    let best =
        || if info.precisions.contains(&Precision::F64) { Precision::F64 } else { Precision::F32 };
    let precision = arguments.precision.unwrap_or_else(best);
    let thoroughness = if arguments.quick { Thoroughness::Quick } else { Thoroughness::Full };
    let laboratory =
        Laboratory { backend: &*backend, precision, thoroughness, flaw: Flaw::default() };
    let mut outcomes: Vec<(&Experiment, Outcome)> = Vec::new();
    for experiment in experiments {
        let start = Instant::now();
        let outcome = (experiment.run)(&laboratory)?;
        let verdict = if outcome.passes() { "passed" } else { "FAILED" };
        writeln!(
            out,
            "{}  {verdict} in {:.1} s\n",
            table(experiment, &outcome),
            start.elapsed().as_secs_f64()
        )?;
        outcomes.push((experiment, outcome));
    }
    if let Some(file) = &arguments.out {
        let device = format!("{} ({}), precision {precision}", info.name, info.device);
        fs::write(file, page(&device, &outcomes))
            .map_err(WriteError::of(file))
            .map_err(Failure::other)?;
        say::note(format!("wrote {}", file.display()));
    }
    let failed = outcomes.iter().filter(|(_, outcome)| !outcome.passes());
    let names: Vec<_> = failed.map(|(experiment, _)| experiment.name).collect();
    if names.is_empty() {
        return Ok(());
    }
    Err(Failure::other(Failed { names, of: outcomes.len() }))
}

/// The experiments of these names, or all of them.
fn chosen(names: &[String]) -> Result<Vec<&'static Experiment>, Failure> {
    let find = |name: &String| {
        EXPERIMENTS.iter().find(|experiment| experiment.name == name).ok_or_else(|| {
            let known: Vec<_> = EXPERIMENTS.iter().map(|experiment| experiment.name).collect();
            Failure::Usage(format!("unknown experiment `{name}`; there are: {}", known.join(", ")))
        })
    };
    if names.is_empty() {
        Ok(EXPERIMENTS.iter().collect())
    } else {
        names.iter().map(find).collect()
    }
}
