//! Outlines in SVG: paths, polygons and rectangles with an `id`.

use kurbo::{Affine, BezPath, PathEl, PathSeg};

use super::{Outline, PatternProblem, outline::InnerLine};

/// Metres of the units of lengths.
const UNITS: [(&str, f64); 6] = [
    ("mm", 1e-3),
    ("cm", 1e-2),
    ("in", 0.0254),
    ("pt", 0.0254 / 72.0),
    ("pc", 0.0254 / 6.0),
    ("px", 0.0254 / 96.0),
];

/// Attributes: `id` names a piece, `data-edges` its edges in order; with `data-piece` it names a line in that piece, as `data-line` does, which lines can share.
pub(super) fn read(
    file: &str,
    text: &str,
    unit: Option<f64>,
) -> Result<Vec<Outline>, PatternProblem> {
    let syntax = |line: usize, problem: String| PatternProblem::Syntax {
        file: file.to_owned(),
        line,
        problem,
    };
    let document = roxmltree::Document::parse(text)
        .map_err(|error| syntax(error.pos().row as usize, error.to_string()))?;
    let root = document.root_element();
    let unit = match unit {
        Some(unit) => unit,
        None => unit_of(&root).ok_or_else(|| PatternProblem::Units {
            file: file.to_owned(),
            problem: "does not say how long its units are: give `unit` in metres, or `width` in mm and a `viewBox` in the file".into(),
        })?,
    };
    let to_metres = Affine::scale_non_uniform(unit, -unit);
    let mut outlines: Vec<Outline> = Vec::new();
    let mut lines = Vec::new();
    for node in root.descendants().filter(roxmltree::Node::is_element) {
        let piece = node.attribute("data-piece");
        let called = piece.and_then(|_| node.attribute("data-line"));
        let Some(name) = called.or_else(|| node.attribute("id")) else { continue };
        let line = document.text_pos_at(node.range().start).row as usize;
        let what = if piece.is_some() { "line" } else { "piece" };
        let bad = |problem: String| syntax(line, format!("{what} {name:?} {problem}"));
        let Some(path) = path_of(&node).map_err(bad)? else { continue };
        if node.ancestors().any(|node| node.attribute("transform").is_some()) {
            let problem =
                "has a `transform`, or is in a group with one: apply it in the drawing program";
            return Err(bad(problem.into()));
        }
        let moves = path.elements().iter().filter(|e| matches!(e, PathEl::MoveTo(_))).count();
        if moves != 1 {
            let problem = format!(
                "has {moves} outlines: give each piece one, and a piece of its own to what is cut out of none"
            );
            return Err(bad(problem));
        }
        let is_closed = matches!(path.elements().last(), Some(PathEl::ClosePath));
        let segments = (to_metres * path).segments().collect::<Vec<PathSeg>>();
        if let Some(piece) = piece {
            if is_closed {
                return Err(bad("is a line in a piece, and closed: leave it open".into()));
            }
            lines.push((line, piece, InnerLine { name: name.to_owned(), parts: segments }));
            continue;
        }
        let names = node.attribute("data-edges").unwrap_or_default();
        outlines.push(Outline {
            name: name.to_owned(),
            line,
            edges: segments,
            names: names.split_whitespace().map(str::to_owned).collect(),
            is_closed,
            lines: Vec::new(),
        });
    }
    for (line, piece, inner) in lines {
        let Some(outline) = outlines.iter_mut().find(|outline| outline.name == piece) else {
            let problem = format!(
                "line {:?} is in the piece {piece:?}, which there is not: give `data-piece` the `id` of one",
                inner.name
            );
            return Err(syntax(line, problem));
        };
        outline.lines.push(inner);
    }
    Ok(outlines)
}

/// Length of a unit \[m\], if the size of the drawing tells.
fn unit_of(root: &roxmltree::Node<'_, '_>) -> Option<f64> {
    let width = root.attribute("width")?;
    let (number, metres) = UNITS.iter().find_map(|(name, metres)| {
        Some((width.strip_suffix(name)?.trim().parse::<f64>().ok()?, *metres))
    })?;
    let view: Vec<f64> =
        root.attribute("viewBox")?.split([' ', ',']).filter_map(|word| word.parse().ok()).collect();
    let unit = number * metres / view.get(2)?;
    (unit > 0.0 && unit.is_finite()).then_some(unit)
}

/// The path of an element, if it is a shape.
fn path_of(node: &roxmltree::Node<'_, '_>) -> Result<Option<BezPath>, String> {
    let number = |name: &str| -> Result<f64, String> {
        let text = node.attribute(name).unwrap_or("0");
        text.parse().map_err(|_| format!("has `{name}` {text:?}, which is no number"))
    };
    let text = match node.tag_name().name() {
        "path" => node.attribute("d").unwrap_or_default().to_owned(),
        "polygon" => format!("M{}Z", node.attribute("points").unwrap_or_default()),
        "polyline" => format!("M{}", node.attribute("points").unwrap_or_default()),
        "line" => {
            let [x, y, to_x, to_y] = [number("x1")?, number("y1")?, number("x2")?, number("y2")?];
            format!("M{x},{y}L{to_x},{to_y}")
        }
        "rect" => {
            let [x, y] = [number("x")?, number("y")?];
            let [width, height] = [number("width")?, number("height")?];
            format!("M{x},{y}h{width}v{height}h{}Z", -width)
        }
        _ => return Ok(None),
    };
    BezPath::from_svg(&text).map(Some).map_err(|error| format!("has a path that is none: {error}"))
}
