//! The depth image: the room in gray, the elements' ranges in color, and a color scale.

use super::drawn::Drawn;
use super::perspective::base64;
use super::picture::Picture;
use super::views;
use crate::figure::{css, round_numbers, tick};
use plotters::style::RGBColor;

/// Size of the picture, and size and upper left corner of the map in it, in pixels.
const SIZE: [f64; 2] = [1000.0, 590.0];
const MAP: [f64; 2] = [900.0, 450.0];
const CORNER: [f64; 2] = [70.0, 14.0];

/// Colors of the scale, evenly spaced from near to far: perceptually uniform, and distinguishable for the red-green
/// color-blind (viridis, Smith and van der Walt 2015).
const SCALE: [RGBColor; 6] = [
    RGBColor(0x44, 0x01, 0x54),
    RGBColor(0x41, 0x44, 0x87),
    RGBColor(0x2A, 0x78, 0x8E),
    RGBColor(0x22, 0xA8, 0x84),
    RGBColor(0x7A, 0xD1, 0x51),
    RGBColor(0xFD, 0xE7, 0x25),
];

/// Grays of the room from near to far, light enough for the elements' colors to stand out.
const GREYS: [u8; 2] = [0x96, 0xF0];

/// Fraction of ranges that the scale ignores at either end, so that one distant corner does not flatten the rest.
const BEYOND: f64 = 0.005;

/// Draws the depth image of a layout in its room.
pub(super) fn depth(drawn: &Drawn) -> String {
    let depth = &drawn.depth;
    let mut ranges: Vec<f64> = depth
        .room_m
        .iter()
        .chain(&depth.read_m)
        .flatten()
        .copied()
        .collect();
    ranges.sort_by(f64::total_cmp);
    let limits = [BEYOND, 1.0 - BEYOND].map(|share| {
        let place = (share * ranges.len().saturating_sub(1) as f64).round();
        // An index of the list.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        ranges.get(place as usize).copied()
    });
    let [near, far] = [limits[0].unwrap_or(0.0), limits[1].unwrap_or(1.0)];
    let part = |range: f64| ((range - near) / (far - near).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    let [width, height] = SIZE;
    let mut svg = format!(
        "<svg viewBox=\"0 0 {width} {height}\" style=\"max-width:{width}px\" role=\"img\" font-family=\"sans-serif\" \
         font-size=\"13\"><title>Ranges in the room</title>"
    );
    let ([left, top], [wide, high]) = (CORNER, MAP);
    svg += &format!(
        "<image x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\" preserveAspectRatio=\"none\" \
         href=\"data:image/png;base64,{}\"/>",
        base64(&room(drawn, part))
    );
    let place = |(x, y): (f64, f64)| (left + wide * (x + 180.0) / 360.0, top + high * (90.0 - y) / 180.0);
    for ray in drawn.drawing.rays.iter().filter(|r| r.class.sees()) {
        // An element without a range in this room is white, as the room is there.
        let color = depth.read_m[ray.beam].map_or(RGBColor(255, 255, 255), |range| scale(part(range)));
        for outline in views::cell(drawn, ray) {
            let points: Vec<String> = outline
                .into_iter()
                .map(|at| {
                    let (x, y) = place(at);
                    format!("{x:.2},{y:.2}")
                })
                .collect();
            let color = css(color);
            // A thin outline in the same color closes the seams between cells.
            svg += &format!(
                "<polygon points=\"{}\" fill=\"{color}\" stroke=\"{color}\" stroke-width=\"0.6\"/>",
                points.join(" ")
            );
        }
    }
    svg += &format!(
        "<rect x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\" fill=\"none\" stroke=\"#202020\"/>"
    );
    svg += &labels(&place);
    svg += &bar(near, far);
    svg + "</svg>\n"
}

/// Returns the room as a PNG file, one pixel per direction; transparent where no surface is hit.
fn room(drawn: &Drawn, part: impl Fn(f64) -> f64) -> Vec<u8> {
    let depth = &drawn.depth;
    let [near, far] = GREYS.map(f64::from);
    // Between two bytes.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let pixel = |range: &Option<f64>| match range {
        None => [255, 0],
        Some(range) => [(near + (far - near) * part(*range)).round() as u8, 255],
    };
    Picture {
        size: [depth.columns, depth.rows].map(|s| u32::try_from(s).unwrap_or(0)),
        color: image::ExtendedColorType::La8,
        bytes: depth.room_m.iter().flat_map(pixel).collect(),
    }
    .encoded()
}

/// Returns the color at a position on the scale, 0 near and 1 far.
fn scale(part: f64) -> RGBColor {
    let steps = SCALE.len() - 1;
    let at = part.clamp(0.0, 1.0) * steps as f64;
    // Below the number of steps.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let below = (at.floor() as usize).min(steps - 1);
    super::canvas::mixed(SCALE[below], SCALE[below + 1], at - below as f64)
}

/// Draws ticks and names of the axes.
fn labels(place: &dyn Fn((f64, f64)) -> (f64, f64)) -> String {
    let mut svg = String::new();
    for azimuth in (-150..=150).step_by(30).map(f64::from) {
        let (x, y) = place((-azimuth, -90.0));
        svg += &format!(
            "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            y + 17.0,
            tick(azimuth)
        );
    }
    for elevation in (-90..=90).step_by(30).map(f64::from) {
        let (x, y) = place((-180.0, elevation));
        svg += &format!(
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            x - 6.0,
            y + 4.0,
            tick(elevation)
        );
    }
    let (middle, bottom) = place((0.0, -90.0));
    let (left, half) = place((-180.0, 0.0));
    svg += &format!(
        "<text x=\"{middle:.1}\" y=\"{:.1}\" text-anchor=\"middle\">azimuth, to the left (°)</text>",
        bottom + 36.0
    );
    let x = left - 48.0;
    svg + &format!(
        "<text x=\"{x:.1}\" y=\"{half:.1}\" text-anchor=\"middle\" transform=\"rotate(-90 {x:.1} \
         {half:.1})\">elevation, up (°)</text>"
    )
}

/// Draws the scale of ranges below the map, colors above grays.
fn bar(nearest: f64, farthest: f64) -> String {
    const PARTS: usize = 60;
    let ([left, top], wide) = ([CORNER[0], CORNER[1] + MAP[1] + 52.0], MAP[0]);
    let step = wide / PARTS as f64;
    let [near, far] = GREYS.map(f64::from);
    let mut svg = String::new();
    for i in 0..PARTS {
        let part = (i as f64 + 0.5) / PARTS as f64;
        let x = left + i as f64 * step;
        let grey = near + (far - near) * part;
        svg += &format!(
            "<rect x=\"{x:.2}\" y=\"{top}\" width=\"{0:.2}\" height=\"14\" fill=\"{1}\"/><rect x=\"{x:.2}\" y=\"{2}\" \
             width=\"{0:.2}\" height=\"8\" fill=\"rgb({3:.0},{3:.0},{3:.0})\"/>",
            step + 0.5,
            css(scale(part)),
            top + 14.0,
            grey
        );
    }
    for range in round_numbers(nearest..farthest, 8.0) {
        let x = left + wide * (range - nearest) / (farthest - nearest);
        svg += &format!(
            "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{} m</text>",
            top + 38.0,
            tick(range)
        );
    }
    svg
}
