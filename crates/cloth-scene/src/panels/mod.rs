//! Pieces of a flat pattern: from outlines in SVG and DXF files to triangles.

mod dxf;
mod folded;
mod mesh;
mod outline;
mod svg;

use std::path::Path;

pub(crate) use folded::folded;
pub(crate) use mesh::piece_mesh;
pub(crate) use outline::Outline;

/// Largest file that is read \[byte\].
const FILE_MAX: u64 = 64 << 20;

/// A pattern file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PatternProblem {
    #[error("pattern file `{file}` cannot be read ({source}); check the path and the permissions")]
    Read { file: String, source: std::io::Error },
    #[error("pattern file `{file}` has an unknown extension; use one of: svg, dxf")]
    Extension { file: String },
    #[error("pattern file `{file}`, line {line}: {problem}")]
    Syntax { file: String, line: usize, problem: String },
    #[error("pattern file `{file}` {problem}")]
    Units { file: String, problem: String },
}

/// All outlines in the file at `path`, in metres, x to the right and y up; `unit` is the length \[m\] of a unit of its numbers, if it is given.
pub(crate) fn outlines_read(
    path: &Path,
    unit: Option<f64>,
) -> Result<Vec<Outline>, PatternProblem> {
    let file = path.display().to_string();
    let bytes = cloth_io::file_read(path, FILE_MAX)
        .map_err(|source| PatternProblem::Read { file: file.clone(), source })?;
    let text = String::from_utf8_lossy(&bytes);
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let outlines = match extension.to_lowercase().as_str() {
        "svg" => svg::read(&file, &text, unit)?,
        "dxf" => dxf::read(&file, &text, unit)?,
        _ => return Err(PatternProblem::Extension { file }),
    };
    for outline in &outlines {
        outline.check().map_err(|problem| PatternProblem::Syntax {
            file: file.clone(),
            line: outline.line,
            problem,
        })?;
    }
    Ok(outlines)
}
