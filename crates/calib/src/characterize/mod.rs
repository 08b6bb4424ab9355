//! Step 1: the range errors of the bare sensor, from boards in front of beams that nothing deflects.
//!
//! Every mean of a beam over a tracked board is one equation, and all of them are solved together by generalized least
//! squares,
//!
//! ```text
//! z − s(mounting) = E_r(s) + E_a(θ_N) + E_c(s) + drift + board + noise,
//! ```
//!
//! for the mounting of the sensor (with the drawing's tolerance as prior) and the numbers of Eqs. (3)–(5). The errors
//! that the readings of one board share, its drift and its markers', enter the weights; the stated standard deviations
//! are therefore honest. What the boards cannot separate is not solved for, and is reported.
//!
//! Two numbers that no data can separate are settled by convention: with a test of the distance, or without any test at
//! all, E_r holds the error at normal incidence and B_a = −A_a; with a test of the angle alone, E_r is 0 and B_a is
//! free. E_c is relative to the color in which the distance was tested.

mod adjust;
mod angle;
mod design;
mod noise;
mod rows;
mod spot;

use crate::error::CalibError;
use crate::mount::mount_data::{DirectBoard, Selection, Selector};
use crate::mount::pose;
use crate::prepare::check_session;
use crate::readings::locate;
use adjust::{Adjustment, RigPrior, adjust};
use catoptric_model::characterization::{
    Characterization, Fit, Law, Parameter, SCHEMA_VERSION, Scatter, StretchRow,
};
use catoptric_model::{AngleTable, Dataset, Pose, RangeBias};
use design::{Design, Term};
use nalgebra::{DMatrix, Matrix2, Vector2};
use std::collections::BTreeMap;

/// Largest bias that a reading of a board may have, in meters; beyond it, the reading is of another surface.
const LARGEST_BIAS: f64 = 0.5;

/// Maximum number of rounds of selecting beams and adjusting.
const MAX_ROUNDS: usize = 12;

/// Characterizes the sensor of a recorded experiment.
///
/// Boards with a note on the test they belong to make the tables; boards that were set up to find the mounting also
/// enter the fit.
///
/// # Errors
/// [`CalibError`] if the parts of the dataset are inconsistent or no board was read by a beam that nothing deflects.
///
/// ```
/// use catoptric_calib::{CalibError, characterize};
/// use catoptric_model::Dataset;
///
/// fn cosine_gain_mm(dataset: &Dataset) -> Result<Option<f64>, CalibError> {
///     let found = characterize(dataset)?;
///     Ok(found.parameter("A_a", None).map(|p| p.value))
/// }
/// ```
pub fn characterize(dataset: &Dataset) -> Result<Characterization, CalibError> {
    dataset.check()?;
    let session = &dataset.session;
    check_session(session)?;
    let summaries = locate::summaries(dataset)?;
    let none = RangeBias::default();
    let selector = Selector::new(dataset, &summaries).with_bias(&none, LARGEST_BIAS);
    let prior = RigPrior::of(session);
    let mut stage = Selection::initial(&session.mount_tolerance);
    let mut mount = Pose::from(&session.nominal_rig_from_sensor);
    let select = |mount: &Pose, stage: &Selection| {
        let mut boards = selector.select(mount, stage);
        for board in &mut boards {
            board.pool_noise(&summaries[board.pose]);
        }
        boards
    };
    let read = |chosen: &[DirectBoard], mount: &Pose| rows::of(dataset, &summaries, &selector, chosen, mount);
    let mut chosen = select(&mount, &stage);
    let mut design = Design::of(&read(&chosen, &mount), session);
    for _ in 0..MAX_ROUNDS {
        mount = adjust(&selector, &chosen, &design, &prior, &mount)?.rig_from_sensor;
        stage = stage.narrower();
        let next = select(&mount, &stage);
        let settled = stage.is_narrowest() && pose::same_beams(&next, &chosen);
        chosen = next;
        design = Design::of(&read(&chosen, &mount), session);
        if settled {
            break;
        }
    }
    let law = adjust(&selector, &chosen, &design, &prior, &mount)?;
    let stretches = read(&chosen, &law.rig_from_sensor);
    let table = angle::tabulate(&design, &law, &stretches, |tabulated| {
        adjust(&selector, &chosen, tabulated, &prior, &law.rig_from_sensor)
    })?;
    let mut bias = design.bias(&law.values);
    if let Some(table) = table.as_ref().filter(|t| t.fit.is_rejected()) {
        bias.angle.table = Some(AngleTable {
            incidence_deg: table.rows.iter().map(|r| r.incidence_deg).collect(),
            error_mm: table.rows.iter().map(|r| r.misfit_mm).collect(),
        });
    }
    let spots = spot::rows(dataset, &law.rig_from_sensor);
    Ok(Characterization {
        schema_version: SCHEMA_VERSION,
        name: session.name.clone(),
        spot_law: spot::law(&spots),
        spots,
        trial_scatter: trial_scatter(&stretches, &bias),
        bias,
        parameters: parameters(&design, &law),
        covariance: law
            .covariance
            .row_iter()
            .map(|r| r.iter().copied().collect())
            .collect(),
        not_observed: design.omitted.clone(),
        distance_line: distance_line(&design, &law),
        angle_misfit: table.as_ref().map(|t| t.rows.clone()).unwrap_or_default(),
        angle_law: table.map(|t| t.fit),
        noise: noise::table(dataset, &summaries, &selector, &chosen, &law.rig_from_sensor),
        stretches,
        fit: law.fit,
        rig_from_sensor: law.mount(),
    })
}

fn parameters(design: &Design, law: &Adjustment) -> Vec<Parameter> {
    let each = design.terms.iter().enumerate();
    each.map(|(i, term)| Parameter {
        symbol: term.symbol().to_owned(),
        color: design.color(term).map(str::to_owned),
        distance_m: match term {
            Term::Distance(node) => Some(design.nodes[*node]),
            _ => None,
        },
        unit: term.unit().to_owned(),
        value: law.values[i],
        sd: law.covariance[(i, i)].sqrt(),
    })
    .collect()
}

/// The line through E_r at its distances, weighted by their full covariance: Eq. (5) as the paper fits it.
fn distance_line(design: &Design, law: &Adjustment) -> Option<Law> {
    let n = design.nodes.len();
    if n < 3 {
        return None;
    }
    let inverse = law.covariance.view((0, 0), (n, n)).into_owned().try_inverse()?;
    let columns = DMatrix::from_fn(
        n,
        2,
        |row, column| if column == 0 { design.nodes[row] } else { 1.0 },
    );
    let values = law.values.rows(0, n).into_owned();
    let weighted = columns.transpose() * &inverse;
    let normal: Matrix2<f64> = (&weighted * &columns).fixed_view::<2, 2>(0, 0).into_owned();
    let covariance = normal.try_inverse()?;
    let right: Vector2<f64> = (&weighted * &values).fixed_rows::<2>(0).into_owned();
    let line = covariance * right;
    let left = values - columns * line;
    Some(Law {
        slope_mm_per_m: line[0],
        offset_mm: line[1],
        covariance: [
            [covariance[(0, 0)], covariance[(0, 1)]],
            [covariance[(0, 1)], covariance[(1, 1)]],
        ],
        fit: Fit {
            chi_squared: left.dot(&(&inverse * &left)),
            degrees_of_freedom: n - 2,
        },
    })
}

/// Pooled scatter of the residuals of the trials of one setting.
fn trial_scatter(rows: &[StretchRow], bias: &RangeBias) -> Option<Scatter> {
    let mut settings: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for row in rows {
        if let Some(setting) = row.setting {
            let cos = libm::cos(row.incidence_deg.to_radians());
            let model = bias.terms(row.distance_m, cos, &row.color).total() * 1e3;
            settings
                .entry(setting)
                .or_default()
                .push(row.mean_error_mm - model);
        }
    }
    let (mut squares, mut freedom) = (0.0, 0);
    for left in settings.values() {
        let mean = left.iter().sum::<f64>() / left.len() as f64;
        squares += left.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
        freedom += left.len() - 1;
    }
    (freedom > 0).then(|| Scatter {
        sd_mm: (squares / freedom as f64).sqrt(),
        degrees_of_freedom: freedom,
    })
}
