//! The table of 2025: a CUDA cloth made faster rung by rung, as speed-up over one thread of the processor.

use cloth::cuda::CudaOptions;
use cloth_benches::ladder::{LADDER_PUBLISHED, LADDER_SIDES, Ladder, LadderRow, ladder_row};

use super::group;
use crate::record::{Quality, Record, Statistics, Verdict};

/// Sides without a GPU, where the single thread alone remains.
const SIDES_ALONE: usize = 5;
/// Substeps in a frame.
const SUBSTEPS: u32 = 34;
/// What the rows of the single thread are called.
pub(crate) const SINGLE_THREAD: &str = "single thread";

/// Measures the table, row by row, and hands on what it finds.
///
/// # Errors
/// What the device reports.
pub(crate) fn measure(
    has_gpu: bool,
    mut found: impl FnMut(Vec<Record>),
) -> Result<(), cloth::Error> {
    let ladder = if has_gpu { Some(Ladder::new(CudaOptions::default())?) } else { None };
    let sides = if has_gpu { &LADDER_SIDES[..] } else { &LADDER_SIDES[..SIDES_ALONE] };
    for &side in sides {
        found(records(&ladder_row(ladder.as_ref(), side)?));
    }
    Ok(())
}

fn records(row: &LadderRow) -> Vec<Record> {
    let single = [row.single_thread; 3];
    let unchecked = Verdict::Unchecked("it is what the others are compared with".into());
    let mut records = vec![record(row.side, ("cpu", SINGLE_THREAD), single, (0.0, unchecked))];
    for time in &row.rungs {
        let verdict = if time.is_valid { Verdict::Valid } else { Verdict::Invalid };
        let mut record =
            record(row.side, ("cuda", time.rung.name()), time.seconds, (time.deviation, verdict));
        let published =
            LADDER_PUBLISHED.iter().find(|(rung, _)| *rung == time.rung && row.side == 160);
        record.published = published.map(|(_, speed_up)| *speed_up);
        records.push(record);
    }
    records
}

/// Times in seconds: first quartile, median, third quartile.
fn record(
    side: u32,
    (backend, label): (&str, &str),
    [lower, median, upper]: [f64; 3],
    (difference, verdict): (f64, Verdict),
) -> Record {
    let frame = Statistics { lower: lower * 1e3, median: median * 1e3, upper: upper * 1e3 };
    Record {
        group: group::TABLE_LADDER.into(),
        backend: backend.into(),
        label: label.into(),
        columns: side,
        rows: side,
        precision: "f32".into(),
        threads: (backend == "cpu").then_some(1),
        iterations: None,
        substeps: SUBSTEPS,
        frames: [5, 30],
        first_frame: 0.0,
        frame,
        device: None,
        in_a_row: None,
        bytes: None,
        memory_host: 0.0,
        memory_device: None,
        stages: Vec::new(),
        quality: Quality { difference: difference / 0.02, ..Quality::default() },
        verdict,
        published: None,
    }
}
