//! Parameters that are not plain numbers: unit vectors, rotations, poses, and how a small step moves them.
//!
//! A block x has a tangent space of its dimension, a retraction x ⊞ δ and its inverse y ⊟ x (Hertzberg et al. 2013; Solà,
//! Deray, Atchuthan 2018; Barfoot 2017). Steps are about a block's own axes:
//!
//! ```text
//! Rⁿ     x ⊞ δ = x + δ
//! S²     n ⊞ δ = cos|δ|·n + sin|δ|·Bδ/|δ|,  B = (e₁ e₂) the tangent basis at n
//! SO(3)  R ⊞ ω = R·Exp(ω)
//! SE(3)  (t, R) ⊞ (τ, ω) = (t + Rτ, R·Exp(ω)),  as the mounting of the sensor moves
//! ```

use catoptric_model::{Pose, frame};
use nalgebra::{DMatrix, DVector, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};

/// Rotation angle, in radians, below which a series replaces a quotient of small numbers.
const SMALL_TURN: f64 = 1e-4;

/// One parameter block.
#[derive(Debug, Clone, PartialEq)]
pub enum ParameterBlock {
    /// Numbers, Rⁿ.
    Vector(DVector<f64>),
    /// A unit vector, S²; two radians.
    Direction(Unit<Vector3<f64>>),
    /// A rotation, SO(3); three radians.
    Rotation(UnitQuaternion<f64>),
    /// A pose, SE(3); three meters, then three radians.
    Pose(Pose),
}

/// A list of parameter blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The blocks; tangent coordinates are in the same order.
    pub blocks: Vec<ParameterBlock>,
}

impl ParameterBlock {
    /// Dimension of the tangent space.
    pub fn dimension(&self) -> usize {
        match self {
            Self::Vector(x) => x.len(),
            Self::Direction(_) => 2,
            Self::Rotation(_) => 3,
            Self::Pose(_) => 6,
        }
    }

    /// x ⊞ δ.
    ///
    /// # Panics
    ///
    /// If the step has another dimension.
    pub fn retract(&self, step: &[f64]) -> Self {
        assert_eq!(
            step.len(),
            self.dimension(),
            "a step has the dimension of its block"
        );
        match self {
            Self::Vector(x) => Self::Vector(x + DVector::from_column_slice(step)),
            Self::Direction(n) => {
                let (first, second) = frame::tangent_basis(n);
                let along = first.into_inner() * step[0] + second.into_inner() * step[1];
                let turn = libm::hypot(step[0], step[1]);
                let (sin, cos) = libm::sincos(turn);
                let moved = n.into_inner() * cos + along * if turn > 0.0 { sin / turn } else { 1.0 };
                Self::Direction(Unit::new_normalize(moved))
            }
            Self::Rotation(r) => Self::Rotation(turned(r, &step[..3])),
            Self::Pose(pose) => Self::Pose(Pose::from_parts(
                Translation3::from(
                    pose.translation.vector + pose.rotation * Vector3::new(step[0], step[1], step[2]),
                ),
                turned(&pose.rotation, &step[3..]),
            )),
        }
    }

    /// y ⊟ x, the shortest step from this block to another: x ⊞ (y ⊟ x) = y.
    ///
    /// # Panics
    ///
    /// If the blocks are of different kinds or dimensions.
    pub fn difference(&self, to: &Self) -> DVector<f64> {
        match (self, to) {
            (Self::Vector(x), Self::Vector(y)) if x.len() == y.len() => y - x,
            (Self::Direction(n), Self::Direction(m)) => {
                let (first, second) = frame::tangent_basis(n);
                let (x, y) = (first.dot(m), second.dot(m));
                let sin = libm::hypot(x, y);
                let turn = libm::atan2(sin, n.dot(m));
                if sin > 0.0 {
                    DVector::from_vec(vec![x * turn / sin, y * turn / sin])
                } else {
                    DVector::from_vec(vec![turn, 0.0])
                }
            }
            (Self::Rotation(r), Self::Rotation(s)) => {
                DVector::from_column_slice(turn_vector(&(r.inverse() * s)).as_slice())
            }
            (Self::Pose(p), Self::Pose(q)) => {
                let between = p.inverse() * q;
                let turn = turn_vector(&between.rotation);
                DVector::from_iterator(6, between.translation.vector.iter().chain(turn.iter()).copied())
            }
            _ => panic!("a difference needs two blocks of one kind and dimension"),
        }
    }

    /// ∂((y ⊞ δ) ⊟ x)/∂δ at δ = 0, with x this block.
    ///
    /// It is the identity at y = x: S² stretches steps across the path by θ/sin θ, rotations stretch by the inverse
    /// right Jacobian of SO(3).
    ///
    /// # Panics
    ///
    /// As [`difference`](Self::difference).
    pub fn difference_jacobian(&self, to: &Self) -> DMatrix<f64> {
        let difference = self.difference(to);
        match (self, to) {
            (Self::Direction(n), Self::Direction(m)) => direction_jacobian(n, m, &difference),
            (Self::Rotation(_), Self::Rotation(_)) => {
                let inverse = inverse_right_jacobian(&Vector3::from_column_slice(difference.as_slice()));
                DMatrix::from_column_slice(3, 3, inverse.as_slice())
            }
            (Self::Pose(p), Self::Pose(q)) => {
                let between = (p.rotation.inverse() * q.rotation).to_rotation_matrix();
                let turn = Vector3::new(difference[3], difference[4], difference[5]);
                let mut all = DMatrix::zeros(6, 6);
                all.view_mut((0, 0), (3, 3)).copy_from(between.matrix());
                all.view_mut((3, 3), (3, 3))
                    .copy_from(&inverse_right_jacobian(&turn));
                all
            }
            _ => DMatrix::identity(difference.len(), difference.len()),
        }
    }

    /// Scale of each tangent coordinate, to judge whether a step is small: |x| for numbers and meters, 1 for radians.
    pub fn extent(&self) -> Vec<f64> {
        match self {
            Self::Vector(x) => x.iter().map(|v| v.abs()).collect(),
            Self::Direction(_) => vec![1.0; 2],
            Self::Rotation(_) => vec![1.0; 3],
            Self::Pose(pose) => {
                let size = pose.translation.vector.norm();
                vec![size, size, size, 1.0, 1.0, 1.0]
            }
        }
    }
}

impl Point {
    /// A point with one block of numbers.
    pub fn vector(values: &[f64]) -> Self {
        Self {
            blocks: vec![ParameterBlock::Vector(DVector::from_column_slice(values))],
        }
    }

    /// Dimension of the tangent space.
    pub fn dimension(&self) -> usize {
        self.blocks.iter().map(ParameterBlock::dimension).sum()
    }

    /// First tangent coordinate of a block.
    pub fn offset(&self, block: usize) -> usize {
        self.blocks[..block].iter().map(ParameterBlock::dimension).sum()
    }

    /// x ⊞ δ, block by block.
    ///
    /// # Panics
    ///
    /// If the step is shorter than the dimension.
    pub fn retract(&self, step: &[f64]) -> Self {
        let mut rest = step;
        let blocks = self
            .blocks
            .iter()
            .map(|block| {
                let (head, tail) = rest.split_at(block.dimension());
                rest = tail;
                block.retract(head)
            })
            .collect();
        Self { blocks }
    }

    /// Scale of each tangent coordinate; see [`ParameterBlock::extent`].
    pub fn extent(&self) -> Vec<f64> {
        self.blocks.iter().flat_map(ParameterBlock::extent).collect()
    }

    /// The numbers of a [`ParameterBlock::Vector`]; `None` if the block is of another kind or absent.
    pub fn numbers(&self, block: usize) -> Option<&DVector<f64>> {
        match self.blocks.get(block) {
            Some(ParameterBlock::Vector(values)) => Some(values),
            _ => None,
        }
    }

    /// The unit vector of a [`ParameterBlock::Direction`]; `None` if the block is of another kind or absent.
    pub fn direction(&self, block: usize) -> Option<&Unit<Vector3<f64>>> {
        match self.blocks.get(block) {
            Some(ParameterBlock::Direction(n)) => Some(n),
            _ => None,
        }
    }

    /// The rotation of a [`ParameterBlock::Rotation`]; `None` if the block is of another kind or absent.
    pub fn rotation(&self, block: usize) -> Option<&UnitQuaternion<f64>> {
        match self.blocks.get(block) {
            Some(ParameterBlock::Rotation(r)) => Some(r),
            _ => None,
        }
    }

    /// The pose of a [`ParameterBlock::Pose`]; `None` if the block is of another kind or absent.
    pub fn pose(&self, block: usize) -> Option<&Pose> {
        match self.blocks.get(block) {
            Some(ParameterBlock::Pose(pose)) => Some(pose),
            _ => None,
        }
    }
}

fn turned(r: &UnitQuaternion<f64>, step: &[f64]) -> UnitQuaternion<f64> {
    // Half the angle by libm: q = (cos ω/2, sin(ω/2)/ω·ω).
    let turn = Vector3::new(step[0], step[1], step[2]);
    let angle = turn.norm();
    let (sin, cos) = libm::sincos(0.5 * angle);
    let part = turn * if angle > 0.0 { sin / angle } else { 0.5 };
    let exponential = nalgebra::Quaternion::new(cos, part.x, part.y, part.z);
    UnitQuaternion::new_normalize(r.into_inner() * exponential)
}

/// Log: the rotation vector ω, of length π at most, whose Exp is the given rotation.
fn turn_vector(r: &UnitQuaternion<f64>) -> Vector3<f64> {
    // q and −q are the same rotation; the one with w ≥ 0 has an angle of at most π.
    let sign = if r.w < 0.0 { -1.0 } else { 1.0 };
    let part = r.imag() * sign;
    let sin = part.norm();
    if sin > 0.0 {
        part * (2.0 * libm::atan2(sin, r.w * sign) / sin)
    } else {
        part * 2.0
    }
}

/// J_r⁻¹(ω) = I + [ω]/2 + (1/θ² − cot(θ/2)/(2θ))·[ω]², [ω] the matrix of ω×.
fn inverse_right_jacobian(turn: &Vector3<f64>) -> Matrix3<f64> {
    let cross = turn.cross_matrix();
    let angle = turn.norm();
    let factor = if angle < SMALL_TURN {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        let (sin, cos) = libm::sincos(0.5 * angle);
        1.0 / (angle * angle) - cos / (sin * 2.0 * angle)
    };
    Matrix3::identity() + cross * 0.5 + cross * cross * factor
}

/// With m = cos θ·n + sin θ·e and f = n × e: a step w at m changes θe by (w·t)e + (θ/sin θ)(w·f)f, t = ∂m/∂θ.
fn direction_jacobian(
    n: &Unit<Vector3<f64>>,
    m: &Unit<Vector3<f64>>,
    difference: &DVector<f64>,
) -> DMatrix<f64> {
    let (first, second) = frame::tangent_basis(n);
    let turn = difference.norm();
    let e = if turn > 0.0 {
        (first.into_inner() * difference[0] + second.into_inner() * difference[1]) / turn
    } else {
        first.into_inner()
    };
    let (sin, cos) = libm::sincos(turn);
    let (t, f) = (e * cos - n.into_inner() * sin, n.cross(&e));
    let stretch = if turn < SMALL_TURN {
        1.0 + turn * turn / 6.0
    } else {
        turn / sin
    };
    let (to_first, to_second) = frame::tangent_basis(m);
    DMatrix::from_fn(2, 2, |row, column| {
        let axis = if row == 0 { &first } else { &second };
        let step = if column == 0 { &to_first } else { &to_second };
        axis.dot(&e) * step.dot(&t) + stretch * axis.dot(&f) * step.dot(&f)
    })
}
