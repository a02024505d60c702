//! A laboratory sheet as a file in TOML, with the names and units of the instruments.

use std::{
    fs,
    path::{Component, Path},
};

use cloth_core::fabric::{
    BendingSheet, FabricSheet, TensileSample, TensileSheet,
    units::{GF_CM_PER_CM, GF_CM_PER_CM2, GF_CM2_PER_CM, GF_PER_CM, GF_PER_CM_DEGREE, MG_PER_CM2},
};
use serde::Deserialize;

/// Largest sheet and curve that is read \[byte\].
const SIZE_LIMIT: u64 = 1 << 20;

/// A sheet that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("laboratory sheet `{file}`: {problem}")]
pub struct SheetError {
    file: String,
    problem: String,
}

/// What a sheet can say: Kawabata's names and units, overhangs of ASTM D1388, tensile curves in files of their own.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the names are those on a sheet")]
pub(super) struct SheetFile {
    /// Weight \[mg/cm^2\].
    W: f64,
    /// Thickness \[mm\].
    T: Option<f64>,
    /// Shear stiffness \[gf/(cm degree)\].
    G: Option<f64>,
    /// Hysteresis in shear \[gf/cm\].
    #[serde(rename = "2HG")]
    hg: Option<f64>,
    /// Bending rigidity \[gf cm^2/cm\], mean of warp and weft.
    B: Option<f64>,
    /// Hysteresis in bending \[gf cm/cm\], mean of warp and weft.
    #[serde(rename = "2HB")]
    hb: Option<f64>,
    /// Biaxial coupling \[N/m\].
    coupling: Option<f64>,
    #[serde(default)]
    warp: Thread,
    #[serde(default)]
    weft: Thread,
    #[serde(default)]
    bias: Bias,
}

/// One direction of the cloth.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the names are those on a sheet")]
struct Thread {
    /// Linearity.
    LT: Option<f64>,
    /// Tensile work \[gf cm/cm^2\].
    WT: Option<f64>,
    /// Strain at 500 gf/cm \[%\].
    EMT: Option<f64>,
    /// Tensile resilience \[%\]; the law has no friction in tension.
    RT: Option<f64>,
    /// Bending rigidity \[gf cm^2/cm\].
    B: Option<f64>,
    /// Hysteresis in bending \[gf cm/cm\].
    #[serde(rename = "2HB")]
    hb: Option<f64>,
    /// Overhang \[mm\], ASTM D1388 option A.
    overhang: Option<f64>,
    /// File of a tensile curve: strain, force per width \[N/m\].
    curve: Option<String>,
}

/// 45 degrees to both.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the names are those on a sheet")]
struct Bias {
    B: Option<f64>,
    overhang: Option<f64>,
}

/// Reads a laboratory sheet. Files of curves are looked for beside it.
///
/// # Errors
/// A file that cannot be read, that is too large, or does not follow the format, with the line.
pub fn fabric_sheet_read(file: &Path) -> Result<FabricSheet, SheetError> {
    let error = |problem: String| SheetError { file: file.display().to_string(), problem };
    let text = read(file).map_err(error)?;
    let sheet: SheetFile = toml::from_str(&text).map_err(|e| {
        let start = e.span().map_or(0, |span| span.start);
        let line = 1 + text.bytes().take(start).filter(|&byte| byte == b'\n').count();
        error(format!("line {line}: {}; correct the text there", e.message().replace('\n', " ")))
    })?;
    let folder = file.parent().unwrap_or(Path::new(""));
    let beside = |name: &str| {
        // A sheet that comes from elsewhere reads nothing but what came with it.
        let is_plain =
            Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        if !is_plain {
            return Err(format!(
                "the curve `{name}` is not a plain path below the folder of the sheet; keep it there"
            ));
        }
        curve(&folder.join(name))
    };
    sheet.sheet(beside).map_err(error)
}

fn read(file: &Path) -> Result<String, String> {
    let shown = file.display();
    let size =
        fs::metadata(file).map_err(|e| format!("cannot read `{shown}` ({e}); check the path"))?;
    if size.len() > SIZE_LIMIT {
        return Err(format!(
            "`{shown}` is larger than {SIZE_LIMIT} bytes; give the measured points alone"
        ));
    }
    fs::read_to_string(file)
        .map_err(|e| format!("cannot read `{shown}` ({e}); check that it is text"))
}

/// Points of a curve in CSV: strain and force per width \[N/m\]; lines that start with `#` and one line of names are left out.
fn curve(file: &Path) -> Result<Vec<TensileSample>, String> {
    let shown = file.display();
    let text = read(file)?;
    let mut samples = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let mut fields = line.split([',', ';', '\t']).map(|field| field.trim().parse::<f64>());
        match (fields.next(), fields.next(), fields.next()) {
            (Some(Ok(strain)), Some(Ok(force)), None) => {
                samples.push(TensileSample { strain, force });
            }
            _ if samples.is_empty() && line.starts_with(|c: char| c.is_alphabetic()) => {}
            _ => {
                return Err(format!(
                    "`{shown}`, line {}: `{line}` is no strain with a force per width in N/m; write them as 0.01, 25.0",
                    number + 1
                ));
            }
        }
    }
    Ok(samples)
}

impl SheetFile {
    /// The sheet in SI units; `curve` reads the file of a tensile curve.
    pub(super) fn sheet(
        &self,
        curve: impl Fn(&str) -> Result<Vec<TensileSample>, String>,
    ) -> Result<FabricSheet, String> {
        let bending = |own: Option<f64>, overhang: Option<f64>, shared: Option<f64>| match overhang
        {
            Some(length) => Some(BendingSheet::Overhang(1e-3 * length)),
            None => own.or(shared).map(|b| BendingSheet::Rigidity(b * GF_CM2_PER_CM)),
        };
        let tensile = |thread: &Thread, name: &str| -> Result<Option<TensileSheet>, String> {
            if thread.RT.is_some_and(|rt| !(0.0..=100.0).contains(&rt)) {
                return Err(format!("RT of the {name} is not between 0 and 100 %: correct it"));
            }
            match (&thread.curve, thread.LT) {
                (Some(_), Some(_)) => {
                    Err(format!("the {name} has LT and a curve: leave one of them out"))
                }
                (Some(file), None) => Ok(Some(TensileSheet::Curve(curve(file)?))),
                (None, Some(linearity)) => Ok(Some(TensileSheet::Kawabata {
                    linearity,
                    work: thread.WT.map(|wt| wt * GF_CM_PER_CM2),
                    extension: thread.EMT.map(|emt| 1e-2 * emt),
                })),
                (None, None) if thread.WT.is_some() || thread.EMT.is_some() => {
                    Err(format!("the {name} has WT or EMT without LT: give LT"))
                }
                (None, None) => Ok(None),
            }
        };
        let hysteresis = |thread: &Thread| thread.hb.or(self.hb).map(|hb| hb * GF_CM_PER_CM);
        Ok(FabricSheet {
            area_density: self.W * MG_PER_CM2,
            thickness: self.T.map(|t| 1e-3 * t),
            tensile: [tensile(&self.warp, "warp")?, tensile(&self.weft, "weft")?],
            coupling: self.coupling,
            shear: self.G.map(|g| g * GF_PER_CM_DEGREE),
            shear_hysteresis: self.hg.map(|hg| hg * GF_PER_CM),
            bending: [
                bending(self.warp.B, self.warp.overhang, self.B),
                bending(self.weft.B, self.weft.overhang, self.B),
                bending(self.bias.B, self.bias.overhang, None),
            ],
            bending_hysteresis: [hysteresis(&self.warp), hysteresis(&self.weft)],
        })
    }
}
