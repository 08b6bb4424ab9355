//! The plots, as inline SVG without colors of their own for ink and grid: the style sheet maps black and [`GRID`] to
//! the page's colors.

#[cfg(feature = "design")]
mod fine;

#[cfg(feature = "design")]
pub(super) use fine::{Area, Shapes, fine, round_numbers};

use catoptric_assess::palette::facet_color;
use catoptric_assess::score::percentile;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::ops::Range;

/// Color of lines behind the data; the style sheet maps it to the page's grid color.
pub(super) const GRID: RGBColor = RGBColor(0xC8, 0xC8, 0xC8);

const FONT: &str = "sans-serif";
const LABEL_SIZE: i32 = 13;
/// Space for axis labels, in pixels; the same on both axes so that square figures stay square.
const AXIS_ROOM: u32 = 52;
const MARGIN: u32 = 10;

type Sheet<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Failure = Box<dyn std::error::Error>;

/// Returns the color of the facet of a given number.
pub(crate) fn color(facet: usize) -> RGBColor {
    let [red, green, blue] = facet_color(facet);
    RGBColor(red, green, blue)
}

/// Formats a color for style sheets.
pub(super) fn css(color: RGBColor) -> String {
    format!("#{:02X}{:02X}{:02X}", color.0, color.1, color.2)
}

/// A line through points.
pub(super) struct Stroke {
    pub(super) points: Vec<(f64, f64)>,
    pub(super) color: RGBColor,
    pub(super) width: u32,
    pub(super) opacity: f64,
}

/// A text next to the data.
pub(super) struct Label {
    pub(super) at: (f64, f64),
    pub(super) text: String,
    pub(super) color: RGBColor,
}

/// Limits and labels of the axes of a plot.
pub(super) struct Axes {
    pub(super) x: Range<f64>,
    pub(super) y: Range<f64>,
    pub(super) x_label: String,
    pub(super) y_label: String,
}

/// A value at an azimuth, with its uncertainty band.
#[derive(Debug, Clone)]
pub(super) struct Dot {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) half_band: f64,
    pub(super) color: RGBColor,
}

/// A measured value with its uncertainty.
pub(super) struct Mark {
    pub(super) x: f64,
    pub(super) y: f64,
    /// Half the length of its bar; 0 for none.
    pub(super) half_bar: f64,
    pub(super) color: RGBColor,
    /// Drawn as a ring: a value from the literature.
    pub(super) hollow: bool,
}

/// A bar of a strip: from one azimuth to another, in one row.
pub(super) struct Bar {
    pub(super) x: Range<f64>,
    pub(super) row: usize,
    pub(super) color: RGBColor,
}

/// Plots lines and labels in a plane, to scale if both axes have the same length.
pub(super) fn plan(
    size: (u32, u32),
    axes: &Axes,
    title: &str,
    strokes: &[Stroke],
    labels: &[Label],
) -> String {
    draw(size, title, |area| {
        let mut chart = frame(area, axes, true)?;
        draw_strokes(&mut chart, strokes)?;
        for label in labels {
            let style = (FONT, LABEL_SIZE).into_font().color(&label.color);
            let anchor = plotters::style::text_anchor::Pos::new(
                plotters::style::text_anchor::HPos::Center,
                plotters::style::text_anchor::VPos::Center,
            );
            chart.draw_series([Text::new(label.text.clone(), label.at, style.pos(anchor))])?;
        }
        Ok(())
    })
}

/// Plots the points of a cloud, and lines around them.
pub(super) fn scatter(
    size: (u32, u32),
    axes: &Axes,
    title: &str,
    points: &[(f64, f64, RGBColor)],
    strokes: &[Stroke],
) -> String {
    draw(size, title, |area| {
        let mut chart = frame(area, axes, true)?;
        draw_strokes(&mut chart, strokes)?;
        let dots = points.iter().map(|&(x, y, c)| Circle::new((x, y), 1, c.filled()));
        chart.draw_series(dots)?;
        Ok(())
    })
}

/// Plots measured values, and curves through them.
pub(super) fn laws(size: (u32, u32), axes: &Axes, title: &str, marks: &[Mark], strokes: &[Stroke]) -> String {
    draw(size, title, |area| {
        let mut chart = frame(area, axes, true)?;
        draw_strokes(&mut chart, strokes)?;
        let bars = marks.iter().filter(|m| m.half_bar > 0.0).map(|m| {
            let ends = vec![(m.x, m.y - m.half_bar), (m.x, m.y + m.half_bar)];
            PathElement::new(ends, m.color.mix(0.7).stroke_width(1))
        });
        chart.draw_series(bars)?;
        let (filled, rings): (Vec<&Mark>, Vec<&Mark>) = marks.iter().partition(|m| !m.hollow);
        chart.draw_series(
            filled
                .iter()
                .map(|m| Circle::new((m.x, m.y), 3, m.color.filled())),
        )?;
        let ring = |m: &&Mark| Circle::new((m.x, m.y), 6, m.color.stroke_width(2));
        chart.draw_series(rings.iter().map(ring))?;
        Ok(())
    })
}

/// One dot for each element over its azimuth, each on its band.
pub(super) fn per_beam(size: (u32, u32), axes: &Axes, title: &str, step_deg: f64, dots: &[Dot]) -> String {
    // Half the step between beams, so that neighboring bands touch.
    let half_step = 0.5 * step_deg;
    draw(size, title, |area| {
        let mut chart = frame(area, axes, true)?;
        let (low, high) = (axes.y.start, axes.y.end);
        let bands = dots.iter().filter(|d| d.half_band > 0.0).map(|d| {
            Rectangle::new(
                [
                    (d.x - half_step, (-d.half_band).max(low)),
                    (d.x + half_step, d.half_band.min(high)),
                ],
                GRID.mix(0.55).filled(),
            )
        });
        chart.draw_series(bands)?;
        if low < 0.0 && high > 0.0 {
            let zero = [(axes.x.start, 0.0), (axes.x.end, 0.0)];
            chart.draw_series(LineSeries::new(zero, BLACK.mix(0.6).stroke_width(1)))?;
        }
        let marks = dots
            .iter()
            .map(|d| Circle::new((d.x, d.y.clamp(low, high)), 2, d.color.filled()));
        chart.draw_series(marks)?;
        Ok(())
    })
}

/// Plots rows of colored bars over azimuth; row 0 is at the top.
pub(super) fn strip(size: (u32, u32), axes: &Axes, title: &str, bars: &[Bar], rows: usize) -> String {
    draw(size, title, |area| {
        let mut chart = frame(area, axes, false)?;
        let boxes = bars.iter().map(|b| {
            let top = (rows - b.row) as f64;
            Rectangle::new([(b.x.start, top - 0.85), (b.x.end, top - 0.15)], b.color.filled())
        });
        chart.draw_series(boxes)?;
        Ok(())
    })
}

fn draw_strokes(chart: &mut Chart, strokes: &[Stroke]) -> Result<(), Failure> {
    for s in strokes {
        let style = s.color.mix(s.opacity).stroke_width(s.width);
        chart.draw_series(LineSeries::new(s.points.iter().copied(), style))?;
    }
    Ok(())
}

/// Draws the axes with grid and labels.
fn frame<'a>(area: &Sheet<'a>, axes: &Axes, y_labels: bool) -> Result<Chart<'a>, Failure> {
    let mut chart = ChartBuilder::on(area)
        .margin(MARGIN)
        .x_label_area_size(AXIS_ROOM)
        .y_label_area_size(AXIS_ROOM)
        .build_cartesian_2d(axes.x.clone(), axes.y.clone())?;
    let label = |value: &f64| tick(*value);
    let mut mesh = chart.configure_mesh();
    mesh.x_desc(axes.x_label.as_str())
        .y_desc(axes.y_label.as_str())
        .label_style((FONT, LABEL_SIZE))
        .axis_desc_style((FONT, LABEL_SIZE))
        .axis_style(BLACK.mix(0.6))
        .bold_line_style(GRID.mix(0.6))
        .max_light_lines(1)
        .x_label_formatter(&label)
        .y_label_formatter(&label);
    if !y_labels {
        mesh.disable_y_mesh().y_labels(0);
    }
    mesh.draw()?;
    Ok(chart)
}

/// Formats the number at a tick: no more digits than needed, a true minus sign, and no negative zero.
pub(super) fn tick(value: f64) -> String {
    // Ticks are round numbers; anything beyond the sixth decimal is rounding error.
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match text.strip_prefix('-') {
        Some("0") => "0".to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text.to_owned(),
    }
}

/// Returns an SVG for inlining: without a namespace, which HTML supplies, with a title, and as wide as the page allows.
fn draw(size: (u32, u32), title: &str, content: impl FnOnce(&Sheet) -> Result<(), Failure>) -> String {
    let mut svg = String::new();
    let outcome = {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        content(&area).and_then(|()| Ok(area.present()?))
    };
    if let Err(error) = outcome {
        return format!(
            "<p class=\"failed\">This plot could not be drawn: {}</p>",
            super::page::escape(&error.to_string())
        );
    }
    let start = svg.find('>').map_or(0, |end| end + 1);
    let (width, height) = size;
    format!(
        "<svg viewBox=\"0 0 {width} {height}\" style=\"max-width:{width}px\" role=\"img\"><title>{}</title>{}",
        super::page::escape(title),
        svg[start..].trim_start()
    )
}

/// Turns an inline SVG into a file: with its namespace, on white.
#[cfg(feature = "design")]
pub(super) fn standalone(svg: &str) -> String {
    svg.replacen("<svg ", "<svg xmlns=\"http://www.w3.org/2000/svg\" ", 1)
        .replacen(
            "</title>",
            "</title><rect width=\"100%\" height=\"100%\" fill=\"#FFFFFF\"/>",
            1,
        )
}

/// Returns limits around zero that hold the values, except a few far outliers; −1…1 without values.
pub(super) fn around_zero(values: impl Iterator<Item = f64>) -> Range<f64> {
    // Values beyond four times the 95th percentile would squeeze all others onto the axis.
    const FAR: f64 = 4.0;
    let sizes: Vec<f64> = values.filter(|v| v.is_finite()).map(f64::abs).collect();
    let largest = percentile(&sizes, 1.0);
    let usual = percentile(&sizes, 0.95);
    let limit = 1.1
        * if usual > 0.0 {
            largest.min(FAR * usual)
        } else {
            largest
        };
    if limit > 0.0 { -limit..limit } else { -1.0..1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes() -> Axes {
        Axes {
            x: -1.0..1.0,
            y: -1.0..1.0,
            x_label: "x (m)".to_owned(),
            y_label: "y (m)".to_owned(),
        }
    }

    #[test]
    fn a_plot_is_an_svg_that_can_be_inlined() {
        let stroke = Stroke {
            points: vec![(0.0, 0.0), (0.5, 0.5)],
            color: color(0),
            width: 2,
            opacity: 1.0,
        };
        let svg = plan((300, 300), &axes(), "a < b", &[stroke], &[]);
        assert!(svg.starts_with("<svg viewBox=\"0 0 300 300\"") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("<title>a &lt; b</title>") && svg.contains("x (m)") && svg.contains("#0072B2"));
        assert!(!svg.contains("http"));
    }

    #[test]
    fn values_off_the_axes_are_drawn_at_their_end() {
        let dot = |y| Dot {
            x: 0.0,
            y,
            half_band: 0.1,
            color: color(1),
        };
        let at = |y: f64| per_beam((300, 300), &axes(), "", 0.25, &[dot(y)]);
        assert_eq!(at(5.0), at(1.0));
        assert_ne!(at(0.5), at(1.0));
    }

    #[test]
    fn ticks_are_short() {
        for (value, text) in [
            (100.0, "100"),
            (-0.0, "0"),
            (-1e-17, "0"),
            (-0.15, "−0.15"),
            (0.1 + 0.2, "0.3"),
        ] {
            assert_eq!(tick(value), text);
        }
    }

    #[test]
    fn limits_hold_the_values() {
        assert_eq!(around_zero([1.0, -2.0, f64::NAN].into_iter()), -2.2..2.2);
        assert_eq!(around_zero(std::iter::empty()), -1.0..1.0);
        let outlier = (0..100).map(|i| if i == 50 { 100.0 } else { 1.0 });
        assert_eq!(around_zero(outlier), -4.4..4.4);
    }
}
