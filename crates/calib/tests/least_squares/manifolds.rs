//! Properties of the retractions, and their derivatives against dual numbers.

use super::sample::Sample;
use catoptric_calib::lsq::{ParameterBlock, Point, Residuals, SolverOptions, Termination, minimize};
use catoptric_model::Pose;
use nalgebra::{DMatrix, DVector, Translation3, Unit, UnitQuaternion, Vector3};
use num_dual::{Dual64, DualNumCopy};

fn vector(sample: &mut Sample) -> Vector3<f64> {
    Vector3::new(sample.normal(), sample.normal(), sample.normal())
}

fn blocks(sample: &mut Sample) -> Vec<ParameterBlock> {
    let turn = UnitQuaternion::from_scaled_axis(vector(sample));
    vec![
        ParameterBlock::Vector(DVector::from_fn(4, |_, _| sample.normal())),
        ParameterBlock::Direction(Unit::new_normalize(vector(sample))),
        ParameterBlock::Direction(Vector3::z_axis()),
        ParameterBlock::Rotation(turn),
        ParameterBlock::Pose(Pose::from_parts(Translation3::from(vector(sample)), turn)),
    ]
}

fn step(sample: &mut Sample, block: &ParameterBlock, size: f64) -> DVector<f64> {
    // No rotation by half a circle or more: there the shortest step is another one.
    let step = DVector::from_fn(block.dimension(), |_, _| sample.normal());
    &step * (size / step.norm())
}

fn distance(a: &ParameterBlock, b: &ParameterBlock) -> f64 {
    a.difference(b).norm()
}

#[test]
fn retraction_and_difference_undo_each_other() {
    let mut sample = Sample::new(2);
    for _ in 0..40 {
        for block in blocks(&mut sample) {
            let zero = vec![0.0; block.dimension()];
            assert!(distance(&block, &block.retract(&zero)) < 1e-15);
            for size in [1e-9, 1e-3, 1.0, 3.0] {
                let step = step(&mut sample, &block, size);
                let moved = block.retract(step.as_slice());
                assert!(
                    (block.difference(&moved) - &step).norm() < 1e-13,
                    "{block:?} {step}"
                );
                // In the other direction: x ⊞ (y ⊟ x) = y.
                let again = block.retract(block.difference(&moved).as_slice());
                assert!(distance(&moved, &again) < 1e-13);
                let back = moved.difference(&block);
                if !matches!(block, ParameterBlock::Pose(_)) {
                    assert!((back.norm() - step.norm()).abs() < 1e-13);
                }
            }
        }
    }
}

#[test]
fn the_difference_is_smooth_and_its_derivative_is_right() {
    let mut sample = Sample::new(3);
    for _ in 0..20 {
        for block in blocks(&mut sample) {
            for size in [0.0_f64, 1e-6, 1e-3, 0.8, 2.5] {
                let other = block.retract(step(&mut sample, &block, size.max(1e-300)).as_slice());
                let exact = block.difference_jacobian(&other);
                for column in 0..block.dimension() {
                    let h = 1e-5;
                    let shift = |h: f64| {
                        let mut step = vec![0.0; block.dimension()];
                        step[column] = h;
                        block.difference(&other.retract(&step))
                    };
                    let central = (shift(h) - shift(-h)) / (2.0 * h);
                    assert!(
                        (exact.column(column) - central).norm() < 1e-8,
                        "{block:?} {size} {column}"
                    );
                }
            }
        }
    }
}

/// R(ω)·p by Rodrigues' formula, for numbers and dual numbers.
fn rotated<D: DualNumCopy<Primitive = f64>>(turn: [D; 3], p: [D; 3]) -> [D; 3] {
    let squared = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2];
    // sin θ/θ and (1 − cos θ)/θ² as series, smooth at 0.
    let first = squared * squared / 120.0 - squared / 6.0 + 1.0;
    let second = squared * squared / 720.0 - squared / 24.0 + 0.5;
    let cross = |a: [D; 3], b: [D; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let once = cross(turn, p);
    let twice = cross(turn, once);
    [0, 1, 2].map(|i| p[i] + first * once[i] + second * twice[i])
}

#[test]
fn dual_numbers_agree_with_the_steps_of_each_block() {
    // d(x ⊞ δ)/dδ of a point that the block transforms: dual numbers through the formula of the retraction, against
    // differences through `retract`.
    let mut sample = Sample::new(4);
    for _ in 0..20 {
        let (p, t) = (vector(&mut sample), vector(&mut sample));
        let r = UnitQuaternion::from_scaled_axis(vector(&mut sample));
        let pose = ParameterBlock::Pose(Pose::from_parts(Translation3::from(t), r));
        let carried = |step: &[f64]| match pose.retract(step) {
            ParameterBlock::Pose(pose) => pose * nalgebra::Point3::from(p),
            other => panic!("{other:?} is not a pose"),
        };
        for varied in 0..6 {
            let dual = |i: usize| Dual64::new(0.0, if i == varied { 1.0 } else { 0.0 });
            let turned = rotated([dual(3), dual(4), dual(5)], [p.x, p.y, p.z].map(Dual64::from));
            // Body-frame point plus body-frame shift, then rotated into the world by R.
            let inner = Vector3::new(
                turned[0].eps + dual(0).eps,
                turned[1].eps + dual(1).eps,
                turned[2].eps + dual(2).eps,
            );
            let exact = r * inner;
            let h = 1e-5;
            let mut step = [0.0; 6];
            step[varied] = h;
            let ahead = carried(&step);
            step[varied] = -h;
            let central = (ahead - carried(&step)) / (2.0 * h);
            assert!((exact - central).norm() < 1e-9 * (1.0 + exact.norm()));
        }
    }
}

/// Points and a direction observed from an unknown pose, q = T⁻¹·p.
struct Seen {
    points: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl Residuals for Seen {
    fn residuals(&self, at: &Point) -> Option<DVector<f64>> {
        let pose = at.pose(0)?;
        let rows = self.points.iter().flat_map(|(p, q)| {
            let r = pose.inverse_transform_point(&nalgebra::Point3::from(*p)).coords - q;
            [r.x, r.y, r.z]
        });
        Some(DVector::from_iterator(3 * self.points.len(), rows))
    }

    fn jacobian(&self, at: &Point) -> Option<DMatrix<f64>> {
        let pose = at.pose(0)?;
        let mut all = DMatrix::zeros(3 * self.points.len(), 6);
        for (i, (p, _)) in self.points.iter().enumerate() {
            // (T ⊞ δ)⁻¹p = Exp(−ω)(q − τ): d = −τ + q × ω.
            let q = pose.inverse_transform_point(&nalgebra::Point3::from(*p)).coords;
            all.view_mut((3 * i, 0), (3, 3))
                .copy_from(&-nalgebra::Matrix3::identity());
            all.view_mut((3 * i, 3), (3, 3)).copy_from(&q.cross_matrix());
        }
        Some(all)
    }
}

#[test]
fn a_pose_is_found_from_any_rotation() {
    let mut sample = Sample::new(5);
    for _ in 0..30 {
        let truth = Pose::from_parts(
            Translation3::from(vector(&mut sample)),
            UnitQuaternion::from_scaled_axis(vector(&mut sample) * 2.0),
        );
        let points = (0..5)
            .map(|_| {
                let p = vector(&mut sample);
                (
                    p,
                    truth.inverse_transform_point(&nalgebra::Point3::from(p)).coords,
                )
            })
            .collect();
        let start = Point {
            blocks: vec![ParameterBlock::Pose(Pose::identity())],
        };
        let found =
            minimize(&Seen { points }, start, &SolverOptions::default()).expect("the residuals are defined");
        let error = found.state.shared.blocks[0]
            .difference(&ParameterBlock::Pose(truth))
            .norm();
        assert!(
            error < 1e-12 && found.stop != Termination::Limit,
            "{error} {:?}",
            found.stop
        );
    }
}
