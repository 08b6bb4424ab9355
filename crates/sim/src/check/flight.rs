//! Checks of flights: increasing times, at least one whole scan, unambiguous turns, and a trajectory inside the room.

use super::experiment::{outside, room_extent};
use super::values::distinct;
use crate::build::structure;
use crate::build::trajectory::{self, Trajectory};
use crate::findings::Findings;
use crate::scene::facet::outline::rounded;
use crate::scene::{Flight, Scene};
use catoptric_model::ScanGeometry;
use catoptric_model::place::Path;
use nalgebra::{Point3, Vector3};

/// The turn between two waypoints must be this much less than half a turn, in degrees; there both arcs are equally
/// short.
const HALF_TURN_MARGIN_DEG: f64 = 1.0;

/// Number of steps between two waypoints at which the trajectory is examined.
const STEPS: u32 = 32;

pub(super) fn check(scene: &Scene, scan: &ScanGeometry, found: &mut Findings) {
    let flights = Path::of("flight");
    distinct(&flights, scene.flight.iter().map(|f| f.name.as_str()), found);
    for (i, flight) in scene.flight.iter().enumerate() {
        let path = flights.index(i);
        let before = found.0.len();
        check_times(flight, &path, found);
        check_turns(flight, &path, found);
        if found.0.len() == before {
            check_scans(scan, flight, &path, found);
            if scene.room.has_walls() {
                check_trajectory(scene, scan, flight, &path, found);
            }
        }
    }
}

fn check_times(flight: &Flight, path: &Path, found: &mut Findings) {
    let waypoints = path.key("waypoint");
    if flight.waypoint.len() < 2 {
        found.add(
            &waypoints,
            format_args!(
                "has {} entries; a flight goes from one waypoint to another",
                flight.waypoint.len()
            ),
            "at least 2 are needed; a rig that hovers has the same pose twice".to_owned(),
        );
    }
    for (i, pair) in flight.waypoint.windows(2).enumerate() {
        if pair[1].time_s <= pair[0].time_s {
            found.add(
                &waypoints.index(i + 1).key("time_s"),
                format_args!(
                    "is {} s, not more than the {} s before it",
                    pair[1].time_s, pair[0].time_s
                ),
                "times must be strictly increasing".to_owned(),
            );
        }
    }
}

fn check_turns(flight: &Flight, path: &Path, found: &mut Findings) {
    for (i, pair) in flight.waypoint.windows(2).enumerate() {
        let [from, to] = [&pair[0], &pair[1]].map(|w| trajectory::pose(w).rotation);
        let turn = from.angle_to(&to).to_degrees();
        if turn > 180.0 - HALF_TURN_MARGIN_DEG {
            found.add(
                &path.key("waypoint").index(i + 1),
                format_args!(
                    "turns the rig by {}°: the direction of the turn is ambiguous",
                    rounded(turn)
                ),
                "the attitude takes the shorter arc; put a waypoint between the two".to_owned(),
            );
        }
    }
}

fn check_scans(scan: &ScanGeometry, flight: &Flight, path: &Path, found: &mut Findings) {
    let period = scan.scan_period_s();
    let whole = flight.whole_scans(period);
    let duration = rounded(flight.duration_s());
    if whole == 0 {
        let last = flight.waypoint.len().saturating_sub(1);
        found.add(
            &path.key("waypoint").index(last).key("time_s"),
            format_args!("ends the flight after {duration} s, before one scan of {period} s is complete"),
            None,
        );
    } else if let Some(scans) = flight.scans.filter(|s| *s as usize > whole) {
        found.add(
            &path.key("scans"),
            format_args!("is {scans}; the waypoints span {duration} s, enough for {whole} whole scans"),
            "put the last waypoint later, or omit `scans`".to_owned(),
        );
    }
}

/// Checks that the rig, the sensor and the mirrors stay inside the walls during the whole flight.
fn check_trajectory(scene: &Scene, scan: &ScanGeometry, flight: &Flight, path: &Path, found: &mut Findings) {
    let Some(trajectory) = Trajectory::of(flight) else {
        return;
    };
    let rig_from_sensor = structure::nominal_mount(scene);
    let mut parts = vec![("rig".to_owned(), Point3::origin())];
    parts.push(("sensor".to_owned(), rig_from_sensor * Point3::origin()));
    for facet in &scene.superstructure.facet {
        let corners = facet.shape.corners(scan).unwrap_or_default();
        parts.extend(
            corners
                .iter()
                .map(|c| (format!("facet {:?}", facet.name), rig_from_sensor * c)),
        );
    }
    let start = flight.waypoint[0].time_s;
    for (i, pair) in flight.waypoint.windows(2).enumerate() {
        for step in 0..=STEPS {
            let share = f64::from(step) / f64::from(STEPS);
            let time = pair[0].time_s + share * (pair[1].time_s - pair[0].time_s);
            let room_from_rig = trajectory.room_from_rig(time - start);
            let beyond = parts.iter().find_map(|(name, place)| {
                let (wall, beyond) = outside(&(room_from_rig * place), &scene.room.size_m)?;
                Some((name, wall, beyond))
            });
            let Some((name, wall, beyond)) = beyond else {
                continue;
            };
            let waypoint = path.key("waypoint").index(if step == 0 { i } else { i + 1 });
            let p: Vector3<f64> = room_from_rig.translation.vector;
            let place = format!("({}, {}, {})", rounded(p.x), rounded(p.y), rounded(p.z));
            let on_the_way = if step == 0 || step == STEPS {
                ""
            } else {
                " on the way there"
            };
            found.add(
                &waypoint.key("position_m"),
                format_args!(
                    "puts the {name} {} m beyond the {wall}{on_the_way}, with the rig at {place} m after {} s",
                    rounded(beyond),
                    rounded(time - start)
                ),
                room_extent(&scene.room.size_m),
            );
            return;
        }
    }
}
