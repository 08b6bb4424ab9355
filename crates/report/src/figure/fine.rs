//! Plots of small shapes: drawn four times as large and scaled down, because plotters rounds coordinates to whole
//! pixels.

use super::{AXIS_ROOM, Axes, FONT, Failure, GRID, LABEL_SIZE, Label, MARGIN, Stroke, draw, tick};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Scale of the drawing. The style sheet depends on it too.
const SCALE: u32 = 4;

/// A filled outline.
pub(crate) struct Area {
    pub(crate) points: Vec<(f64, f64)>,
    pub(crate) color: RGBColor,
}

/// The contents of a plot of small shapes.
#[derive(Default)]
pub(crate) struct Shapes {
    pub(crate) areas: Vec<Area>,
    pub(crate) strokes: Vec<Stroke>,
    pub(crate) labels: Vec<Label>,
    /// Positions of the axes' numbers and grid lines.
    pub(crate) ticks: [Vec<f64>; 2],
    /// Names next to the vertical axis, where it has no numbers.
    pub(crate) row_names: Vec<(f64, &'static str)>,
    /// Whether the horizontal axis holds the negatives of its numbers: azimuth grows to the left.
    pub(crate) mirrored: bool,
}

/// Draws filled outlines, lines and labels over a grid.
pub(crate) fn fine(size: (u32, u32), axes: &Axes, title: &str, shapes: &Shapes) -> String {
    let (width, height) = size;
    // Label sizes and line widths are a few pixels, times four.
    #[allow(clippy::cast_possible_wrap)]
    let scale = SCALE as i32;
    let label = LABEL_SIZE * scale;
    let svg = draw((width * SCALE, height * SCALE), title, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(MARGIN * SCALE)
            .x_label_area_size(AXIS_ROOM * SCALE)
            .y_label_area_size(AXIS_ROOM * SCALE)
            .build_cartesian_2d(axes.x.clone(), axes.y.clone())?;
        let (x, y) = (axes.x.clone(), axes.y.clone());
        let grid = GRID.mix(0.6).stroke_width(SCALE);
        // Points on the margin have no coordinates of the plot.
        let pixels = |x: f64, y: f64, aside: i32, below: i32| {
            let (column, row) = chart.backend_coord(&(x, y));
            (column + aside * scale, row + below * scale)
        };
        let text = |at: (i32, i32), text: String, horizontal: HPos, vertical: VPos| {
            let style = (FONT, label).into_font().color(&BLACK);
            Text::new(text, at, style.pos(Pos::new(horizontal, vertical)))
        };
        let mut lines = Vec::new();
        for &at in &shapes.ticks[0] {
            let place = if shapes.mirrored { -at } else { at };
            lines.push(vec![(place, y.start), (place, y.end)]);
            let below = pixels(place, y.start, 0, 6);
            area.draw(&text(below, tick(at), HPos::Center, VPos::Top))?;
        }
        for &at in &shapes.ticks[1] {
            lines.push(vec![(x.start, at), (x.end, at)]);
            let beside = pixels(x.start, at, -6, 0);
            area.draw(&text(beside, tick(at), HPos::Right, VPos::Center))?;
        }
        for (at, name) in &shapes.row_names {
            let beside = pixels(x.start, *at, -6, 0);
            area.draw(&text(beside, (*name).to_owned(), HPos::Right, VPos::Center))?;
        }
        let middle = pixels(0.5 * (x.start + x.end), y.start, 0, 30);
        area.draw(&text(middle, axes.x_label.clone(), HPos::Center, VPos::Top))?;
        if !axes.y_label.is_empty() {
            let style = (FONT, label).into_font().transform(FontTransform::Rotate270);
            let style = style.color(&BLACK).pos(Pos::new(HPos::Center, VPos::Bottom));
            let at = pixels(x.start, 0.5 * (y.start + y.end), -38, 0);
            area.draw(&Text::new(axes.y_label.clone(), at, style))?;
        }
        for line in lines {
            chart.draw_series([PathElement::new(line, grid)])?;
        }
        let border = vec![(x.start, y.end), (x.start, y.start), (x.end, y.start)];
        chart.draw_series([PathElement::new(border, BLACK.mix(0.6).stroke_width(SCALE))])?;
        for a in &shapes.areas {
            chart.draw_series([Polygon::new(a.points.clone(), a.color.filled())])?;
            // The outline keeps shapes thinner than a pixel visible.
            let closed = a.points.iter().chain(a.points.first()).copied();
            chart.draw_series(LineSeries::new(closed, a.color.stroke_width(SCALE)))?;
        }
        for s in &shapes.strokes {
            let style = s.color.mix(s.opacity).stroke_width(s.width * SCALE);
            chart.draw_series(LineSeries::new(s.points.iter().copied(), style))?;
        }
        for l in &shapes.labels {
            let style = (FONT, label).into_font().color(&l.color);
            let style = style.pos(Pos::new(HPos::Center, VPos::Center));
            chart.draw_series([Text::new(l.text.clone(), l.at, style)])?;
        }
        Ok::<(), Failure>(())
    });
    // As large on the page as any other plot.
    let large = format!("style=\"max-width:{}px\"", width * SCALE);
    svg.replacen(
        &large,
        &format!("class=\"fine\" style=\"max-width:{width}px\""),
        1,
    )
}

/// Returns about as many round numbers within limits as requested.
pub(crate) fn round_numbers(limits: std::ops::Range<f64>, about: f64) -> Vec<f64> {
    let rough = (limits.end - limits.start) / about;
    let decade = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade);
    let step = step.into_iter().find(|s| *s >= rough).unwrap_or(10.0 * decade);
    if !(step.is_finite() && step > 0.0) {
        return Vec::new();
    }
    let first = (limits.start / step).ceil();
    (0..)
        .map(|k| (first + f64::from(k)) * step)
        .take_while(|at| *at <= limits.end)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(round_numbers(-21.0..21.0, 8.0), [-20.0, -10.0, 0.0, 10.0, 20.0]);
        assert_eq!(round_numbers(0.0..1.0, 4.0), [0.0, 0.5, 1.0]);
        assert!(round_numbers(1.0..1.0, 4.0).is_empty());
    }

    #[test]
    fn a_fine_plot_is_as_wide_as_requested() {
        let axes = Axes {
            x: -1.0..1.0,
            y: 0.0..1.0,
            x_label: "x (m)".to_owned(),
            y_label: String::new(),
        };
        let shapes = Shapes {
            ticks: [vec![0.5], Vec::new()],
            mirrored: true,
            ..Shapes::default()
        };
        let svg = fine((300, 100), &axes, "t", &shapes);
        assert!(svg.starts_with("<svg viewBox=\"0 0 1200 400\" class=\"fine\" style=\"max-width:300px\""));
        // The number of a mirrored axis is on its other side.
        let place = |svg: &str| -> Option<f64> {
            let text = svg[..svg.find("0.5")?].rfind("<text x=\"")? + 9;
            svg[text..].split('"').next()?.parse().ok()
        };
        assert!(place(&svg).is_some_and(|x| x < 650.0), "{svg}");
    }
}
