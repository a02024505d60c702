//! Plots as SVG, to stand in the page.

use plotters::{
    coord::ranged1d::AsRangedCoord,
    prelude::*,
    style::full_palette::{
        AMBER_700, BLUE_700, BROWN_500, CYAN_700, GREEN_700, GREY_700, INDIGO_900, LIME_800,
        ORANGE_900, PINK_400, PURPLE_600, RED_700,
    },
};

/// Width and height of a plot in pixels, its legend included.
const SIZE: (u32, u32) = (860, 440);
/// Width of the legend in pixels.
const LEGEND: u32 = 250;
const FONT: &str = "sans-serif";
const COLOURS: [RGBColor; 12] = [
    BLUE_700, RED_700, GREEN_700, PURPLE_600, AMBER_700, CYAN_700, GREY_700, PINK_400, BROWN_500,
    LIME_800, INDIGO_900, ORANGE_900,
];

/// Points that belong together.
pub(super) struct Series {
    pub(super) name: String,
    pub(super) points: Vec<(f64, f64)>,
}

/// What the axes say.
pub(super) struct Labels<'a> {
    pub(super) title: &'a str,
    pub(super) x: &'a str,
    pub(super) y: &'a str,
}

/// What a drawing routine reports.
type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Lines with points, both axes logarithmic. Numbers that have no logarithm are left out.
pub(super) fn lines(
    labels: &Labels<'_>,
    series: &[Series],
) -> Result<String, Box<dyn std::error::Error>> {
    let series: Vec<Series> = series
        .iter()
        .map(|line| Series {
            name: line.name.clone(),
            points: line.points.iter().copied().filter(|(x, y)| *x > 0.0 && *y > 0.0).collect(),
        })
        .filter(|line| !line.points.is_empty())
        .collect();
    let all = || series.iter().flat_map(|line| &line.points);
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let [low, high] =
            values.fold([f64::INFINITY, 0.0_f64], |[low, high], v| [low.min(v), high.max(v)]);
        let decade = |value: f64, up: f64| {
            10.0_f64.powf((value.log10() + 0.05 * (2.0 * up - 1.0)).floor() + up)
        };
        (decade(low, 0.0)..decade(high, 1.0)).log_scale()
    };
    if series.is_empty() {
        return Ok(String::new());
    }
    let x = range(&mut all().map(|point| point.0));
    let y = range(&mut all().map(|point| point.1));
    let mut svg = String::new();
    draw(&mut svg, labels, x, y, &series)?;
    Ok(svg)
}

fn draw<X, Y>(svg: &mut String, labels: &Labels<'_>, x: X, y: Y, series: &[Series]) -> Outcome
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: plotters::coord::ranged1d::ValueFormatter<f64>,
    Y::CoordDescType: plotters::coord::ranged1d::ValueFormatter<f64>,
{
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let (plot, legend) = area.split_horizontally(SIZE.0 - LEGEND);
    let mut chart = ChartBuilder::on(&plot)
        .caption(labels.title, (FONT, 18))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(x, y)?;
    let number = |value: &f64| super::tables::digits(*value);
    chart
        .configure_mesh()
        .x_desc(labels.x)
        .y_desc(labels.y)
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .light_line_style(BLACK.mix(0.04))
        .bold_line_style(BLACK.mix(0.12))
        .draw()?;
    for (number, line) in series.iter().enumerate() {
        let colour = COLOURS[number % COLOURS.len()];
        let points = line.points.iter().copied();
        chart.draw_series(LineSeries::new(points, colour.stroke_width(2)).point_size(3))?;
        let y = 60 + 20 * number as i32;
        legend.draw(&Rectangle::new([(0, y - 2), (16, y)], colour.filled()))?;
        legend.draw(&Text::new(line.name.clone(), (22, y - 7), (FONT, 13)))?;
    }
    area.present()?;
    Ok(())
}

/// For each name, the shares that parts have of a whole, as a bar.
pub(super) fn shares(
    title: &str,
    bars: &[(String, Vec<(String, f64)>)],
) -> Result<String, Box<dyn std::error::Error>> {
    let mut svg = String::new();
    let mut names: Vec<&str> = Vec::new();
    for (_, parts) in bars {
        for (name, _) in parts {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
    }
    {
        let area = SVGBackend::with_string(
            &mut svg,
            (SIZE.0, 110 + 44 * bars.len() as u32 + 16 * names.len() as u32),
        )
        .into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(title, (FONT, 18))
            .margin(12)
            .build_cartesian_2d(0.0..1.5, 0.0..bars.len() as f64)?;
        for (row, (bar, parts)) in bars.iter().enumerate() {
            let (low, high) = (row as f64 + 0.15, row as f64 + 0.75);
            let total: f64 = parts.iter().map(|part| part.1).sum();
            let mut start = 0.0;
            for (name, time) in parts {
                let end = start + time / total.max(f64::MIN_POSITIVE);
                let place = names.iter().position(|other| other == name).unwrap_or(0);
                let colour = shade(place);
                chart
                    .draw_series([Rectangle::new([(start, low), (end, high)], colour.filled())])?;
                start = end;
            }
            let label = format!("{bar}: {} ms", super::tables::digits(total));
            chart.draw_series([Text::new(label, (0.0, high + 0.16), (FONT, 13))])?;
        }
        let (_, height) = area.dim_in_pixel();
        for (number, name) in names.iter().enumerate() {
            let y = height as i32 - 20 - 16 * (names.len() - 1 - number) as i32;
            area.draw(&Rectangle::new(
                [(SIZE.0 as i32 - 220, y - 5), (SIZE.0 as i32 - 206, y + 5)],
                shade(number).filled(),
            ))?;
            area.draw(&Text::new((*name).to_owned(), (SIZE.0 as i32 - 200, y - 6), (FONT, 12)))?;
        }
        area.present()?;
    }
    Ok(svg)
}

/// A colour for each of many parts: those of lines first, then lighter ones.
fn shade(number: usize) -> RGBAColor {
    COLOURS[number % COLOURS.len()].mix(1.0 / (1 + number / COLOURS.len()) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LABELS: Labels<'static> = Labels { title: "title", x: "particles", y: "ms" };

    #[test]
    fn a_line_is_drawn_without_the_points_that_have_no_logarithm() {
        let points = vec![(10.0, 1.0), (100.0, 0.0), (1000.0, f64::NAN), (1e4, 20.0)];
        let svg = lines(&LABELS, &[Series { name: "cpu".into(), points }]).unwrap();
        assert!(svg.contains("<svg") && svg.contains("cpu"));
        assert_eq!(svg.matches("<circle").count(), 2, "{svg}");
    }

    #[test]
    fn nothing_to_draw_is_no_picture() {
        assert_eq!(lines(&LABELS, &[]).unwrap(), "");
    }
}
