//! Runs as rows of a CSV table, which preserves every number exactly.

use super::Run;
use catoptric_files::names::{defused, original};

/// Header of `runs.csv`. Squares are in rad², errors in radians.
pub const HEADER: [&str; 18] = [
    "cell",
    "seed",
    "method",
    "solved",
    "abstained",
    "missed",
    "false",
    "square_rad2",
    "room_square_rad2",
    "bound_square_rad2",
    "nees",
    "beam",
    "across_rad",
    "up_rad",
    "mahalanobis_squared",
    "inside_95",
    "warnings",
    "failure",
];

/// Formats runs as a table.
pub fn to_csv(runs: &[Run]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    // Writing to memory cannot fail.
    let _ = writer.write_record(HEADER);
    for r in runs {
        let _ = writer.write_record(row(r));
    }
    let bytes = writer.into_inner().unwrap_or_default();
    String::from_utf8(bytes).unwrap_or_default()
}

fn row(r: &Run) -> [String; 18] {
    let number = |x: f64| if x.is_nan() { String::new() } else { x.to_string() };
    [
        r.cell.to_string(),
        r.seed.to_string(),
        defused(&r.method).into_owned(),
        r.solved.to_string(),
        r.abstained.to_string(),
        r.missed.to_string(),
        r.wrong.to_string(),
        number(r.square),
        number(r.room_square),
        number(r.bound_square),
        number(r.nees),
        r.beam.to_string(),
        number(r.across),
        number(r.up),
        number(r.mahalanobis_squared),
        number(r.inside_95),
        defused(&r.warnings).into_owned(),
        defused(&r.failure).into_owned(),
    ]
}

/// Parses runs from a table, which does not contain their durations.
///
/// # Errors
/// As text, with the line that [`to_csv`] could not have written.
pub fn from_csv(text: &str) -> Result<Vec<Run>, String> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| e.to_string())?;
    if header != HEADER[..] {
        return Err(format!("line 1: the columns are not {}", HEADER.join(",")));
    }
    let mut runs = Vec::new();
    for (i, record) in reader.records().enumerate() {
        let record = record.map_err(|e| e.to_string())?;
        runs.push(parsed(&record).ok_or_else(|| format!("line {}: not a valid run", i + 2))?);
    }
    Ok(runs)
}

fn parsed(record: &csv::StringRecord) -> Option<Run> {
    let text = |i: usize| record.get(i);
    let count = |i: usize| text(i)?.parse::<usize>().ok();
    let number = |i: usize| match text(i)? {
        "" => Some(f64::NAN),
        x => x.parse::<f64>().ok(),
    };
    Some(Run {
        cell: count(0)?,
        seed: text(1)?.parse().ok()?,
        method: original(text(2)?).to_owned(),
        solved: count(3)?,
        abstained: count(4)?,
        missed: count(5)?,
        wrong: count(6)?,
        square: number(7)?,
        room_square: number(8)?,
        bound_square: number(9)?,
        nees: number(10)?,
        beam: count(11)?,
        across: number(12)?,
        up: number(13)?,
        mahalanobis_squared: number(14)?,
        inside_95: number(15)?,
        warnings: original(text(16)?).to_owned(),
        failure: original(text(17)?).to_owned(),
        milliseconds: f64::NAN,
    })
}
