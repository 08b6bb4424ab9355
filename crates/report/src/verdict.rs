//! The verdict on each calibration: a badge and the findings, which calibrations with the same result share.

use super::page::{escape, number, table};
use super::prose::findings;
use catoptric_assess::score::{Outcome, Score, Verdict};
use catoptric_model::{Calibration, ScanGeometry, beam};
use std::collections::BTreeMap;

/// The verdicts on all calibrations. One that repeats the verdict above it is reported in one sentence.
pub(super) fn verdicts(scan: &ScanGeometry, results: &[(Calibration, Score)]) -> String {
    let mut html = String::new();
    let mut above: Option<(&Calibration, Verdict, String)> = None;
    for (calibration, score) in results {
        let method = escape(&calibration.method);
        let text = findings(calibration, score);
        if let Some((first, verdict, above_text)) = &above
            && *verdict == score.verdict
            && *above_text == text
            && let Some(difference) = largest_difference_deg(scan, first, calibration)
        {
            // More digits than the report's other figures have would not be meaningful.
            let size = if difference < 1e-4 {
                "less than 0.0001".to_owned()
            } else {
                number(difference, 4)
            };
            html +=
                &format!("<p>Method “{method}” gives the same result (largest difference {size}°).</p>\n");
            continue;
        }
        let gates = gates(score);
        html += &format!(
            "<section class=\"verdict {}\">\n<h3>{} – method “{method}”</h3>\n{text}{gates}</section>\n",
            score.verdict.word(),
            badge(score.verdict)
        );
        above = Some((calibration, score.verdict, text));
    }
    html
}

/// A verdict as a colored word.
pub(super) fn badge(verdict: Verdict) -> String {
    format!(
        "<span class=\"badge\">{}</span>",
        verdict.word().replace('_', " ").to_uppercase()
    )
}

/// The gates of a score: what was found, what is allowed, and how often an honest calibration does not meet it.
fn gates(score: &Score) -> String {
    let rows: Vec<Vec<String>> = score
        .gates
        .iter()
        .map(|gate| {
            let allowed = match (gate.at_most, gate.at_least) {
                (Some(most), _) => format!("at most {}", number(most, 2)),
                (None, Some(least)) => format!("at least {}", number(least, 2)),
                (None, None) => "–".to_owned(),
            };
            let rate = gate.false_alarm_rate;
            vec![
                gate.name.clone(),
                outcome(gate.outcome).to_owned(),
                number(gate.found, 2),
                allowed,
                rate.map_or_else(|| "–".to_owned(), |r| format!("{} %", number(100.0 * r, 1))),
            ]
        })
        .collect();
    let headings = ["Gate", "Outcome", "Found", "Allowed", "False alarms"];
    format!(
        "<details><summary>What decides the verdict</summary>\n{}</details>\n",
        table(&headings, &rows)
    )
}

fn outcome(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Pass => "met",
        Outcome::Fail => "not met",
        Outcome::NotJudged => "not judged",
        Outcome::NotTested => "not tested",
        Outcome::Invalid => "invalid",
    }
}

/// Largest angle between the directions that two calibrations give an element, in degrees; `None` unless both give
/// the same elements a direction.
fn largest_difference_deg(scan: &ScanGeometry, a: &Calibration, b: &Calibration) -> Option<f64> {
    let directions = |c: &Calibration| -> BTreeMap<usize, _> {
        let solved = c.beams.iter().filter_map(|b| Some((b.beam, b.deflection()?)));
        solved
            .map(|(beam, d)| (beam, d.exit_direction(scan.azimuth(beam))))
            .collect()
    };
    let (a, b) = (directions(a), directions(b));
    if !a.keys().eq(b.keys()) {
        return None;
    }
    let angles = a.values().zip(b.values()).map(|(a, b)| beam::angle_between(a, b));
    angles.reduce(f64::max).map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_assess::score::score;
    use catoptric_fixtures::{noisy, sample, turned};

    #[test]
    fn equal_results_share_a_verdict() {
        let s = sample();
        let first = noisy(&s.truth, 1e-3, 1);
        let verdicts_with = |change: &dyn Fn(&mut Calibration)| {
            let mut second = first.clone();
            second.method = "a < b".to_owned();
            change(&mut second);
            verdicts(
                &s.dataset.session.scanner.scan,
                &[first.clone(), second].map(|c| {
                    let score = score(&s.dataset, &c, Some(&s.truth)).expect("in memory");
                    (c, score)
                }),
            )
        };
        let same = "<p>Method “a &lt; b” gives the same result (largest difference";
        let equal = verdicts_with(&|_| {});
        assert!(
            equal.contains(&format!("{same} less than 0.0001°).</p>")),
            "{equal}"
        );
        assert_eq!(equal.matches("<section").count(), 1);
        // One element off by a fifth of a millidegree: too little to change any figure of the findings.
        let solved = first
            .beams
            .iter()
            .position(|b| b.elevation_rad.is_some())
            .expect("some are solved");
        let nudged = verdicts_with(&|c| {
            let elevation = &mut c.beams[solved].elevation_rad;
            *elevation = elevation.map(|e| e + 2e-4_f64.to_radians());
        });
        assert!(nudged.contains(&format!("{same} 0.0002°).</p>")), "{nudged}");
        let turned = verdicts_with(&|c| *c = turned(c.clone(), 5e-3));
        assert!(!turned.contains("same result") && turned.matches("<section").count() == 2);
    }
}
