//! The tables on the terminal.

use comfy_table::{Table, presets::NOTHING};

use super::tables;
use crate::record::Results;

pub(crate) fn print(results: &Results) {
    println!("{}", heading(results));
    for table in tables::tables(results) {
        println!("\n{}\n{}", table.title, table.note);
        let mut text = Table::new();
        text.load_preset(NOTHING).set_header(table.heading).add_rows(table.rows);
        println!("{}", text.trim_fmt());
    }
}

/// Where and when.
pub(super) fn heading(results: &Results) -> String {
    let machine = &results.machine;
    format!(
        "{}, {} threads, {:.0} GB, {}; {}, revision {}, suite {}",
        machine.processor,
        machine.threads,
        machine.memory_gigabytes,
        machine.system,
        results.date,
        results.revision,
        results.suite
    )
}
