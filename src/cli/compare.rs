//! `catoptric compare`: tabulates several calibrations of one dataset, ours and third-party ones.

use super::context::{Context, Reading};
use super::error::CliError;
use super::judging::{Judging, conclude, write_junit};
use super::output::{counted, print};
use super::score::figure;
use catoptric::compare::{CONTRADICTION, Row};
use catoptric::junit::Suite;
use catoptric::score::Honesty;
use catoptric::{Comparison, Contestant, compare_with};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The dataset.
    dataset: PathBuf,
    /// The calibrations, ours or third-party.
    #[arg(required = true, num_args = 1.., value_name = "CALIBRATION")]
    calibrations: Vec<PathBuf>,
    #[command(flatten)]
    judging: Judging,
    /// Print the table as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reading: Reading,
}

/// Succeeds if every calibration does.
pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let rules = arguments.judging.rules()?;
    let junit = arguments.judging.place(&arguments.calibrations)?;
    let dataset = context.read_dataset(&arguments.dataset, arguments.reading)?;
    let truth = context.read_reference(&arguments.dataset, arguments.judging.blind)?;
    let contestants: Vec<Contestant> = arguments
        .calibrations
        .iter()
        .map(|path| {
            Ok(Contestant {
                name: path.display().to_string(),
                calibration: arguments.judging.read(path, junit.as_ref())?,
            })
        })
        .collect::<Result<_, CliError>>()?;
    let found = compare_with(&dataset, &contestants, truth.as_ref(), &rules)?;
    write_junit(junit.as_ref(), &Suite::of_comparison(&found))?;
    if arguments.json {
        let json = serde_json::to_string_pretty(&found).map_err(|e| CliError::Output(e.into()))?;
        print(&format!("{json}\n"))?;
    } else {
        print(&words(&found))?;
    }
    conclude(found.verdict, &found.failures)
}

/// A calibration as a row of a table.
type Cells = fn(&Row) -> Vec<String>;

/// The tables as text.
fn words(found: &Comparison) -> String {
    let order = if found.blind {
        "no truth: residuals on boards and walls only, smallest wall residual first"
    } else {
        "smallest point error at 4 m first"
    };
    let mut text = format!("{}, {order}\n", counted(found.rows.len(), "calibration"));
    let (heads, cells): (&[&str], Cells) = if found.blind {
        (&BLIND_HEADS, blind_cells)
    } else {
        (&HEADS, cells)
    };
    text += &table(heads, found.rows.iter().map(cells).collect());
    for row in &found.rows {
        for mistake in &row.mistakes {
            text += &format!("{}: {mistake}\n", row.name);
        }
    }
    if found.pairs.is_empty() {
        return text;
    }
    text += "differences in direction, over the beams that both solved\n";
    let rows = found.pairs.iter().map(|p| {
        let of_stated = if p.normalized_square > CONTRADICTION {
            format!(
                "{} times what both state: one of them is over-confident",
                figure(p.normalized_square.sqrt(), 1, "")
            )
        } else {
            figure(p.normalized_square.sqrt(), 2, " times what both state")
        };
        vec![
            format!("{} – {}", p.first, p.second),
            p.beams.to_string(),
            figure(p.direction_rms_deg, 4, "°"),
            figure(p.direction_max_deg, 4, "°"),
            of_stated,
        ]
    });
    text + &table(
        &["pair", "beams", "rms", "max", "rms against covariance"],
        rows.collect(),
    )
}

const HEADS: [&str; 14] = [
    "calibration",
    "method",
    "solved",
    "abstained",
    "missed",
    "false",
    "per axis",
    "in room",
    "p95",
    "point 4 m",
    "NEES",
    "in 95 %",
    "efficiency",
    "verdict",
];

const BLIND_HEADS: [&str; 7] = [
    "calibration",
    "method",
    "solved",
    "abstained",
    "boards",
    "walls",
    "verdict",
];

fn cells(row: &Row) -> Vec<String> {
    let count = |n: Option<usize>| n.map_or_else(|| "–".to_owned(), |n| n.to_string());
    let mut cells = vec![
        row.name.clone(),
        row.method.clone(),
        row.solved.to_string(),
        row.abstained.to_string(),
        count(row.missed),
        count(row.wrong),
        figure(row.per_axis_rms_deg, 4, "°"),
        figure(row.per_axis_rms_room_deg, 4, "°"),
        figure(row.direction_p95_deg, 4, "°"),
        figure(row.point_4m_mm, 2, " mm"),
        figure(row.nees_mean, 2, ""),
        figure(100.0 * row.coverage_95, 1, " %"),
        figure(row.efficiency, 2, ""),
    ];
    let verdict = row.verdict.word();
    cells.push(match row.honesty {
        Some(Honesty::OverConfident) if row.nees_mean.is_finite() => format!(
            "{verdict}, over-confident: errors are {:.1} times what it states",
            row.nees_mean.sqrt()
        ),
        Some(honesty) => format!("{verdict}, {}", honesty.words()),
        None => verdict.to_owned(),
    });
    cells
}

fn blind_cells(row: &Row) -> Vec<String> {
    vec![
        row.name.clone(),
        row.method.clone(),
        row.solved.to_string(),
        row.abstained.to_string(),
        figure(row.boards_rms_mm, 2, " mm"),
        figure(row.walls_rms_mm, 2, " mm"),
        row.verdict.word().to_owned(),
    ]
}

/// Formats columns as wide as their widest cell: names left-aligned, figures right-aligned.
fn table(heads: &[&str], rows: Vec<Vec<String>>) -> String {
    let columns = heads.len();
    let head = heads.iter().map(|h| (*h).to_owned()).collect();
    let all: Vec<Vec<String>> = std::iter::once(head).chain(rows).collect();
    let width = |column: usize| {
        let cells = all.iter().filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let is_figure = |cell: &str| cell.starts_with(|c: char| c.is_ascii_digit() || c == '–');
    let mut text = String::new();
    for row in &all {
        let mut line = String::new();
        for (column, cell) in row.iter().enumerate() {
            let to_the_right = all
                .get(1)
                .and_then(|first| first.get(column))
                .is_some_and(|c| is_figure(c));
            let gap = " ".repeat(widths[column] - cell.chars().count());
            let last = column + 1 == columns;
            line += &match (to_the_right && column > 0 && !last, last) {
                (true, _) => format!("  {gap}{cell}"),
                (false, true) => format!("  {cell}"),
                (false, false) => format!("  {cell}{gap}"),
            };
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}
