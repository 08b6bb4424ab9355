//! Grouped problems: elimination gives the same as the dense matrix, at the size of a joint calibration.

use super::flat::Flat;
use super::sample::Sample;
use catoptric_calib::lsq::{
    GroupJacobian, GroupedResiduals, ParameterBlock, Point, Prior, Reduced, Residuals, SolverOptions, State,
    WithPriors, linearize, minimize,
};
use catoptric_model::Pose;
use nalgebra::{DMatrix, DVector, Translation3, Unit, UnitQuaternion, Vector3};

/// Range from a mounted sensor along known rays to planes whose tilt and offset have errors of their own, with a drift.
///
/// Shared: the mounting (SE(3)), one facet's normal (S²), range bias and scale (R²). Own: offset, tilts, drift (R⁴).
struct Boards {
    boards: Vec<Board>,
    noise_sd: f64,
}

struct Board {
    point: Vector3<f64>,
    normal: Vector3<f64>,
    tilts: [Vector3<f64>; 2],
    rays: Vec<Vector3<f64>>,
    ranges: Vec<f64>,
}

impl Boards {
    fn range(board: &Board, ray: &Vector3<f64>, shared: &Point, own: &Point) -> Option<f64> {
        let (mount, facet) = (shared.pose(0)?, shared.direction(1)?);
        let (bias, e) = (shared.numbers(2)?, own.numbers(0)?);
        let mirrored = ray - facet.into_inner() * (2.0 * facet.dot(ray));
        let direction = mount.rotation * mirrored;
        let normal = board.normal + board.tilts[0] * e[1] + board.tilts[1] * e[2];
        let point = board.point + board.normal * e[0];
        let range = normal.dot(&(point - mount.translation.vector)) / normal.dot(&direction);
        (range > 0.0).then_some(range * (1.0 + bias[1]) + bias[0] + e[3])
    }

    /// A difference of fourth order, with an error of some 1e-12.
    fn derivative(at: impl Fn(f64) -> Option<f64>) -> Option<f64> {
        let h = 1e-3;
        Some((8.0 * (at(h)? - at(-h)?) - (at(2.0 * h)? - at(-2.0 * h)?)) / (12.0 * h))
    }

    fn simulated(count: usize, rays: usize, sample: &mut Sample) -> (Self, State) {
        let mount = Pose::from_parts(
            Translation3::new(0.05, -0.02, 0.1),
            UnitQuaternion::from_scaled_axis(Vector3::new(0.02, -0.03, 0.01)),
        );
        let facet = Unit::new_normalize(Vector3::new(-0.6, 0.1, 0.75));
        let shared = Point {
            blocks: vec![
                ParameterBlock::Pose(mount),
                ParameterBlock::Direction(facet),
                ParameterBlock::Vector(DVector::from_vec(vec![0.004, 0.001])),
            ],
        };
        let (noise_sd, mut own, mut boards) = (0.001, Vec::new(), Vec::new());
        for _ in 0..count {
            let mut normal = || Vector3::new(sample.normal(), sample.normal(), sample.normal());
            let straight = mount.rotation
                * (Vector3::x() - facet.into_inner() * (2.0 * facet.x) + normal() * 0.1).normalize();
            let facing = (straight + normal() * 0.4).normalize();
            let (across, up) = catoptric_model::frame::tangent_basis(&Unit::new_normalize(facing));
            let point = mount.translation.vector + straight * (1.0 + 2.0 * sample.uniform());
            let errors = [0.0005, 0.001, 0.001, 0.001].map(|sd| sd * sample.normal());
            let mine = Point::vector(&errors);
            let mut board = Board {
                point,
                normal: facing,
                tilts: [across.into_inner(), up.into_inner()],
                rays: Vec::new(),
                ranges: Vec::new(),
            };
            for _ in 0..rays {
                let angle = 0.3 * (sample.uniform() - 0.5);
                let (sin, cos) = libm::sincos(angle);
                let ray = Vector3::new(cos, sin, 0.0);
                if let Some(range) = Self::range(&board, &ray, &shared, &mine)
                    && range < 4.0
                {
                    board.rays.push(ray);
                    board.ranges.push(range + noise_sd * sample.normal());
                }
            }
            boards.push(board);
            own.push(mine);
        }
        (Self { boards, noise_sd }, State { shared, own })
    }

    fn with_priors(&self) -> WithPriors<'_, Self> {
        let own = Prior::independent(
            0,
            ParameterBlock::Vector(DVector::zeros(4)),
            &[0.0005, 0.001, 0.001, 0.001],
        );
        let mount = Prior::independent(
            0,
            ParameterBlock::Pose(Pose::identity()),
            &[0.2, 0.2, 0.2, 0.1, 0.1, 0.1],
        );
        WithPriors {
            problem: self,
            shared: vec![mount],
            own: vec![vec![own]; self.boards.len()],
        }
    }
}

impl GroupedResiduals for Boards {
    fn groups(&self) -> usize {
        self.boards.len()
    }

    fn residuals(&self, group: usize, shared: &Point, own: &Point) -> Option<DVector<f64>> {
        let board = &self.boards[group];
        let rows: Option<Vec<f64>> = board
            .rays
            .iter()
            .zip(&board.ranges)
            .map(|(ray, z)| Some((Self::range(board, ray, shared, own)? - z) / self.noise_sd))
            .collect();
        Some(DVector::from_vec(rows?))
    }

    fn jacobian(&self, group: usize, shared: &Point, own: &Point) -> Option<GroupJacobian> {
        let board = &self.boards[group];
        let mut parts = GroupJacobian {
            shared: DMatrix::zeros(board.rays.len(), shared.dimension()),
            own: DMatrix::zeros(board.rays.len(), own.dimension()),
        };
        for (i, ray) in board.rays.iter().enumerate() {
            for j in 0..shared.dimension() {
                let at = |h: f64| {
                    let mut step = vec![0.0; shared.dimension()];
                    step[j] = h;
                    Self::range(board, ray, &shared.retract(&step), own)
                };
                parts.shared[(i, j)] = Self::derivative(at)? / self.noise_sd;
            }
            for j in 0..own.dimension() {
                let at = |h: f64| {
                    let mut step = vec![0.0; own.dimension()];
                    step[j] = h;
                    Self::range(board, ray, shared, &own.retract(&step))
                };
                parts.own[(i, j)] = Self::derivative(at)? / self.noise_sd;
            }
        }
        Some(parts)
    }
}

fn start(truth: &State) -> State {
    let mut shared = truth.shared.clone();
    shared.blocks[0] = ParameterBlock::Pose(Pose::identity());
    shared.blocks[1] = shared.blocks[1].retract(&[0.05, -0.04]);
    shared.blocks[2] = ParameterBlock::Vector(DVector::zeros(2));
    State {
        shared,
        own: vec![Point::vector(&[0.0; 4]); truth.own.len()],
    }
}

#[test]
fn elimination_agrees_with_the_dense_matrix() {
    let (boards, truth) = Boards::simulated(12, 10, &mut Sample::new(8));
    let problem = boards.with_priors();
    let options = SolverOptions::default();
    let grouped = minimize(&problem, start(&truth), &options).expect("the residuals are defined");
    let (flat, at) = Flat::new(&problem, &start(&truth));
    let dense = minimize(&flat, at, &options).expect("the residuals are defined");
    assert!(grouped.stop.converged() && dense.stop.converged());
    let state = flat.state(&dense.state.shared);
    let blocks = |s: &State| Flat::new(&problem, s).1.blocks;
    for (a, b) in blocks(&grouped.state).iter().zip(blocks(&state)) {
        assert!(a.difference(&b).norm() < 1e-10, "{a:?} {b:?}");
    }
    assert!((grouped.sum_of_squares / dense.sum_of_squares - 1.0).abs() < 1e-10);
    let covariances = [&grouped, &dense].map(|s| s.information.covariance().expect("priors hold all"));
    let scale = covariances[1].diagonal().map(f64::sqrt);
    for i in 0..scale.len() {
        for j in 0..scale.len() {
            let difference = covariances[0][(i, j)] - covariances[1][(i, j)];
            assert!(difference.abs() < 1e-8 * scale[i] * scale[j], "{i} {j}");
        }
    }
}

#[test]
fn the_step_along_a_combination_is_the_most_probable_change_by_one_sd() {
    let (boards, truth) = Boards::simulated(6, 12, &mut Sample::new(11));
    let problem = boards.with_priors();
    let found =
        minimize(&problem, start(&truth), &SolverOptions::default()).expect("the residuals are defined");
    let covariance = found.information.covariance().expect("priors hold all");
    let mut sample = Sample::new(12);
    let g = DVector::from_fn(covariance.nrows(), |_, _| sample.normal());
    let step = found.information.step_along(&g).expect("priors hold all");
    let sd = (g.transpose() * &covariance * &g)[0].sqrt();
    assert!((g.dot(&step) / sd - 1.0).abs() < 1e-9);
    assert!((step - &covariance * &g / sd).norm() < 1e-9 * (&covariance * &g / sd).norm());
    assert_eq!(found.information.step_along(&DVector::zeros(g.len())), None);
}

#[test]
fn a_covariance_within_a_group_is_that_among_all() {
    let (boards, truth) = Boards::simulated(6, 12, &mut Sample::new(13));
    let mut sample = Sample::new(14);
    let shared = DMatrix::from_fn(3, truth.shared.dimension(), |_, _| sample.normal());
    let own = DMatrix::from_fn(3, 4, |_, _| sample.normal());
    let problem = boards.with_priors();
    let found =
        minimize(&problem, start(&truth), &SolverOptions::default()).expect("the residuals are defined");
    for group in 0..boards.boards.len() {
        let mut all = DMatrix::zeros(3, truth.dimension());
        all.columns_mut(0, shared.ncols()).copy_from(&shared);
        all.columns_mut(shared.ncols() + 4 * group, 4).copy_from(&own);
        let among = found.information.covariance_of(&all).expect("priors hold all");
        let within = found
            .information
            .covariance_within(group, &shared, &own)
            .expect("priors hold all");
        assert!((within - &among).norm() < 1e-12 * among.norm(), "group {group}");
    }
    // Without priors each drift is indistinguishable from its board's offset and the bias.
    let options = SolverOptions {
        max_evaluations: 1,
        rank_threshold: 1e-8,
        ..SolverOptions::default()
    };
    let open = minimize(&boards, truth, &options).expect("the residuals are defined");
    assert_eq!(open.information.covariance_within(0, &shared, &own), None);
}

#[test]
fn a_reduced_problem_changes_like_the_whole_one() {
    let (boards, truth) = Boards::simulated(6, 12, &mut Sample::new(15));
    // The boards are at the means of their priors.
    let at = start(&truth);
    let whole = linearize(&boards.with_priors(), &at).expect("the residuals are defined");
    let without = WithPriors {
        own: Vec::new(),
        ..boards.with_priors()
    };
    let reduced = Reduced::new(&without, &at).expect("the residuals are defined");
    let mut weights = DVector::zeros(at.dimension());
    for (i, weight) in weights.iter_mut().skip(at.shared.dimension()).enumerate() {
        *weight = 1.0 / [0.0005, 0.001, 0.001, 0.001][i % 4];
    }
    // In other units a prior is converted as well, and nothing but the units changes.
    let factors = DVector::from_fn(at.dimension(), |i, _| 0.5 + (i % 3) as f64);
    let changed = reduced.changed(&factors, &weights.component_mul(&factors));
    let units: f64 = factors.iter().map(|f| 2.0 * libm::log(*f)).sum();
    assert!((changed.deviance() - units - whole.deviance()).abs() < 1e-9 * whole.deviance().abs());
    let step = changed.step.component_mul(&factors);
    assert!((&step - &whole.step).norm() < 1e-8 * whole.step.norm());
    let sd = |d: Vec<Option<f64>>| DVector::from_iterator(d.len(), d.into_iter().map(|s| s.unwrap_or(-1.0)));
    let whole_sd = sd(whole.information.standard_deviations());
    let ratio = sd(changed.information.standard_deviations())
        .component_mul(&factors)
        .component_div(&whole_sd);
    assert!(whole_sd.iter().all(|s| *s > 0.0) && ratio.iter().all(|r| (r - 1.0).abs() < 1e-8));
}

#[test]
fn open_directions_of_a_group_agree_with_the_dense_matrix() {
    // Without priors a rotation of the facet is indistinguishable from one of the mounting, and each drift from its
    // board's offset and the bias.
    let (boards, truth) = Boards::simulated(6, 12, &mut Sample::new(9));
    let options = SolverOptions {
        max_evaluations: 1,
        // The derivatives have an error of some 1e-12.
        rank_threshold: 1e-8,
        ..SolverOptions::default()
    };
    let grouped = minimize(&boards, truth.clone(), &options).expect("the residuals are defined");
    let (flat, at) = Flat::new(&boards, &truth);
    let dense = minimize(&flat, at, &options).expect("the residuals are defined");
    let (a, b) = (grouped.information.null_space(), dense.information.null_space());
    assert_eq!(grouped.information.rank(), dense.information.rank());
    assert!(
        a.ncols() >= 4,
        "the facet's turns and the biases at least: {}",
        a.ncols()
    );
    // One space: the projectors are equal.
    let difference = a * a.transpose() - b * b.transpose();
    assert!(difference.norm() < 1e-5, "{}", difference.norm());
    for vector in a.column_iter() {
        let image = Residuals::jacobian(&flat, &Flat::new(&boards, &grouped.state).1)
            .expect("the residuals are defined")
            * vector;
        assert!(image.norm() < 1e-6, "{}", image.norm());
    }
}

#[test]
fn estimates_of_a_whole_session_have_honest_covariances() {
    // 60 boards of 160 readings: 9600 residuals, 10 shared and 240 own parameters.
    let (boards, truth) = Boards::simulated(60, 160, &mut Sample::new(10));
    let problem = boards.with_priors();
    let found =
        minimize(&problem, start(&truth), &SolverOptions::default()).expect("the residuals are defined");
    assert!(
        found.stop.converged() && found.iterations < 30,
        "{}",
        found.iterations
    );
    let shared: Vec<usize> = (0..truth.shared.dimension()).collect();
    let covariance = found
        .information
        .covariance_among(&shared)
        .expect("priors hold all");
    let error: Vec<f64> = found
        .state
        .shared
        .blocks
        .iter()
        .zip(&truth.shared.blocks)
        .flat_map(|(a, b)| b.difference(a).as_slice().to_vec())
        .collect();
    let error = DVector::from_vec(error);
    let squared = error.dot(
        &covariance
            .cholesky()
            .expect("the matrix is regular")
            .solve(&error),
    );
    // χ² of 10 degrees of freedom: 99.9 % between 1.26 and 31.4.
    assert!(squared > 1.26 && squared < 31.4, "{squared}");
    // The degrees of freedom of residuals and priors together equal the number of readings plus 6 for a prior.
    let readings: usize = boards.boards.iter().map(|b| b.rays.len()).sum();
    let freedom = (readings + 6 - 10) as f64;
    assert_eq!(found.degrees_of_freedom(), readings + 6 - 10);
    assert!((found.sum_of_squares / freedom - 1.0).abs() < 4.0 * (2.0 / freedom).sqrt());
}
