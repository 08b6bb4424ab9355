//! The sub-rays of a beam that edges divide.
//!
//! A few rays spread over the spot find an edge only to within the distance between them, and a sliver of light beyond
//! it not at all. So the spot is cut into lines across its edges; along each, the places where the light takes another
//! path are found by bisection, and the Gaussian between them is integrated in closed form. Lines are added where their
//! neighbors are cut differently: at the corners and the ends of edges. What takes one path is then gathered into a few
//! rays that have its energy, its center and its spread.
//!
//! The beam ends at [`REACH`]; its energy out to there counts as all of it.

mod cells;
mod gauss;
mod lines;

use super::footprint::SubRay;
use cells::{LONGEST_NODE, Node, add_nodes, gather};
pub use gauss::{Place, REACH};
use lines::{Panel, panels};
use std::f64::consts::FRAC_PI_4;

/// Energy beyond an edge three standard deviations from the chief ray: Φ(−3). A beam that loses less counts as whole.
pub const NEGLIGIBLE: f64 = 0.001_349_898_031_630_1;

/// Points on the contour where the beam ends that show whether it is divided: an edge that passes between two of them
/// cuts off less than 1e-5 of the energy.
const AROUND: usize = 32;

/// Points across the spot in which edges are sought to find out how they run.
const GRID: usize = 9;

/// Light on a path that holds less is left out.
const LEAST_PATH: f64 = 1e-6;

/// Lists of sub-rays for the beams that edges divide.
#[derive(Debug, Clone, Default)]
pub struct EdgeRays {
    of_beams: Vec<Option<Box<[SubRay]>>>,
}

impl EdgeRays {
    /// The list of a beam; `None` if no edge divides it.
    pub fn of(&self, beam: usize) -> Option<&[SubRay]> {
        self.of_beams.get(beam)?.as_deref()
    }
}

impl FromIterator<Option<Vec<SubRay>>> for EdgeRays {
    fn from_iter<T: IntoIterator<Item = Option<Vec<SubRay>>>>(lists: T) -> Self {
        let of_beams = lists.into_iter().map(|list| list.map(Vec::into)).collect();
        Self { of_beams }
    }
}

/// Places on the contour where the beam ends: if its light takes one path there and within, the beam is whole.
pub fn around() -> impl Iterator<Item = Place> {
    (0..AROUND).map(|k| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 / AROUND as f64);
        [REACH * cos, REACH * sin]
    })
}

/// About `count` sub-rays of a beam that edges divide, path by path; `paths` says which path the light at each place
/// takes.
///
/// The weights sum to one. Those of the rays on each path sum to its energy, wrong by less than 0.1 % of the beam's
/// where edges are straight and meet in few corners, and the rays are centered on its light.
pub fn divided<K: Clone + PartialEq>(count: usize, mut paths: impl FnMut(&[Place]) -> Vec<K>) -> Vec<SubRay> {
    let across = across_edges(&mut paths);
    let place = |along: f64, offset: f64| {
        [
            along * across[0] - offset * across[1],
            along * across[1] + offset * across[0],
        ]
    };
    let mut paths_along = |points: &[(f64, f64)]| {
        let places: Vec<Place> = points.iter().map(|(u, v)| place(*u, *v)).collect();
        paths(&places)
    };
    let panels = panels(&mut paths_along);
    let longest = LONGEST_NODE / (count.max(1) as f64).sqrt();
    let mut groups: Vec<(K, Vec<Node>)> = Vec::new();
    for (line, weight) in panels.iter().flat_map(Panel::weighted) {
        for piece in &line.pieces {
            let group = match groups.iter().position(|(path, _)| *path == piece.path) {
                Some(known) => known,
                None => {
                    groups.push((piece.path.clone(), Vec::new()));
                    groups.len() - 1
                }
            };
            let on_line = |along| place(along, line.offset);
            add_nodes(piece, (weight, longest), on_line, &mut groups[group].1);
        }
    }
    let energy = |nodes: &[Node]| nodes.iter().map(|n| n.energy).sum::<f64>();
    groups.retain(|(_, nodes)| energy(nodes) > LEAST_PATH);
    let all: f64 = groups.iter().map(|(_, nodes)| energy(nodes)).sum();
    let mut rays = Vec::with_capacity(count + groups.len());
    for (path, mut nodes) in groups {
        let share = energy(&nodes) / all;
        // A rounded share of a count that fits in memory.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let own = ((count as f64 * share).round() as usize).max(1);
        let gathered = gather(&mut nodes, own, &path, &mut paths);
        rays.extend(gathered.into_iter().map(|cell| SubRay {
            wide: cell.at[0],
            narrow: cell.at[1],
            weight: cell.energy / all,
        }));
    }
    rays
}

/// Direction of the lines: of four, the one in which most light is next to light that takes another path.
fn across_edges<K: PartialEq>(paths: &mut impl FnMut(&[Place]) -> Vec<K>) -> Place {
    let step = 2.0 * REACH / (GRID - 1) as f64;
    let at = |i: usize, j: usize| [step * i as f64 - REACH, step * j as f64 - REACH];
    let places: Vec<Place> = (0..GRID * GRID).map(|n| at(n / GRID, n % GRID)).collect();
    let found = paths(&places);
    let inside = |[x, y]: &Place| x * x + y * y <= REACH * REACH;
    let crossed = |di: usize, dj: isize| {
        let mut sum = 0.0;
        for i in 0..GRID - di {
            for j in 0..GRID {
                let Some(l) = j.checked_add_signed(dj).filter(|l| *l < GRID) else {
                    continue;
                };
                let (a, b) = (i * GRID + j, (i + di) * GRID + l);
                if inside(&places[a]) && inside(&places[b]) && found[a] != found[b] {
                    let middle = [0, 1].map(|k| 0.5 * (places[a][k] + places[b][k]));
                    sum += libm::exp(-2.0 * (middle[0] * middle[0] + middle[1] * middle[1]));
                }
            }
        }
        // Diagonal neighbors are farther apart, and so are more often on both sides of an edge.
        sum / libm::hypot(di as f64, dj as f64)
    };
    let directions = [(1, 0), (1, 1), (0, 1), (1, -1)];
    let (mut best, mut most) = (0, 0.0);
    for (number, (di, dj)) in directions.into_iter().enumerate() {
        let sum = crossed(di, dj);
        if sum > most {
            (best, most) = (number, sum);
        }
    }
    let (sin, cos) = libm::sincos(FRAC_PI_4 * best as f64);
    [cos, sin]
}

#[cfg(test)]
mod tests {
    use super::gauss::{density, within};
    use super::*;
    use std::f64::consts::SQRT_2;

    /// Φ of a standard deviation of one half.
    fn below(at: f64) -> f64 {
        0.5 * libm::erfc(-at * SQRT_2)
    }

    fn sum(rays: &[SubRay], of: impl Fn(&SubRay) -> f64) -> f64 {
        rays.iter().map(|r| r.weight * of(r)).sum()
    }

    #[test]
    fn an_edge_anywhere_leaves_the_share_and_the_center_of_the_gaussian_beyond_it() {
        for step in 0..60 {
            let at = -1.95 + 3.9 * f64::from(step) / 59.0;
            let (sin, cos) = libm::sincos(2.4 * f64::from(step));
            let over = |x: f64, y: f64| x * cos + y * sin - at;
            let rays = divided(48, |places| {
                places.iter().map(|[x, y]| over(*x, *y) > 0.0).collect()
            });
            assert!((sum(&rays, |_| 1.0) - 1.0).abs() < 1e-12);
            assert!((44..=52).contains(&rays.len()), "{}", rays.len());
            let beyond = |r: &SubRay| f64::from(u8::from(over(r.wide, r.narrow) > 0.0));
            let share = sum(&rays, beyond);
            let exact = 1.0 - below(at);
            // What lies beyond the end of the beam is 3.4e-4 of it, a part of which is on either side.
            assert!((share - exact).abs() < 2e-4, "{at}: {share}, {exact}");
            if exact > 0.01 {
                let along = |r: &SubRay| beyond(r) * (r.wide * cos + r.narrow * sin);
                let center = sum(&rays, along) / share;
                let exact = 0.25 * density(at) / exact;
                assert!((center - exact).abs() < 5e-3, "{at}: {center}, {exact}");
                let side = |r: &SubRay| beyond(r) * (r.narrow * cos - r.wide * sin);
                assert!((sum(&rays, side) / share).abs() < 5e-3, "{at}");
            }
        }
    }

    #[test]
    fn corners_and_strips_leave_products_of_the_gaussian() {
        for step in 0..40 {
            let [a, b] = [0.731, 0.317].map(|k| -1.2 + 2.4 * libm::modf(k * f64::from(step + 1)).0);
            let angle = 0.9 * f64::from(step);
            let (sin, cos) = libm::sincos(angle);
            let turned = |[x, y]: &Place| [x * cos + y * sin, y * cos - x * sin];
            let share = |inside: &dyn Fn(Place) -> bool| {
                let rays = divided(48, |places| places.iter().map(|p| inside(turned(p))).collect());
                sum(&rays, |r| {
                    f64::from(u8::from(inside(turned(&[r.wide, r.narrow]))))
                })
            };
            let corner = share(&|[x, y]| x > a && y > b);
            let exact = (1.0 - below(a)) * (1.0 - below(b));
            assert!(
                (corner - exact).abs() < 1e-3,
                "corner {a}, {b}, {angle}: {corner}, {exact}"
            );
            let strip = share(&|[x, _]| x > a && x < a + 0.5);
            let exact = below(a + 0.5) - below(a);
            assert!(
                (strip - exact).abs() < 1e-3,
                "strip {a}, {angle}: {strip}, {exact}"
            );
        }
    }

    #[test]
    fn the_light_on_each_side_keeps_its_spread() {
        let rays = divided(48, |places| places.iter().map(|p| p[0] > 0.3).collect());
        for side in [false, true] {
            let own: Vec<SubRay> = rays.iter().copied().filter(|r| (r.wide > 0.3) == side).collect();
            let share = sum(&own, |_| 1.0);
            let mean = sum(&own, |r| r.wide) / share;
            let spread = sum(&own, |r| (r.wide - mean) * (r.wide - mean) + r.narrow * r.narrow) / share;
            // Of a Gaussian with a standard deviation of one half, cut at 0.3.
            let sign = if side { 1.0 } else { -1.0 };
            let energy = if side { 1.0 - below(0.3) } else { below(0.3) };
            let center = sign * 0.25 * density(0.3) / energy;
            let exact = 0.5 + sign * 0.25 * 0.3 * density(0.3) / energy - center * center;
            assert!((spread - exact).abs() < 0.01 * exact, "{side}: {spread}, {exact}");
        }
    }

    #[test]
    fn a_sliver_is_found_where_it_holds_more_than_a_hundred_thousandth() {
        let at = 1.98;
        let shown = |angle: f64| {
            let (sin, cos) = libm::sincos(angle);
            around().any(|[x, y]| x * cos + y * sin > at)
        };
        assert!((0..100).all(|k| shown(0.063 * f64::from(k))));
        // The sliver beyond the line at 1.9904, which just passes between two of the points.
        let sliver: f64 = (0..1000)
            .map(|k| {
                let along = 2.0 * libm::cos(std::f64::consts::PI / 32.0);
                let from = along + (REACH - along) * (f64::from(k) + 0.5) / 1000.0;
                let half = (REACH * REACH - from * from).sqrt();
                density(from) * within(-half, half) * (REACH - along) / 1000.0
            })
            .sum();
        assert!(sliver < 1e-5, "{sliver}");
    }
}
