//! A tracked body: its data from the session, the pose solved from its markers, and the limits of random marker errors.

use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::session::Marker;
use catoptric_model::{Pose, PoseRecord, Session, tracking};
use nalgebra::Point3;

/// Standard normal deviate of the limits: exceeded at random once in 10⁹.
const SIGMAS: f64 = 6.0;

/// A tracked body, by the session.
pub(super) struct Body<'a> {
    pub(super) subject: &'a str,
    pub(super) markers: &'a [Marker],
    pub(super) template: Vec<Point3<f64>>,
}

/// The rig, or the board that was set up; other bodies are not used here.
pub(super) fn body<'a>(session: &'a Session, record: &PoseRecord, subject: &str) -> Option<Body<'a>> {
    let (subject, markers) = if subject == RIG_SUBJECT {
        (RIG_SUBJECT, &session.rig_markers)
    } else if record.label.board.as_deref() == Some(subject) {
        let sheet = session.board(subject)?;
        (sheet.name.as_str(), &sheet.markers)
    } else {
        return None;
    };
    Some(Body {
        subject,
        markers,
        template: markers.iter().map(Marker::position).collect(),
    })
}

/// Name of a body in messages.
pub(super) fn name_of(subject: &str) -> String {
    if subject == RIG_SUBJECT {
        "the rig".to_owned()
    } else {
        format!("board {subject:?}")
    }
}

/// The pose of a body, and the squared distance of each marker from its place at that pose.
pub(super) fn solved(template: &[Point3<f64>], seen: &[Option<Point3<f64>>]) -> Option<(Pose, Vec<f64>)> {
    let pose = tracking::solve_pose(template, seen)?;
    let off = template.iter().zip(seen);
    let squares = off.map(|(t, s)| s.map_or(0.0, |s| (s - pose * t).norm_squared()));
    Some((pose, squares.collect()))
}

/// χ² that is exceeded at random once in 10⁹ (Wilson and Hilferty 1931).
pub(super) fn limit(degrees_of_freedom: usize) -> f64 {
    let n = degrees_of_freedom as f64;
    let root = 1.0 - 2.0 / (9.0 * n) + SIGMAS * (2.0 / (9.0 * n)).sqrt();
    n * root * root * root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_six_sigma() {
        // Exact quantiles at an upper tail of 0.987e-9, from the closed form for even degrees of freedom.
        for (n, exact) in [(6, 53.373_68), (10, 62.976_24), (40, 118.721_77)] {
            let over = limit(n) / exact;
            assert!((1.0..1.07).contains(&over), "{n} degrees of freedom: {over}");
        }
    }
}
