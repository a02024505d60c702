//! One line for every record.

use std::error::Error;

use crate::record::{Record, Results, Verdict};

const COLUMNS: [&str; 28] = [
    "group",
    "backend",
    "label",
    "columns",
    "rows",
    "particles",
    "precision",
    "threads",
    "iterations",
    "substeps",
    "frames_before",
    "frames_timed",
    "first_frame_ms",
    "frame_ms",
    "frame_lower_quartile_ms",
    "frame_upper_quartile_ms",
    "device_ms",
    "in_a_row_ms",
    "gigabytes_per_second",
    "memory_host_bytes_per_particle",
    "memory_device_bytes_per_particle",
    "strain_mean",
    "strain_max",
    "residual",
    "contacts",
    "difference",
    "verdict",
    "published",
];

pub(super) fn text(results: &Results) -> Result<String, Box<dyn Error>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS)?;
    for record in &results.records {
        writer.write_record(line(record))?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

fn line(record: &Record) -> [String; COLUMNS.len()] {
    let option = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
    let quality = &record.quality;
    [
        record.group.clone(),
        record.backend.clone(),
        record.label.clone(),
        record.columns.to_string(),
        record.rows.to_string(),
        record.particles().to_string(),
        record.precision.clone(),
        record.threads.map_or_else(String::new, |threads| threads.to_string()),
        record.iterations.map_or_else(String::new, |count| count.to_string()),
        record.substeps.to_string(),
        record.frames[0].to_string(),
        record.frames[1].to_string(),
        record.first_frame.to_string(),
        record.frame.median.to_string(),
        record.frame.lower.to_string(),
        record.frame.upper.to_string(),
        option(record.device.map(|device| device.median)),
        option(record.in_a_row),
        option(record.rate()),
        record.memory_host.to_string(),
        option(record.memory_device),
        quality.strain_mean.to_string(),
        quality.strain_max.to_string(),
        quality.residual.to_string(),
        quality.contacts.to_string(),
        quality.difference.to_string(),
        match &record.verdict {
            Verdict::Valid => "valid".into(),
            Verdict::Invalid => "invalid".into(),
            Verdict::Unchecked(reason) => format!("unchecked: {reason}"),
        },
        option(record.published),
    ]
}
