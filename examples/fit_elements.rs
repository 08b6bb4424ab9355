//! Fits the two angles of many elements to ranges of planes, read from a table, and reports how long that takes.
//!
//! ```text
//! fit_elements ROWS.csv ANSWERS.csv       rows: element, base_azimuth, distance, start_azimuth, start_elevation,
//!                                               nx, ny, nz, px, py, pz, range
//! ```
//! Angles are in radians, lengths in meters; a plane has a normal and a point, in the sensor frame. The rows of an element
//! are consecutive. Prints one line of JSON; `benches/peers/elements.py` compares it with other solvers.

use catoptric::calib::Options;
use catoptric::calib::observations::{BoardView, Observation};
use catoptric::calib::solve::{BareDistance, SoleElement, Solution, batch};
use catoptric::model::{BoardPlane, Deflection, RangeBias, RawRange};
use nalgebra::{Point3, Unit, Vector3};
use std::error::Error;
use std::io::Write;
use std::time::Instant;

/// Number of times that all elements are solved; the median counts.
const ROUNDS: usize = 7;

/// An element as read from the table.
struct Given<'a> {
    azimuth: f64,
    distance: f64,
    start: Deflection,
    observations: Vec<Observation<'a>>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, rows, answers] = &arguments[..] else {
        return Err("usage: fit_elements ROWS.csv ANSWERS.csv".into());
    };
    let given = read(&std::fs::read_to_string(rows)?)?;
    let bias = RangeBias::default();
    let options = Options {
        step_tolerance_rad: 1e-9,
        ..Options::default()
    };
    let mut times = Vec::new();
    let mut solutions: Vec<Option<Solution>> = Vec::new();
    for _ in 0..ROUNDS {
        let begin = Instant::now();
        solutions = given
            .iter()
            .map(|one| {
                let element = SoleElement {
                    azimuth: one.azimuth,
                    observations: &one.observations,
                    distance: BareDistance {
                        distance: one.distance,
                        thickness: 0.0,
                    },
                    bias: &bias,
                };
                batch(&element, &one.start, &options)
            })
            .collect();
        times.push(begin.elapsed().as_secs_f64() * 1e6 / given.len() as f64);
    }
    times.sort_by(f64::total_cmp);
    let mut file = std::io::BufWriter::new(std::fs::File::create(answers)?);
    for solution in &solutions {
        match solution.as_ref().filter(|s| s.converged) {
            Some(s) => writeln!(file, "{:?},{:?}", s.deflection.azimuth, s.deflection.elevation)?,
            None => writeln!(file, "nan,nan")?,
        }
    }
    file.flush()?;
    let iterations: usize = solutions.iter().flatten().map(|s| s.iterations).sum();
    writeln!(
        std::io::stdout(),
        "{{\"us_per_element\": {:.4}, \"iterations_per_element\": {:.2}}}",
        times[ROUNDS / 2],
        iterations as f64 / given.len() as f64
    )?;
    Ok(())
}

fn read(text: &str) -> Result<Vec<Given<'static>>, Box<dyn Error>> {
    let mut all: Vec<Given<'static>> = Vec::new();
    let mut last = f64::NAN;
    for line in text.lines().filter(|l| !l.trim().is_empty()) {
        let numbers = line
            .split(',')
            .map(|n| n.trim().parse())
            .collect::<Result<Vec<f64>, _>>()?;
        let [
            element,
            azimuth,
            distance,
            start_azimuth,
            start_elevation,
            nx,
            ny,
            nz,
            px,
            py,
            pz,
            range,
        ] = numbers[..]
        else {
            return Err(format!("twelve numbers are needed, {} found: {line}", numbers.len()).into());
        };
        if element != last {
            last = element;
            all.push(Given {
                azimuth,
                distance,
                start: Deflection {
                    azimuth: start_azimuth,
                    elevation: start_elevation,
                    distance,
                },
                observations: Vec::new(),
            });
        }
        let normal = Unit::try_new(Vector3::new(nx, ny, nz), 0.0).ok_or("a normal is zero")?;
        if let Some(one) = all.last_mut() {
            one.observations.push(Observation {
                board: BoardView {
                    plane: BoardPlane::new(Point3::new(px, py, pz), normal),
                    markers: &[],
                    color: "white",
                    noise_sd: 5e-3,
                    count: 1,
                },
                mean: RawRange(range),
            });
        }
    }
    Ok(all)
}
