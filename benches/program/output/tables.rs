//! Results as tables of text, for the terminal and for the page alike.

use crate::{
    record::{Record, Results, Verdict},
    suite::{INTEGRATORS_PUBLISHED, group, ladder::SINGLE_THREAD},
};

/// A table.
pub(super) struct Table {
    pub(super) title: String,
    /// What there is to know about it.
    pub(super) note: &'static str,
    pub(super) heading: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
}

/// All tables that the results have rows for.
pub(super) fn tables(results: &Results) -> Vec<Table> {
    let mut tables = vec![engines(results)];
    let groups = [
        (group::EXPLICIT, "A frame is 1/60 s in 17 substeps; a patch falls onto a sphere."),
        (group::CONTACT, "The same with self-contact, which grows as the cloth folds."),
        (group::IMPLICIT, "A step of 1/60 s, 30 iterations; a patch hangs, 24 neighbours."),
        (group::JACOBI, "The same with damped Jacobi."),
        (
            group::SEMI_IMPLICIT,
            "The same with the constant matrix, factorised or iterated to its tolerance.",
        ),
        (group::SCALING, "256 x 256 particles on more and more threads."),
        (group::RESIDUAL, "One step with more and more iterations: what residual for what time."),
    ];
    tables.extend(groups.iter().filter_map(|(group, note)| measured(results, group, note)));
    tables.extend(integrators(results));
    tables.extend(stiffness(results));
    tables.extend(linear(results));
    tables.extend(ladder(results));
    let details = [
        (group::TABLE_INTEGRATORS, "What the times of the table of integrators bought."),
        (group::TABLE_LINEAR, "What the times of the table of linear solvers bought."),
    ];
    tables.extend(details.iter().filter_map(|(group, note)| measured(results, group, note)));
    tables.extend(failures(results));
    tables.retain(|table| !table.rows.is_empty());
    tables
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_owned()).collect()
}

fn of_group<'a>(results: &'a Results, group: &'a str) -> impl Iterator<Item = &'a Record> {
    results.records.iter().filter(move |record| record.group == group)
}

/// Three digits that count.
pub(super) fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let before = value.abs().log10().floor() as i32;
    if (-3..6).contains(&before) {
        format!("{value:.*}", usize::try_from(2 - before).unwrap_or(0))
    } else {
        format!("{value:.2e}")
    }
}

fn engines(results: &Results) -> Table {
    let mut rows: Vec<_> = results
        .engines
        .iter()
        .map(|engine| vec![engine.backend.clone(), engine.device.clone(), digits(engine.copy_rate)])
        .collect();
    let absent = results.absent.iter();
    rows.extend(
        absent.map(|(name, reason)| vec![name.clone(), format!("absent: {reason}"), "-".into()]),
    );
    Table {
        title: "Backends".into(),
        note: "What copies within their memory reach is measured here, read and written counted.",
        heading: words(&["backend", "device", "copies GB/s"]),
        rows,
    }
}

/// Time, what makes it credible, and what it bought.
fn measured(results: &Results, group: &str, note: &'static str) -> Option<Table> {
    let mut rows = Vec::new();
    for record in of_group(results, group) {
        let copies =
            results.engines.iter().find(|engine| engine.backend == record.backend)?.copy_rate;
        let quality = &record.quality;
        let option = |value: Option<f64>| value.map_or_else(|| "-".into(), digits);
        let name = match (record.label.as_str(), record.threads, record.iterations) {
            ("", _, _) => record.backend.clone(),
            (label, Some(threads), _) => format!("{}, {label}, {threads}", record.backend),
            (label, None, Some(count)) => format!("{}, {label}, {count}", record.backend),
            (label, None, None) => format!("{}, {label}", record.backend),
        };
        rows.push(vec![
            name,
            format!("{} x {}", record.columns, record.rows),
            time(record),
            digits(record.frame.median),
            format!("{} - {}", digits(record.frame.lower), digits(record.frame.upper)),
            digits(record.first_frame),
            option(record.rate()),
            option(record.rate().map(|rate| rate / copies)),
            digits(record.memory_host),
            option(record.memory_device),
            digits(quality.strain_mean),
            if quality.residual > 0.0 { digits(quality.residual) } else { "-".into() },
            quality.contacts.to_string(),
            digits(quality.difference),
        ]);
    }
    let heading = [
        "backend",
        "particles",
        "ms",
        "with report",
        "quartiles",
        "first",
        "GB/s",
        "of copies",
        "B/particle",
        "on device",
        "strain",
        "residual",
        "contacts",
        "difference",
    ];
    Some(Table { title: group.to_owned(), note, heading: words(&heading), rows })
}

/// The best time, or that it means nothing.
pub(super) fn time(record: &Record) -> String {
    match record.verdict {
        Verdict::Invalid => "invalid".into(),
        _ => digits(record.time()),
    }
}

fn per_second(record: &Record) -> String {
    match record.verdict {
        Verdict::Invalid => "invalid".into(),
        _ => digits(1e3 / record.time()),
    }
}

fn integrators(results: &Results) -> Option<Table> {
    let names = ["explicit", "implicit", "semi-implicit"];
    let mut heading = words(&["backend"]);
    for (side, _) in INTEGRATORS_PUBLISHED {
        heading.extend(names.map(|name| format!("{name} {side} x {side}")));
    }
    let cells = INTEGRATORS_PUBLISHED.iter().flat_map(|(_, published)| published.map(digits));
    let mut rows =
        vec![["Pentium III 600 MHz, 2000".to_owned()].into_iter().chain(cells).collect()];
    for engine in &results.engines {
        let mut row = vec![engine.backend.clone()];
        for (side, _) in INTEGRATORS_PUBLISHED {
            for name in names {
                let found = of_group(results, group::TABLE_INTEGRATORS).find(|record| {
                    record.backend == engine.backend
                        && record.columns == side
                        && record.label == name
                });
                row.push(found.map_or_else(|| "-".into(), per_second));
            }
        }
        rows.push(row);
    }
    let has_rows = of_group(results, group::TABLE_INTEGRATORS).next().is_some();
    has_rows.then(|| Table {
        title: "Three integrators, frames per second".into(),
        note: "Steps of 20 ms; explicit integration with ten sweeps of the limit of strain, the others on a patch 1,000 times as stiff as it bears.",
        heading,
        rows,
    })
}

fn stiffness(results: &Results) -> Option<Table> {
    let first = results.stiffness.first()?;
    let heading =
        ["backend".to_owned()].into_iter().chain(first.1.iter().map(|(name, _)| name.clone()));
    let mut rows = vec![words(&["published, 2000", "1", "10^5", "10^5"])];
    for (backend, bounds) in &results.stiffness {
        let cells = bounds.iter().map(|(_, exponent)| match exponent {
            -1 => "none".to_owned(),
            0 => "1".to_owned(),
            exponent => format!("10^{exponent}"),
        });
        rows.push([backend.clone()].into_iter().chain(cells).collect());
    }
    Some(Table {
        title: "How far stiffness can be raised".into(),
        note: "From what explicit integration bears in steps of 20 ms; 10^6 is the largest that is tried.",
        heading: heading.collect(),
        rows,
    })
}

fn linear(results: &Results) -> Option<Table> {
    let records: Vec<_> = of_group(results, group::TABLE_LINEAR).collect();
    let mut sizes: Vec<_> =
        records.iter().map(|record| (record.particles(), record.columns)).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let mut heading = words(&["backend", "method", "iterations"]);
    heading.extend(sizes.iter().map(|(particles, _)| particles.to_string()));
    let mut rows = Vec::new();
    for published in [("GPU, 2006", "Jacobi", "20"), ("processor, 2006", "-", "2")] {
        let mut row = words(&[published.0, published.1, "-"]);
        row.extend(
            sizes.iter().map(|(p, _)| if *p == 3600 { published.2.into() } else { "-".into() }),
        );
        rows.push(row);
    }
    for engine in &results.engines {
        let of_engine = || records.iter().filter(|record| record.backend == engine.backend);
        let mut kinds: Vec<_> = of_engine().map(|r| (r.label.clone(), r.iterations)).collect();
        kinds.dedup();
        kinds.sort();
        kinds.dedup();
        for (label, count) in kinds {
            let mut row = vec![engine.backend.clone(), label.clone()];
            row.push(count.map_or_else(|| "-".into(), |count| count.to_string()));
            for &(particles, _) in &sizes {
                let found = of_engine().find(|record| {
                    record.particles() == particles
                        && record.label == label
                        && record.iterations == count
                });
                row.push(found.map_or_else(|| "-".into(), |record| per_second(record)));
            }
            rows.push(row);
        }
    }
    (!records.is_empty()).then(|| Table {
        title: "Linear solvers, frames per second against particles".into(),
        note: "Steps of 10 ms, 24 neighbours. 667,648 particles is where the work of 2006 wanted to get to.",
        heading,
        rows,
    })
}

fn ladder(results: &Results) -> Option<Table> {
    let records: Vec<_> = of_group(results, group::TABLE_LADDER).collect();
    let mut sides: Vec<_> = records.iter().map(|record| record.columns).collect();
    sides.sort_unstable();
    sides.dedup();
    let mut labels: Vec<&str> = Vec::new();
    for record in &records {
        if !labels.contains(&record.label.as_str()) {
            labels.push(&record.label);
        }
    }
    let find = |label: &str, side: u32| {
        records.iter().find(|record| record.label == label && record.columns == side)
    };
    let mut heading = words(&["rung", "published, 2025"]);
    heading.extend(sides.iter().map(|side| format!("{side} x {side}")));
    let mut rows = Vec::new();
    for label in labels {
        let published = sides.iter().find_map(|&side| find(label, side)?.published);
        let mut row =
            vec![label.to_owned(), published.map_or_else(|| "-".into(), |p| format!("{p} x"))];
        for &side in &sides {
            let cell = find(label, side).map(|record| {
                let single = find(SINGLE_THREAD, side).map_or(f64::NAN, |single| single.time());
                match record.verdict {
                    Verdict::Invalid => "invalid".into(),
                    _ if label == SINGLE_THREAD => format!("{} ms", digits(record.time())),
                    _ => format!(
                        "{} ms, {} x",
                        digits(record.time()),
                        digits(single / record.time())
                    ),
                }
            });
            row.push(cell.unwrap_or_else(|| "-".into()));
        }
        rows.push(row);
    }
    (!records.is_empty()).then(|| Table {
        title: "The ladder: speed-up over one thread of the processor".into(),
        note: "34 substeps in a frame, self-contact by comparing all pairs on the lower rungs; published for 160 x 160 on a GTX 1660 Ti against a Ryzen 7 3750H.",
        heading,
        rows,
    })
}

fn failures(results: &Results) -> Option<Table> {
    let row = |failure: &crate::record::Failure| {
        vec![failure.backend.clone(), failure.case.clone(), failure.error.clone()]
    };
    Some(Table {
        title: "Errors".into(),
        note: "Cases that came to nothing.",
        heading: words(&["backend", "case", "error"]),
        rows: results.failures.iter().map(row).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let cases =
            [(0.0, "0"), (0.012345, "0.0123"), (1.0, "1.00"), (123.4, "123"), (98765.4, "98765")];
        for (value, expected) in cases {
            assert_eq!(digits(value), expected);
        }
        assert_eq!(digits(1.234e-7), "1.23e-7");
        assert_eq!(digits(f64::NAN), "NaN");
    }
}
