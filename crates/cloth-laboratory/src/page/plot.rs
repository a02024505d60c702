//! Plots as SVG.

use std::ops::Range;

use plotters::prelude::*;

use crate::{CurveStyle, Plot, outcome::number};

/// Size of a plot \[pixel\].
const SIZE: (u32, u32) = (760, 440);

/// A plot as SVG; none for one without points. Points that are no numbers, or not positive on a logarithmic axis, are left out.
pub(super) fn svg(plot: &Plot) -> Option<String> {
    let scaled = |point: &[f64; 2]| {
        let place: [f64; 2] = std::array::from_fn(|axis| {
            if plot.logarithmic[axis] { point[axis].log10() } else { point[axis] }
        });
        place.iter().all(|entry| entry.is_finite()).then_some((place[0], place[1]))
    };
    let curves: Vec<Vec<(f64, f64)>> =
        plot.curves.iter().map(|curve| curve.points.iter().filter_map(scaled).collect()).collect();
    let range = |of: fn(&(f64, f64)) -> f64| {
        let values = || curves.iter().flatten().map(of);
        let (low, high) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        let margin = 0.05 * (high - low).max(1e-9 * high.abs()).max(1e-30);
        (low <= high).then_some(low - margin..high + margin)
    };
    let (x, y) = (range(|point| point.0)?, range(|point| point.1)?);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        draw(plot, &curves, &area, x, y).ok()?;
        area.present().ok()?;
    }
    Some(text)
}

fn draw<'a>(
    plot: &Plot,
    curves: &[Vec<(f64, f64)>],
    area: &DrawingArea<SVGBackend<'a>, plotters::coord::Shift>,
    x: Range<f64>,
    y: Range<f64>,
) -> Result<(), Box<dyn std::error::Error + 'a>> {
    let mut chart = ChartBuilder::on(area)
        .caption(&plot.title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(70)
        .build_cartesian_2d(x, y)?;
    let label = |axis: usize| {
        let is_logarithmic = plot.logarithmic[axis];
        move |place: &f64| number(if is_logarithmic { 10_f64.powf(*place) } else { clean(*place) })
    };
    chart
        .configure_mesh()
        .x_desc(&plot.axes[0])
        .y_desc(&plot.axes[1])
        .x_label_formatter(&label(0))
        .y_label_formatter(&label(1))
        .light_line_style(TRANSPARENT)
        .draw()?;
    for (index, (curve, points)) in plot.curves.iter().zip(curves).enumerate() {
        let colour = Palette99::pick(index).to_rgba();
        let points = points.iter().copied();
        match curve.style {
            CurveStyle::Line => {
                let series = LineSeries::new(points, colour.stroke_width(2));
                let line = move |(x, y)| PathElement::new(vec![(x, y), (x + 16, y)], colour);
                chart.draw_series(series)?.label(&curve.name).legend(line);
            }
            CurveStyle::Marks => {
                let size = 3 + index as u32 % 3;
                let mark = move |point| Circle::new(point, size, colour.stroke_width(1));
                let legend = move |(x, y)| Circle::new((x + 8, y), size, colour.stroke_width(1));
                chart.draw_series(points.map(mark))?.label(&curve.name).legend(legend);
            }
        }
    }
    if plot.curves.len() > 1 {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .border_style(BLACK.mix(0.3))
            .background_style(WHITE.mix(0.85))
            .draw()?;
    }
    Ok(())
}

/// The number without the dust of rounding that the marks of an axis have.
fn clean(value: f64) -> f64 {
    if value.abs() < 1e-12 { 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Curve;

    #[test]
    fn a_plot_is_drawn_and_one_without_numbers_is_not() {
        let mut plot = Plot {
            title: "a".into(),
            logarithmic: [true, false],
            curves: vec![Curve { points: vec![[1.0, 2.0], [10.0, f64::NAN]], ..Curve::default() }],
            ..Plot::default()
        };
        assert!(svg(&plot).unwrap().contains("<circle"));
        plot.curves[0].points = vec![[0.0, 1.0]];
        assert!(svg(&plot).is_none());
    }
}
