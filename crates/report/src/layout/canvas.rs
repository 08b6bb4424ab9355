//! A rasterizer of triangles and lines with a depth buffer and several samples per pixel.

use super::picture::Picture;
use plotters::style::RGBColor;

/// Size of the picture, in pixels.
pub(super) const SIZE: [u32; 2] = [960, 720];

/// Samples per pixel along each axis.
const SAMPLES: u32 = 3;

/// Samples, each with the nearness of what it shows.
pub(super) struct Canvas {
    width: usize,
    height: usize,
    shown: Vec<(f64, Option<RGBColor>)>,
}

impl Canvas {
    pub(super) fn new() -> Self {
        let [width, height] = SIZE.map(|s| (s * SAMPLES) as usize);
        Self {
            width,
            height,
            shown: vec![(0.0, None); width * height],
        }
    }

    pub(super) fn triangle(&mut self, corners: [[f64; 3]; 3], color: RGBColor) {
        let [a, b, c] = corners.map(|[x, y, n]| [x * f64::from(SAMPLES), y * f64::from(SAMPLES), n]);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0.0 {
            return;
        }
        let (columns, rows) = (
            self.span([a[0], b[0], c[0]], self.width),
            self.span([a[1], b[1], c[1]], self.height),
        );
        for row in rows {
            let y = row as f64 + 0.5;
            let within = self.within([[a, b], [b, c], [c, a]], area, y);
            for column in columns.start.max(within.start)..columns.end.min(within.end) {
                let x = column as f64 + 0.5;
                let part = |p: [f64; 3], q: [f64; 3]| {
                    ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area
                };
                let (u, v, w) = (part(b, c), part(c, a), part(a, b));
                if u >= 0.0 && v >= 0.0 && w >= 0.0 {
                    self.show(column, row, u * a[2] + v * b[2] + w * c[2], color);
                }
            }
        }
    }

    /// Returns a range of columns of a row that covers the triangle between its edges, with a margin.
    fn within(&self, edges: [[[f64; 3]; 2]; 3], area: f64, y: f64) -> std::ops::Range<usize> {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for [p, q] in edges {
            let rise = q[1] - p[1];
            let at = p[0] + (q[0] - p[0]) * (y - p[1]) / rise;
            if rise * area < 0.0 {
                low = low.max(at);
            } else if rise * area > 0.0 {
                high = high.min(at);
            }
        }
        self.span([low - 2.0, low - 2.0, high + 2.0], self.width)
    }

    /// Returns the samples between the minimum and maximum of three coordinates.
    fn span(&self, places: [f64; 3], limit: usize) -> std::ops::Range<usize> {
        let low = places.iter().copied().fold(f64::INFINITY, f64::min);
        let high = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // Within the picture after the clamp.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let sample = |at: f64| at.clamp(0.0, limit as f64) as usize;
        sample(low.floor())..sample(high.ceil() + 1.0)
    }

    /// Draws a line of a width in pixels, slightly nearer than it is, so that it is not hidden by its own surface.
    pub(super) fn line(&mut self, from: [f64; 3], to: [f64; 3], width: f64, color: RGBColor) {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = libm::hypot(along[0], along[1]);
        if length == 0.0 {
            return;
        }
        let aside = [-along[1] / length * 0.5 * width, along[0] / length * 0.5 * width];
        let raised = |p: [f64; 3], sign: f64| [p[0] + sign * aside[0], p[1] + sign * aside[1], p[2] * 1.0005];
        let [a, b, c, d] = [
            raised(from, 1.0),
            raised(to, 1.0),
            raised(to, -1.0),
            raised(from, -1.0),
        ];
        self.triangle([a, b, c], color);
        self.triangle([a, c, d], color);
    }

    fn show(&mut self, column: usize, row: usize, nearness: f64, color: RGBColor) {
        let sample = &mut self.shown[row * self.width + column];
        if nearness > sample.0 {
            *sample = (nearness, Some(color));
        }
    }

    /// Averages the samples of each pixel; pixels that show nothing are transparent.
    pub(super) fn picture(&self) -> Picture {
        let samples = SAMPLES as usize;
        let [columns, rows] = SIZE.map(|s| s as usize);
        let mut bytes = Vec::with_capacity(4 * columns * rows);
        for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
            let (column, row) = (x * samples, y * samples);
            let mut sum = [0_u32; 3];
            let mut count = 0_u32;
            for i in 0..samples {
                for j in 0..samples {
                    if let (_, Some(c)) = self.shown[(row + i) * self.width + column + j] {
                        sum = [
                            sum[0] + u32::from(c.0),
                            sum[1] + u32::from(c.1),
                            sum[2] + u32::from(c.2),
                        ];
                        count += 1;
                    }
                }
            }
            // Means of bytes, and a fraction of 255.
            #[allow(clippy::cast_possible_truncation)]
            let mean = |value: u32| (value / count.max(1)) as u8;
            #[allow(clippy::cast_possible_truncation)]
            let alpha = (255 * count / (SAMPLES * SAMPLES)) as u8;
            bytes.extend([mean(sum[0]), mean(sum[1]), mean(sum[2]), alpha]);
        }
        Picture {
            size: SIZE,
            color: image::ExtendedColorType::Rgba8,
            bytes,
        }
    }
}

/// Mixes a color with a share of another.
pub(super) fn mixed(color: RGBColor, other: RGBColor, share: f64) -> RGBColor {
    // Between two bytes.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let mix = |a: u8, b: u8| (f64::from(a) * (1.0 - share) + f64::from(b) * share).round() as u8;
    RGBColor(
        mix(color.0, other.0),
        mix(color.1, other.1),
        mix(color.2, other.2),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_triangle_is_shown() {
        let mut canvas = Canvas::new();
        let corners = |nearness| [[0.0, 0.0, nearness], [50.0, 0.0, nearness], [0.0, 50.0, nearness]];
        let (red, blue) = (RGBColor(255, 0, 0), RGBColor(0, 0, 255));
        canvas.triangle(corners(2.0), red);
        canvas.triangle(corners(1.0), blue);
        let picture = canvas.picture();
        let pixel = |at: usize| &picture.bytes[4 * (at * SIZE[0] as usize + at)..][..4];
        assert_eq!(pixel(10), [255, 0, 0, 255]);
        assert_eq!(pixel(40)[3], 0);
    }
}
