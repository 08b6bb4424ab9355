//! Plain-language summaries of an experiment and of a score, as paragraphs of the report.

use super::page::{escape, number};
use catoptric_assess::score::{Honesty, Score, gate, words as score_words};
use catoptric_model::{Calibration, Dataset, PoseKind};
use catoptric_sim::Truth;
use catoptric_sim::truth::BeamClass;
use std::collections::BTreeMap;

/// Describes the recording and, where it is known, the truth.
pub(super) fn experiment(dataset: &Dataset, truth: Option<&Truth>) -> String {
    let session = &dataset.session;
    let count = |kind| dataset.of_kind(kind).count();
    let scans: Vec<usize> = dataset.of_kind(PoseKind::Facet).map(|p| p.label.scans).collect();
    let each = match (scans.iter().min(), scans.iter().max()) {
        (Some(fewest), Some(most)) if fewest == most => format!(" with {} each", plural(*fewest, "scan")),
        (Some(fewest), Some(most)) => format!(" with {fewest} to {most} scans each"),
        _ => String::new(),
    };
    let mut text = format!(
        "A {} with {} beams is surrounded by {}. A board was placed {} in the fans of the mirrors{each}",
        session.scanner.preset.to_uppercase(),
        session.scanner.scan.beams(),
        plural(session.facets.len(), "mirror"),
        plural(count(PoseKind::Facet), "time"),
    );
    let direct = count(PoseKind::Direct);
    if direct > 0 {
        text += &format!(
            ", and {} in front of beams that no mirror deflects",
            plural(direct, "time")
        );
    }
    text += &format!(
        ". Range noise is believed to be {} mm, and markers to be known to {} mm.",
        session.believed.range_noise_sd_mm, session.believed.marker_sd_mm
    );
    if let Some(truth) = truth {
        let class = |class| truth.beams.iter().filter(|b| b.status == class).count();
        text += &format!(
            " This is a simulation, so the truth is known: {} deflected by one mirror, {} are split at an edge, {} pass by the structure, {} end on it",
            elements_are(class(BeamClass::Deflected)),
            class(BeamClass::Split),
            class(BeamClass::Direct),
            class(BeamClass::Blocked) + class(BeamClass::Lost),
        );
        let bounced = class(BeamClass::MultiBounce);
        text += &if bounced > 0 {
            format!(", {bounced} hit more than one mirror.")
        } else {
            ".".to_owned()
        };
    } else {
        text += " The truth is unknown.";
    }
    text
}

/// Summarizes accuracy, the dominant error, the honesty of the covariance, abstentions and warnings, as HTML.
pub(super) fn findings(calibration: &Calibration, score: &Score) -> String {
    let mut html = String::new();
    for sentence in [
        accuracy(score),
        dominance(score),
        honesty(score),
        abstentions(calibration, score),
    ] {
        if !sentence.is_empty() {
            html += &format!("<p>{}</p>\n", escape(&sentence));
        }
    }
    let warnings: Vec<&String> = score
        .warnings
        .iter()
        .filter(|w| !score_words::is_covered_by_report(w))
        .collect();
    if !warnings.is_empty() {
        html += "<ul>\n";
        for warning in warnings {
            html += &format!("<li>{}</li>\n", escape(warning));
        }
        html += "</ul>\n";
    }
    html
}

fn accuracy(score: &Score) -> String {
    let beams = score.beams;
    let Some(deflected) = beams.deflected else {
        return format!(
            "{} solved. Without a truth their points are compared with the survey: they are {} mm (rms) off the boards and {} mm off the walls of the empty room.",
            elements_are(beams.solved),
            number(score.boards_mm.rms, 1),
            number(score.walls_mm.rms, 1)
        );
    };
    let mut text = format!("{} of {deflected} deflected elements were solved", beams.solved);
    if !score.per_axis_rms_deg.is_finite() {
        return text + ": there is no accuracy to report.";
    }
    text += &format!(
        " with θ and φ within {}° per axis (rms); half of the directions are within {}°, the worst is off by {}°. A point 4 m behind the mirror is displaced by {} mm.",
        number(score.per_axis_rms_deg, 3),
        number(score.direction_deg.median, 3),
        number(score.direction_deg.max, 3),
        number(score.point_mm.at_4m, 1)
    );
    if score.per_axis_rms_room_deg.is_finite() {
        text += &format!(
            " In the room frame, mounting included, it is {}° per axis.",
            number(score.per_axis_rms_room_deg, 3)
        );
    }
    text
}

fn dominance(score: &Score) -> String {
    let share = score_words::common_share(score);
    if !share.is_finite() {
        return String::new();
    }
    let percent = number(share * 100.0, 0);
    let rotation = number(score.common_mode_deg, 3);
    let left = number(score.differential_per_axis_rms_deg, 3);
    if share > score_words::DOMINANT_SHARE {
        return format!(
            "The common mode dominates: a rotation of {rotation}° common to all elements accounts for {percent} % of the squared error. An error of the sensor's mounting has this effect; without it {left}° per axis would remain, from boards and ranges."
        );
    }
    let within = within_mirrors(score);
    let scatter = number(within.to_degrees(), 3);
    let (found, advice) = if within.to_degrees().powi(2) < 0.5 * score.per_axis_rms_deg.powi(2) {
        (
            "The error common to the elements of each mirror dominates",
            "Drift, markers and biases of the boards have this effect: more boards would help, more scans would not.",
        )
    } else {
        (
            "The error that differs from element to element dominates",
            "Range noise and slope errors of the mirrors have this effect: more scans may help.",
        )
    };
    format!(
        "{found}: within a mirror the elements scatter by {scatter}° per axis about their mean. {advice} The rotation common to all elements, {rotation}°, accounts for only {percent} % of the squared error: the mounting of the sensor is not the main cause."
    )
}

/// Per-axis scatter of the elements about the mean error of their mirror, in radians.
fn within_mirrors(score: &Score) -> f64 {
    let mut of_facet: BTreeMap<&str, Vec<[f64; 2]>> = BTreeMap::new();
    for e in score.scored() {
        of_facet.entry(&e.facet).or_default().push([e.across, e.up]);
    }
    let (mut squares, mut count) = (0.0, 0.0);
    for errors in of_facet.values() {
        let n = errors.len() as f64;
        for axis in 0..2 {
            let mean = errors.iter().map(|e| e[axis]).sum::<f64>() / n;
            squares += errors.iter().map(|e| (e[axis] - mean).powi(2)).sum::<f64>();
            count += n;
        }
    }
    (squares / count).sqrt()
}

fn honesty(score: &Score) -> String {
    let mut text = String::new();
    if score.efficiency.is_finite() {
        let bound = number(score.crlb_per_axis_deg, 3);
        let alone = number(score.alone_crlb_per_axis_deg, 3);
        text += &if score.efficiency > 1.2 {
            format!(
                "With these boards no method can be expected to do better than {bound}° per axis. This run does better by statistical fluctuation: the errors that all elements share happened to be small."
            )
        } else {
            format!(
                "With these boards no method can be expected to do better than {bound}° per axis, and none that estimates every element separately better than {alone}°; in mean squares, this one reaches {} % of the former.",
                number(score.efficiency * 100.0, 0)
            )
        };
    }
    if score.nees_mean.is_finite() {
        let judgment = match score.honesty {
            Some(Honesty::OverConfident) => {
                let times = number(score.nees_mean.sqrt(), 1);
                format!("smaller than the actual errors, which are {times} times as large")
            }
            Some(Honesty::Doubtful) => {
                let times = number(score.nees_mean.sqrt(), 1);
                format!("perhaps smaller than the actual errors, which are {times} times as large")
            }
            Some(Honesty::UnderConfident) => "larger than the actual errors".to_owned(),
            Some(Honesty::Honest) | None => "consistent with the actual errors".to_owned(),
        };
        text += &format!(
            " The stated uncertainty is {judgment}: {} % of them are inside their 95 % ellipses.",
            number(score.coverage_95 * 100.0, 0)
        );
    }
    text.trim_start().to_owned()
}

fn abstentions(calibration: &Calibration, score: &Score) -> String {
    let reasons = score_words::abstentions(calibration);
    let Some(first) = reasons.first() else {
        return String::new();
    };
    let total: usize = reasons.iter().map(|a| a.count).sum();
    let solvable = match (score.beams.deflected, score.beams.abstained) {
        (None, _) => String::new(),
        (Some(_), 0) => ", none of which is deflected by one mirror unsplit".to_owned(),
        (Some(_), n) => format!(", of which {n} are deflected by one mirror unsplit"),
    };
    format!(
        "{} left without a direction{solvable}. The most frequent reason, {} times: {} ({}).",
        elements_are(total),
        first.count,
        first.status,
        first.reason
    )
}

fn plural(count: usize, noun: &str) -> String {
    if count == 1 {
        format!("1 {noun}")
    } else {
        format!("{count} {noun}s")
    }
}

fn elements_are(count: usize) -> String {
    gate::elements(count, "is", "are")
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_assess::score::score;
    use catoptric_fixtures::{Noise, noisy, perfect, sample, turned};

    #[test]
    fn each_dominant_error_is_named() {
        let s = sample();
        let text = |calibration: &Calibration| {
            dominance(&score(&s.dataset, calibration, Some(&s.truth)).expect("in memory"))
        };
        assert!(text(&turned(noisy(&s.truth, 1e-4, 1), 5e-3)).starts_with("The common mode dominates"));
        assert!(
            text(&noisy(&s.truth, 1e-3, 1)).starts_with("The error that differs from element to element")
        );
        let mut by_mirror = noisy(&s.truth, 1e-4, 1);
        let mut noise = Noise::new(9);
        for facet in &s.dataset.session.facets {
            let lift = 2e-3 * noise.draw();
            let of = by_mirror
                .beams
                .iter_mut()
                .filter(|b| b.facet.as_ref() == Some(&facet.name));
            of.for_each(|b| b.elevation_rad = b.elevation_rad.map(|e| e + lift));
        }
        assert!(text(&by_mirror).starts_with("The error common to the elements of each mirror"));
        assert!(
            accuracy(&score(&s.dataset, &perfect(&s.truth), Some(&s.truth)).expect("in memory"))
                .contains("within 0.000°")
        );
    }
}
