//! The joint problem as least squares: what every reading of every board should be, and how it changes.
//!
//! ```text
//! z = d + s + E(r, θ_N, color) + c·w + σ_d·b₀ + noise            u → v₀ = u − 2(m·u)m,  d = h/(m·u),  v = v₀ ⊞ δ
//! ```
//!
//! Shared by all groups: `w`, standard normal by its prior, which moves the mounting and the biases. A group's own: the
//! planes (m, h) of its facets, and of each of its boards b: drift and the plane's offset and two tilts. Each beam departs
//! by δ ~ N(0, τ²) from its facet's plane; δ is eliminated beam by beam, which leaves (I + τ²HHᵀ)^(−½) as the weight of
//! its rows.

use super::fan::{Flatness, Shape};
use super::group::{BOARD_ERRORS, Element, FACET_BLOCKS, FIGURE, Group};
use crate::judge::common::CommonErrors;
use crate::lsq::{Block, Point};
use catoptric_model::{MirrorPlane, Pose, RangeBias};
use nalgebra::{DVector, Dyn, OMatrix, U6};

/// How the shared numbers w move the sensor: motion = M·w about a mounting.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mounting {
    pub(super) rig_from_sensor: Pose,
    pub(super) motion: OMatrix<f64, U6, Dyn>,
}

/// All of it.
#[derive(Clone)]
pub(super) struct Joint<'a> {
    pub(super) groups: Vec<Group>,
    pub(super) mounting: Mounting,
    pub(super) bias: &'a RangeBias,
    pub(super) common: CommonErrors<'a>,
    /// Where in w the common errors begin.
    pub(super) first_common: usize,
    pub(super) drift_sd: f64,
    pub(super) marker_sd: f64,
    /// How far facets are from plane.
    pub(super) flatness: Flatness,
    /// What w is believed to be.
    pub(super) prior_mean: DVector<f64>,
}

impl Joint<'_> {
    /// Number of shared parameters.
    pub(super) fn shared_dimension(&self) -> usize {
        self.first_common + self.common.len()
    }

    /// A facet of a group.
    pub(super) fn shape(own: &Point, facet: usize) -> Option<Shape<'_>> {
        let first = FACET_BLOCKS * facet;
        Some(Shape {
            normal: *own.direction(first)?,
            offset: own.numbers(first + 1)?[0],
            figure: own.numbers(first + 2)?,
        })
    }

    /// Errors of the boards of a group.
    pub(super) fn board_errors<'p>(&self, group: &Group, own: &'p Point) -> Option<&'p DVector<f64>> {
        own.numbers(FACET_BLOCKS * group.facets.len())
    }

    /// 1σ of an element's departure from its facet's plane; an undeflected beam has none.
    pub(super) fn departure(&self, element: &Element) -> f64 {
        if element.facet.is_some() {
            self.flatness.tau
        } else {
            0.0
        }
    }

    /// The own parameters of a group with given planes, and boards as tracked.
    pub(super) fn start(group: &Group, planes: &[MirrorPlane]) -> Point {
        let mut blocks = Vec::new();
        for facet in &group.facets {
            let plane = &planes[facet.facet];
            blocks.push(Block::Direction(plane.normal));
            blocks.push(Block::Vector(DVector::from_element(1, plane.offset)));
            blocks.push(Block::Vector(DVector::zeros(FIGURE)));
        }
        blocks.push(Block::Vector(DVector::zeros(group.boards.len() * BOARD_ERRORS)));
        Point { blocks }
    }
}
