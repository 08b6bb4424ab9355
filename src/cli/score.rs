//! `catoptric score`: compares a calibration with the truth or, on blind data, with boards and walls.

use super::context::{Context, Reading};
use super::error::CliError;
use super::judging::{Judging, conclude, write_junit};
use super::output::{print, quoted};
use catoptric::files::names::printable_name;
use catoptric::junit::Suite;
use catoptric::{Score, score_with};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `score`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The dataset.
    dataset: PathBuf,
    /// The calibration.
    calibration: PathBuf,
    /// Fail (exit code 1) if the per-axis error exceeds this value, in degrees, or does not exist; not tested on blind
    /// data.
    #[arg(long, value_name = "X", value_parser = positive)]
    max_rms_deg: Option<f64>,
    #[command(flatten)]
    judging: Judging,
    /// Print the score as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reading: Reading,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("must be a number greater than 0".to_owned()),
    }
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let rules = arguments.judging.rules()?;
    let junit = arguments
        .judging
        .place(std::slice::from_ref(&arguments.calibration))?;
    let dataset = context.read_dataset(&arguments.dataset, arguments.reading)?;
    let truth = context.read_reference(&arguments.dataset, arguments.judging.blind)?;
    let calibration = arguments.judging.read(&arguments.calibration, junit.as_ref())?;
    let mut result = score_with(&dataset, &calibration, truth.as_ref(), &rules)?;
    if let Some(limit) = arguments.max_rms_deg {
        result = result.with_limit(limit);
    }
    let name = arguments.calibration.display().to_string();
    write_junit(junit.as_ref(), &[Suite::of_score(&name, &result)])?;
    if arguments.json {
        let json = serde_json::to_string_pretty(&result).map_err(|e| CliError::Output(e.into()))?;
        print(&format!("{json}\n"))?;
        for warning in &result.warnings {
            context.detail(warning);
        }
    } else {
        print(&format!(
            "{}next: catoptric report {} {} --out report.html\n",
            words(&result),
            quoted(&arguments.dataset),
            quoted(&arguments.calibration)
        ))?;
    }
    conclude(result.verdict, &result.reasons())
}

/// A score as a few lines of text.
fn words(score: &Score) -> String {
    let verdict = score.verdict.word();
    let mut text = format!("{verdict}: method {}\n", printable_name(&score.method));
    let mut line = |name: &str, value: String| text.push_str(&format!("  {name:<22}{value}\n"));
    let beams = &score.beams;
    line(
        "elements",
        match (beams.deflected, beams.missed, beams.wrong) {
            (Some(deflected), Some(missed), Some(wrong)) => format!(
                "{deflected} deflected: {} solved, {} abstained, {missed} missed; {wrong} false",
                beams.solved, beams.abstained
            ),
            _ => format!("{} solved, {} abstained", beams.solved, beams.abstained),
        },
    );
    for (name, residual) in [("boards", &score.boards_mm), ("walls", &score.walls_mm)] {
        line(
            name,
            format!("{} rms from point to plane", figure(residual.rms, 2, " mm")),
        );
    }
    if score.beams.deflected.is_some() {
        against_truth(score, &mut line);
    }
    for warning in &score.warnings {
        text.push_str(&format!("  {warning}\n"));
    }
    text
}

/// Adds the figures that require a truth.
fn against_truth(score: &Score, line: &mut impl FnMut(&str, String)) {
    line("direction, per axis", degrees(score.per_axis_rms_deg));
    line("  bound", degrees(score.crlb_per_axis_deg));
    line("  bound per element", degrees(score.alone_crlb_per_axis_deg));
    line("  common to all", degrees(score.common_mode_deg));
    line("  in the room", degrees(score.per_axis_rms_room_deg));
    line(
        "distance",
        format!("{} rms", figure(score.distance_mm.rms, 2, " mm")),
    );
    if let Some(mounting) = &score.mounting {
        line(
            "mounting",
            format!(
                "{}, {}",
                figure(mounting.attitude_deg, 4, "°"),
                figure(mounting.position_mm, 2, " mm")
            ),
        );
    }
    line(
        "point",
        format!(
            "{} at 1 m, {} at 4 m, {} at 10 m",
            figure(score.point_mm.at_1m, 1, " mm"),
            figure(score.point_mm.at_4m, 1, " mm"),
            figure(score.point_mm.at_10m, 1, " mm")
        ),
    );
    line(
        "stated covariance",
        format!(
            "{}mean NEES {}, {} inside the 95 % ellipse",
            score
                .honesty
                .map_or_else(String::new, |h| format!("{}: ", h.words())),
            figure(score.nees_mean, 2, ""),
            figure(100.0 * score.coverage_95, 1, " %")
        ),
    );
}

fn degrees(value: f64) -> String {
    format!("{} rms", figure(value, 4, "°"))
}

/// Formats a number with its unit; a dash if it does not exist.
pub(crate) fn figure(value: f64, decimals: usize, unit: &str) -> String {
    if value.is_finite() {
        format!("{value:.decimals$}{unit}")
    } else {
        "–".to_owned()
    }
}
