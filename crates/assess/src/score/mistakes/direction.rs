//! Directions read in another way: angles, units, order, axes, frame, numbering of the beams, the mirror's normal.

use crate::score::mistake::{LEFT, Mistake};
use crate::score::{ElementError, Score};
use catoptric_model::{Calibration, Dataset, Deflection, Pose, ScanGeometry, Status, beam, mirror};
use catoptric_sim::Truth;
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

/// Per-axis error below which no mistake is sought, in degrees: less than any of them makes.
const LARGE_DEG: f64 = 0.05;

/// Elements on which all mistakes are tried; the best is then computed from all elements.
const TRIED: usize = 40;

/// Errors of mirrors that are mounted anew: larger than this, in degrees, and than this many limits of the experiment.
const REMOUNTED_DEG: f64 = 0.2;
const REMOUNTED_LIMITS: f64 = 10.0;

/// Degrees of a radian.
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// What the azimuth is measured from.
#[derive(Debug, Clone, Copy)]
enum From {
    Beam,
    Axis,
    BeamBackward,
    OppositeBeam,
}

/// What the elevation is measured from.
#[derive(Debug, Clone, Copy)]
enum Above {
    Plane,
    Zenith,
    Nadir,
}

/// What the numbers are in radians, after multiplication.
#[derive(Debug, Clone, Copy)]
enum Measure {
    Radians,
    Degrees,
    DividedTwice,
    Halves,
    Doubles,
    AzimuthDegrees,
    ElevationDegrees,
}

/// How the beams are counted.
#[derive(Debug, Clone, Copy)]
enum Count {
    FromZero,
    FromOne,
    FromMinusOne,
    Backward,
}

/// One way to read the angles of a file.
#[derive(Debug, Clone, Copy)]
struct Reading {
    from: From,
    above: Above,
    unit: Measure,
    swapped: bool,
    /// The angles are those of the mirror's normal.
    normal: bool,
    count: Count,
}

impl Reading {
    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for from in [From::Beam, From::Axis, From::BeamBackward, From::OppositeBeam] {
            for above in [Above::Plane, Above::Zenith, Above::Nadir] {
                for unit in [
                    Measure::Radians,
                    Measure::Degrees,
                    Measure::DividedTwice,
                    Measure::Halves,
                    Measure::Doubles,
                    Measure::AzimuthDegrees,
                    Measure::ElevationDegrees,
                ] {
                    for swapped in [false, true] {
                        for normal in [false, true] {
                            for count in [
                                Count::FromZero,
                                Count::FromOne,
                                Count::FromMinusOne,
                                Count::Backward,
                            ] {
                                all.push(Self {
                                    from,
                                    above,
                                    unit,
                                    swapped,
                                    normal,
                                    count,
                                });
                            }
                        }
                    }
                }
            }
        }
        all.sort_by_key(|r| (r.differences().len(), !matches!(r.count, Count::FromZero)));
        // Three mistakes at once explain anything.
        all.retain(|r| r.differences().len() <= 2);
        all
    }

    /// In what it differs from the format.
    fn differences(&self) -> Vec<&'static str> {
        let mut all = Vec::new();
        match self.count {
            Count::FromZero => {}
            Count::FromOne => all.push("beams counted from 1"),
            Count::FromMinusOne => all.push("beams counted from −1"),
            Count::Backward => all.push("beams counted from the other end"),
        }
        match self.from {
            From::Beam => {}
            From::Axis => all.push(
                "the azimuth read from the sensor's x axis (θ_a is measured from the undeflected beam)",
            ),
            From::BeamBackward => all.push("θ_a negated"),
            From::OppositeBeam => all.push("half a turn added to θ_a"),
        }
        match self.above {
            Above::Plane => {}
            Above::Zenith => all.push("φ read from the zenith"),
            Above::Nadir => all.push("φ read from the nadir"),
        }
        match self.unit {
            Measure::Radians => {}
            Measure::Degrees => all.push("the angles read as degrees"),
            Measure::DividedTwice => all.push("the angles converted to radians twice"),
            Measure::Halves => all.push("the angles doubled"),
            Measure::Doubles => all.push("the angles halved"),
            Measure::AzimuthDegrees => all.push("θ_a read as degrees"),
            Measure::ElevationDegrees => all.push("φ read as degrees"),
        }
        if self.swapped {
            all.push("θ_a and φ exchanged");
        }
        if self.normal {
            all.push("the angles read as those of the mirror's normal");
        }
        all
    }

    /// The direction that an entry means.
    fn direction(&self, base: f64, entry: &Deflection) -> Unit<Vector3<f64>> {
        let (mut azimuth, mut elevation) = (entry.azimuth, entry.elevation);
        if self.swapped {
            std::mem::swap(&mut azimuth, &mut elevation);
        }
        let [of_azimuth, of_elevation] = match self.unit {
            Measure::Radians => [1.0, 1.0],
            Measure::Degrees => [1.0 / DEGREES; 2],
            Measure::DividedTwice => [DEGREES; 2],
            Measure::Halves => [2.0; 2],
            Measure::Doubles => [0.5; 2],
            Measure::AzimuthDegrees => [1.0 / DEGREES, 1.0],
            Measure::ElevationDegrees => [1.0, 1.0 / DEGREES],
        };
        azimuth *= of_azimuth;
        elevation *= of_elevation;
        let azimuth = match self.from {
            From::Beam => base + azimuth,
            From::Axis => azimuth,
            From::BeamBackward => base - azimuth,
            From::OppositeBeam => base + azimuth + std::f64::consts::PI,
        };
        let elevation = match self.above {
            Above::Plane => elevation,
            Above::Zenith => FRAC_PI_2 - elevation,
            Above::Nadir => elevation - FRAC_PI_2,
        };
        let v = beam::spherical(azimuth, elevation);
        if self.normal {
            mirror::reflect(&beam::direction(base), &v)
        } else {
            v
        }
    }

    /// The entry that means an element.
    fn entry(&self, beam: usize, beams: usize) -> Option<usize> {
        match self.count {
            Count::FromZero => Some(beam),
            Count::FromOne => Some(beam + 1),
            Count::FromMinusOne => beam.checked_sub(1),
            Count::Backward => (beams - 1).checked_sub(beam),
        }
    }
}

/// A frame that directions may be given in, by the rotation into the sensor frame.
struct Frame {
    words: String,
    into_sensor: Matrix3<f64>,
}

/// The sensor frame, then frames with other axes, then other bodies'.
fn frames(truth: &Truth) -> Vec<Frame> {
    let mut all = Vec::new();
    let axes = ["x", "y", "z"];
    let orders = [[0, 1, 2], [1, 0, 2], [0, 2, 1], [2, 1, 0], [1, 2, 0], [2, 0, 1]];
    for order in orders {
        for signs in 0..8_u8 {
            let sign = |axis: usize| if signs >> axis & 1 == 1 { -1.0 } else { 1.0 };
            let mut into_sensor = Matrix3::zeros();
            for (row, column) in order.into_iter().enumerate() {
                into_sensor[(row, column)] = sign(row);
            }
            let words: Vec<String> = (0..3)
                .map(|row| {
                    let sign = if sign(row) < 0.0 { "−" } else { "" };
                    format!("{sign}{}", axes[order[row]])
                })
                .collect();
            let words = match (order, signs) {
                ([0, 1, 2], 0) => String::new(),
                ([0, 1, 2], 0b100) => "φ negated".to_owned(),
                ([0, 1, 2], 0b010) => "y negated (a left-handed frame)".to_owned(),
                ([0, 1, 2], 0b111) => "the direction reversed".to_owned(),
                _ => format!("the axes ({}) taken for (x, y, z)", words.join(", ")),
            };
            all.push(Frame { words, into_sensor });
        }
    }
    // Fewer changes first: a sign is a simpler mistake than another order.
    all.sort_by_key(|f| (0..3).filter(|&i| f.into_sensor[(i, i)] < 0.5).count());
    let rig_from_sensor = Pose::from(&truth.rig_from_sensor);
    let room_from_sensor = Pose::from(&truth.room_from_rig) * rig_from_sensor;
    for (words, turn) in [
        (
            "the directions read in the rig frame",
            rig_from_sensor.rotation.inverse(),
        ),
        (
            "the directions read in the room frame",
            room_from_sensor.rotation.inverse(),
        ),
        ("the mounting's rotation applied twice", rig_from_sensor.rotation),
    ] {
        all.push(Frame {
            words: words.to_owned(),
            into_sensor: turn.to_rotation_matrix().into_inner(),
        });
    }
    all
}

/// An element with its truth and the entries that the file may mean by it.
struct Element<'a> {
    error: &'a ElementError,
    base: f64,
    exit: Unit<Vector3<f64>>,
}

pub(super) fn recognize(
    score: &Score,
    scored: &[&ElementError],
    dataset: &Dataset,
    calibration: &Calibration,
    truth: &Truth,
) -> Option<Mistake> {
    let found = score.per_axis_rms_deg;
    let scan = &dataset.session.scanner.scan;
    // Directions of which next to nothing is scored may be those of other beams.
    let deflected = truth_of(truth, scan);
    if found.is_nan() || found <= LARGE_DEG || scored.is_empty() {
        return None;
    }
    let entries: BTreeMap<usize, Deflection> = calibration
        .beams
        .iter()
        .filter(|b| b.status == Status::Solved)
        .filter_map(|b| Some((b.beam, b.deflection()?)))
        .collect();
    let all: Vec<Element<'_>> = scored
        .iter()
        .map(|error| {
            let base = scan.azimuth(error.beam);
            Element {
                error,
                base,
                exit: error.truth.exit_direction(base),
            }
        })
        .collect();
    let step = all.len().div_ceil(TRIED);
    let some: Vec<&Element<'_>> = all.iter().step_by(step).collect();
    let every: Vec<&Element<'_>> = all.iter().collect();
    let frames = frames(truth);
    let per_axis = |elements: &[&Element<'_>], reading: &Reading, frame: &Frame| {
        per_axis_deg(elements, reading, frame, &entries, scan)
    };
    let mut best: Option<(usize, f64, Reading, &Frame)> = None;
    for reading in Reading::all() {
        for frame in &frames {
            let differences = reading.differences().len() + usize::from(!frame.words.is_empty());
            if differences == 0 || differences > 2 {
                continue;
            }
            let error = per_axis(&some, &reading, frame);
            let accepted = error <= LEFT * found;
            // A mistake more must be worth it, and on symmetric layouts two of them are the same.
            let better = best.as_ref().is_none_or(|(fewer, least, ..)| {
                if differences > *fewer {
                    error < LEFT * least
                } else {
                    error < 0.5 * least
                }
            });
            if accepted && better {
                best = Some((differences, error, reading, frame));
            }
        }
    }
    let one = best.and_then(|(_, _, reading, frame)| {
        let would_be = per_axis(&every, &reading, frame);
        let mut words: Vec<&str> = reading.differences();
        if !frame.words.is_empty() {
            words.push(&frame.words);
        }
        (would_be <= LEFT * found).then(|| mistake(words.join(" and "), found, would_be))
    });
    one.or_else(|| remounted(&every, score, deflected))
}

fn mistake(correction: String, found: f64, would_be: f64) -> Mistake {
    Mistake {
        correction,
        figure: "per_axis_rms_deg",
        found,
        would_be,
    }
}

/// Number of mirrors that deflect something.
fn truth_of(truth: &Truth, scan: &ScanGeometry) -> usize {
    let beams = truth.beams.iter().filter(|b| b.beam < scan.beams());
    let facets: std::collections::BTreeSet<&String> = beams.filter_map(|b| b.facets.first()).collect();
    facets.len()
}

/// Per-axis error of some elements read in one way; infinite if too few entries are those of an element.
fn per_axis_deg(
    elements: &[&Element<'_>],
    reading: &Reading,
    frame: &Frame,
    entries: &BTreeMap<usize, Deflection>,
    scan: &ScanGeometry,
) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for e in elements {
        let entry = reading
            .entry(e.error.beam, scan.beams())
            .and_then(|b| entries.get(&b));
        let Some(entry) = entry else { continue };
        let v = frame.into_sensor * reading.direction(e.base, entry).into_inner();
        sum += beam::angle_between(&Unit::new_unchecked(v), &e.exit).powi(2);
        count += 1;
    }
    if 10 * count < 9 * elements.len() {
        return f64::INFINITY;
    }
    (0.5 * sum / count as f64).sqrt().to_degrees()
}

/// Whether the errors are those of mirrors that were turned individually: a calibration of another build of them.
fn remounted(elements: &[&Element<'_>], score: &Score, facets: usize) -> Option<Mistake> {
    let of_facet = |facet: &str| -> Vec<&Element<'_>> {
        let all = elements.iter().filter(|e| e.error.facet == facet);
        all.copied().collect()
    };
    let names: std::collections::BTreeSet<&str> = elements.iter().map(|e| e.error.facet.as_str()).collect();
    if facets < 2 || names.len() < 2 {
        return None;
    }
    let normal =
        |e: &Element<'_>, v: &Unit<Vector3<f64>>| mirror::normal_between(&beam::direction(e.base), v);
    let (mut sum, mut count, mut largest) = (0.0, 0.0, 0.0_f64);
    for name in names {
        let mean = |of: &dyn Fn(&Element<'_>) -> Option<Unit<Vector3<f64>>>| {
            let all: Vector3<f64> = of_facet(name)
                .into_iter()
                .filter_map(of)
                .map(Unit::into_inner)
                .sum();
            Unit::try_new(all, f64::EPSILON)
        };
        let actual = mean(&|e| normal(e, &e.exit))?;
        let estimated = mean(&|e| normal(e, &e.error.estimate.exit_direction(e.base)))?;
        let turn = Rotation3::rotation_between(&estimated, &actual)?;
        largest = largest.max(turn.angle());
        for e in of_facet(name) {
            let turned =
                Unit::new_unchecked(turn * normal(e, &e.error.estimate.exit_direction(e.base))?.into_inner());
            let v = mirror::reflect(&beam::direction(e.base), &turned);
            sum += beam::angle_between(&v, &e.exit).powi(2);
            count += 1.0;
        }
    }
    let would_be = (0.5_f64 * sum / count).sqrt().to_degrees();
    let found = score.per_axis_rms_deg;
    // Honest errors are mostly those of whole mirrors too; only much larger ones are another build.
    let limit = score.crlb_per_axis_deg;
    let too_large = found > REMOUNTED_DEG && (limit.is_nan() || found > REMOUNTED_LIMITS * limit);
    (too_large && would_be <= LEFT * found).then(|| {
        let words = format!(
            "each mirror turned on its own, by up to {:.2}°, as if it were a calibration of other mirrors, such as another dataset's",
            largest.to_degrees()
        );
        mistake(words, found, would_be)
    })
}
