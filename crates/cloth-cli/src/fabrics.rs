//! `cloth fabrics`.

use std::io::{Write, stdout};

use cloth::{
    fabric::{Fabric, FitReport, TensileCurve},
    scene::{FabricSource, MeasuredFabric, fabric_sheet_read, measured_fabrics},
};
use serde::Serialize;

use crate::{arguments::FabricsArguments, failure::Failure, say::Shown};

/// A fabric with all that is said of it; all numbers in SI units.
#[derive(Serialize)]
struct FabricRow {
    name: String,
    also: Vec<String>,
    description: String,
    area_density: f64,
    thickness: f64,
    warp: CurveRow,
    weft: CurveRow,
    coupling: f64,
    shear: f64,
    /// Along warp, weft and at 45 degrees.
    bending: [f64; 3],
    friction_shear: f64,
    friction_bending: f64,
    fit: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    source: Option<SourceRow>,
}

#[derive(Serialize)]
struct CurveRow {
    linear: f64,
    cubic: f64,
    end: f64,
}

#[derive(Serialize)]
struct SourceRow {
    citation: String,
    url: String,
    read_from: String,
    conversion: String,
}

impl FabricRow {
    fn new(
        (name, also): (String, Vec<String>),
        description: String,
        (fabric, report): (Fabric, FitReport),
        source: Option<&FabricSource>,
    ) -> Self {
        let curve = |TensileCurve { linear, cubic, end }| CurveRow { linear, cubic, end };
        let half = 0.5_f64.sqrt();
        Self {
            name,
            also,
            description,
            area_density: fabric.area_density,
            thickness: fabric.thickness,
            warp: curve(fabric.warp),
            weft: curve(fabric.weft),
            coupling: fabric.coupling,
            shear: fabric.shear,
            bending: [
                fabric.bending.warp,
                fabric.bending.weft,
                fabric.bending.plate().strip([half; 2]),
            ],
            friction_shear: fabric.friction.shear,
            friction_bending: fabric.friction.bending,
            fit: report.to_string().lines().map(str::to_owned).collect(),
            source: source.map(|source| SourceRow {
                citation: source.citation.clone(),
                url: source.url.clone(),
                read_from: source.read_from.clone(),
                conversion: source.conversion.trim().to_owned(),
            }),
        }
    }

    fn measured(fabric: &MeasuredFabric) -> Result<Self, Failure> {
        let fit = fabric.fit().map_err(Failure::input)?;
        let description = fabric.description.clone();
        let names = (fabric.name.clone(), fabric.also.clone());
        Ok(Self::new(names, description, fit, Some(&fabric.source)))
    }

    /// What it is, and the words for it.
    fn said(&self) -> String {
        if self.also.is_empty() {
            return self.description.clone();
        }
        format!("{}; also `{}`", self.description, self.also.join("`, `"))
    }

    /// The number in the list, or a dash where it was not measured.
    fn measured_text(&self, what: &str, value: f64, digits: usize) -> String {
        let assumed = format!("assumed: {what}");
        if self.fit.iter().any(|line| line.starts_with(&assumed)) {
            return "-".to_owned();
        }
        format!("{value:.digits$}")
    }

    /// What can be compared: a name with its unit, and the number.
    fn numbers(&self) -> [(&'static str, f64); 14] {
        let micro = |value: f64| 1e6 * value;
        [
            ("mass per area [g/m^2]", 1e3 * self.area_density),
            ("thickness [mm]", 1e3 * self.thickness),
            ("warp: slope at rest [N/m]", self.warp.linear),
            ("warp: cubic term [N/m]", self.warp.cubic),
            ("warp: curve ends at E", self.warp.end),
            ("weft: slope at rest [N/m]", self.weft.linear),
            ("weft: cubic term [N/m]", self.weft.cubic),
            ("weft: curve ends at E", self.weft.end),
            ("biaxial coupling [N/m]", self.coupling),
            ("shear stiffness [N/m]", self.shear),
            ("bending, warp [uN m]", micro(self.bending[0])),
            ("bending, weft [uN m]", micro(self.bending[1])),
            ("bending, 45 degrees [uN m]", micro(self.bending[2])),
            ("friction in bending [mN]", 1e3 * self.friction_bending),
        ]
    }
}

pub(crate) fn fabrics(arguments: &FabricsArguments) -> Result<(), Failure> {
    // Sheets come from elsewhere.
    let mut out = Shown(stdout().lock());
    let mut rows = Vec::new();
    for name in &arguments.names {
        rows.push(FabricRow::measured(MeasuredFabric::find(name)?)?);
    }
    for file in &arguments.sheet {
        let sheet = fabric_sheet_read(file).map_err(Failure::input)?;
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let fit = sheet.fit(&name).map_err(Failure::input)?;
        let description = format!("laboratory sheet {}", file.display());
        rows.push(FabricRow::new((name, Vec::new()), description, fit, None));
    }
    let is_list = rows.is_empty();
    if is_list {
        rows = measured_fabrics().iter().map(FabricRow::measured).collect::<Result<_, _>>()?;
    }
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&rows).map_err(Failure::other)?)?;
    } else if is_list {
        list(&mut out, &rows)?;
    } else if let [row] = &rows[..] {
        detail(&mut out, row)?;
    } else {
        compare(&mut out, &rows)?;
    }
    Ok(())
}

fn list(out: &mut impl Write, rows: &[FabricRow]) -> Result<(), Failure> {
    writeln!(
        out,
        "{:<20} {:>7} {:>9} {:>9} {:>8} {:>11} {:>11}  description",
        "name", "g/m^2", "warp N/m", "weft N/m", "G N/m", "B warp uNm", "B weft uNm"
    )?;
    for row in rows {
        writeln!(
            out,
            "{:<20} {:>7.1} {:>9} {:>9} {:>8} {:>11.2} {:>11.2}  {}",
            row.name,
            1e3 * row.area_density,
            row.measured_text("slope of warp", row.warp.linear, 1),
            row.measured_text("slope of weft", row.weft.linear, 1),
            row.measured_text("shear", row.shear, 1),
            1e6 * row.bending[0],
            1e6 * row.bending[1],
            row.said()
        )?;
    }
    writeln!(
        out,
        "A dash is what was not measured: `cloth fabrics NAME` says what stands for it, and where the numbers come from."
    )?;
    Ok(())
}

fn detail(out: &mut impl Write, row: &FabricRow) -> Result<(), Failure> {
    writeln!(out, "{}: {}", row.name, row.said())?;
    for (name, value) in row.numbers() {
        writeln!(out, "  {name:<28} {}", number(value))?;
    }
    for line in &row.fit {
        writeln!(out, "  {line}")?;
    }
    if let Some(source) = &row.source {
        writeln!(out, "source: {}", source.citation)?;
        writeln!(out, "  {}", source.url)?;
        writeln!(out, "  read from {}", source.read_from)?;
        for line in source.conversion.lines() {
            writeln!(out, "  {line}")?;
        }
    }
    Ok(())
}

fn compare(out: &mut impl Write, rows: &[FabricRow]) -> Result<(), Failure> {
    let columns: Vec<_> = rows.iter().map(FabricRow::numbers).collect();
    write!(out, "{:<28}", "")?;
    for row in rows {
        write!(out, " {:>20}", row.name)?;
    }
    writeln!(out)?;
    for (line, (name, _)) in columns[0].into_iter().enumerate() {
        write!(out, "{name:<28}")?;
        for column in &columns {
            write!(out, " {:>20}", number(column[line].1))?;
        }
        writeln!(out)?;
    }
    for row in rows {
        for line in row.fit.iter().filter(|line| line.starts_with("assumed: ")) {
            writeln!(out, "{}: {line}", row.name)?;
        }
    }
    Ok(())
}

/// Four digits.
fn number(value: f64) -> String {
    let digits = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    if digits > 5 {
        return format!("{value:.3e}");
    }
    format!("{value:.*}", (3 - digits).clamp(0, 6) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        for (value, text) in [
            (0.0, "0.000"),
            (1234.4, "1234"),
            (0.012_341, "0.01234"),
            (-3.0, "-3.000"),
            (2e7, "2.000e7"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
