//! The table of the historical ladder: speed-up of each rung over one thread of the processor.

use cloth::{Result, State};

use super::{Ladder, Rung, model, single_thread};
use crate::quartiles;

/// Sides of the patches of the table.
pub const LADDER_SIDES: [u32; 7] = [5, 10, 20, 40, 80, 120, 160];

/// Frames of a thirtieth of a second before those that are measured, and those: the window of the common workload.
const FRAMES: [usize; 2] = [5, 30];

/// Particles along a side up to which several frames of the single thread are timed, and how many.
const SINGLE_FRAMES: (u32, usize) = (40, 5);

/// How far a rung may be from the single thread after a frame, for its time to count \[m\].
const DEVIATION_MAX: f64 = 1e-5;

/// Speed-ups that were published for 160 x 160 particles: a GTX 1660 Ti against one thread of a Ryzen 7 3750H, 2025. The last of
/// them took 5 ms a frame on an RTX 4070.
pub const LADDER_PUBLISHED: [(Rung, f64); 6] = [
    (Rung::Naive, 108.51),
    (Rung::Constants, 110.88),
    (Rung::Math, 154.90),
    (Rung::Swap, 154.68),
    (Rung::Bins, 156.70),
    (Rung::Neighbours, 1635.58),
];

/// One size of the patch.
#[derive(Clone, Debug)]
pub struct LadderRow {
    /// Particles along a side.
    pub side: u32,
    /// Time of a frame of 34 substeps on one thread of the processor, a median \[s\].
    pub single_thread: f64,
    /// The rungs, from the lowest; none without a GPU.
    pub rungs: Vec<LadderTime>,
}

/// One rung.
#[derive(Clone, Copy, Debug)]
pub struct LadderTime {
    /// Which.
    pub rung: Rung,
    /// Time of a frame on the device: first quartile, median, third \[s\].
    pub seconds: [f64; 3],
    /// Single thread over this.
    pub speed_up: f64,
    /// Largest difference of a coordinate from the single thread after one frame \[m\].
    pub deviation: f64,
    /// Whether that is rounding: only then the time says anything.
    pub is_valid: bool,
}

fn deviation(a: &State, b: &State) -> f64 {
    let both = a.positions.iter().zip(&b.positions);
    let components = both.flat_map(|(a, b)| (0..3).map(move |axis| (a[axis] - b[axis]).abs()));
    components.fold(0.0, |most, component| if component <= most { most } else { component })
}

/// Measures one size on the processor, and on a GPU if there is one.
///
/// # Errors
/// What the device reports.
pub fn ladder_row(ladder: Option<&Ladder>, side: u32) -> Result<LadderRow> {
    let start = model(side)?.initial_state();
    let mut reference = single_thread(side, &start, 1)?;
    let [_, single_thread, _] = if side <= SINGLE_FRAMES.0 {
        quartiles(&mut single_thread(side, &start, SINGLE_FRAMES.1)?.frame_seconds)
    } else {
        quartiles(&mut reference.frame_seconds)
    };
    let mut rungs = Vec::new();
    for (ladder, rung) in ladder.into_iter().flat_map(|ladder| Rung::ALL.map(|rung| (ladder, rung)))
    {
        let deviation = deviation(&ladder.run(rung, side, 1)?.state, &reference.state);
        let mut run = ladder.run(rung, side, FRAMES[0] + FRAMES[1])?;
        let seconds = quartiles(&mut run.frame_seconds[FRAMES[0]..]);
        rungs.push(LadderTime {
            rung,
            seconds,
            speed_up: single_thread / seconds[1],
            deviation,
            is_valid: deviation <= DEVIATION_MAX,
        });
    }
    Ok(LadderRow { side, single_thread, rungs })
}

/// The heading above [`ladder_line`]s: names of the rungs, and what was published.
#[must_use]
pub fn ladder_heading() -> String {
    let mut names = format!("{:<6} {:>16}", "side", "one thread ms");
    let mut published = format!("{:<6} {:>16}", "(2025)", "");
    for rung in Rung::ALL {
        names += &format!(" {:>20}", rung.name());
        let known = LADDER_PUBLISHED.iter().find(|(known, _)| *known == rung);
        let known = known.map_or_else(String::new, |(_, speed_up)| format!("{speed_up} x at 160"));
        published += &format!(" {known:>20}");
    }
    format!("{names}\n{published}")
}

/// A row of the table: milliseconds of a frame, and speed-up over one thread.
#[must_use]
pub fn ladder_line(row: &LadderRow) -> String {
    let mut line = format!("{:<6} {:>16.3}", row.side, row.single_thread * 1e3);
    for time in &row.rungs {
        let cell = if time.is_valid {
            format!("{:.4} ms {:.1} x", time.seconds[1] * 1e3, time.speed_up)
        } else {
            format!("invalid: {:.1e} m", time.deviation)
        };
        line += &format!(" {cell:>20}");
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_needs_no_gpu() {
        let row = ladder_row(None, 5).unwrap();
        assert!(row.single_thread > 0.0 && row.rungs.is_empty());
        assert_eq!(ladder_line(&row).split_whitespace().count(), 2);
        assert!(ladder_heading().contains("1635.58 x at 160"));
        assert_eq!(quartiles(&mut [4.0, 1.0, 2.0, 3.0, 5.0]), [2.0, 3.0, 4.0]);
    }
}
