//! The joint problem as least squares: the predicted reading of every board by every element, and its derivatives.
//!
//! ```text
//! z = d + s + E(r, θ_N, color) + c·w + σ_d·b₀ + noise            u → v₀ = u − 2(m·u)m,  d = h/(m·u),  v = v₀ ⊞ δ
//! ```
//!
//! All groups share `w`, standard normal by its prior, which moves the mounting and the biases, and the thickness of glass
//! that is not known exactly. A group owns the planes
//! (m, h) of its facets and, for each of its boards, b: drift, and the offset and two tilts of the plane. Each beam
//! deviates by δ ~ N(0, τ²) from its facet's plane; δ is eliminated beam by beam, which leaves (I + τ²HHᵀ)^(−½) as the
//! weight of its rows.

use super::fan::{Flatness, Shape};
use super::group::{BOARD_ERRORS, FACET_BLOCKS, FIGURE, Group, JointElement};
use crate::judge::common::CommonErrors;
use crate::lsq::{ParameterBlock, Point};
use catoptric_model::glass::GlassSheet;
use catoptric_model::{MirrorPlane, Pose, RangeBias, Stop};
use nalgebra::{DVector, Dyn, OMatrix, U6};

/// How the shared parameters w move the sensor: motion = M·w about a mounting.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mounting {
    pub(super) rig_from_sensor: Pose,
    pub(super) motion: OMatrix<f64, U6, Dyn>,
}

/// The whole problem.
#[derive(Clone)]
pub(super) struct Joint<'a> {
    pub(super) groups: Vec<Group>,
    pub(super) mounting: Mounting,
    pub(super) bias: &'a RangeBias,
    pub(super) common: CommonErrors<'a>,
    /// Index of the first common error in w.
    pub(super) first_common: usize,
    pub(super) drift_sd: f64,
    pub(super) marker_sd: f64,
    /// Glass in front of the mirrors.
    pub(super) glass: Option<&'a GlassSheet>,
    /// How far facets are from flat.
    pub(super) flatness: Flatness,
    /// Prior mean of w.
    pub(super) prior_mean: DVector<f64>,
    pub(super) stop: &'a Stop,
}

impl Joint<'_> {
    /// Number of shared parameters.
    pub(super) fn shared_dimension(&self) -> usize {
        self.first_common + self.common.len() + usize::from(self.glass_column().is_some())
    }

    /// Index of the glass's thickness among the shared parameters, if it is uncertain.
    pub(super) fn glass_column(&self) -> Option<usize> {
        let glass = self.glass.filter(|glass| glass.thickness_sd_mm > 0.0);
        glass.map(|_| self.first_common + self.common.len())
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

    /// 1σ of an element's deviation from its facet's plane; 0 for an undeflected beam.
    pub(super) fn deviation(&self, element: &JointElement) -> f64 {
        if element.facet.is_some() {
            self.flatness.tau
        } else {
            0.0
        }
    }

    /// A group's own parameters with the given planes, and boards as tracked.
    pub(super) fn start(group: &Group, planes: &[MirrorPlane]) -> Point {
        let mut blocks = Vec::new();
        for facet in &group.facets {
            let plane = &planes[facet.facet];
            blocks.push(ParameterBlock::Direction(plane.normal));
            blocks.push(ParameterBlock::Vector(DVector::from_element(1, plane.offset)));
            blocks.push(ParameterBlock::Vector(DVector::zeros(FIGURE)));
        }
        blocks.push(ParameterBlock::Vector(DVector::zeros(
            group.boards.len() * BOARD_ERRORS,
        )));
        Point { blocks }
    }
}
