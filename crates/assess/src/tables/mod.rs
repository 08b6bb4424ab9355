//! Tables 1 to 4 as measured, next to the values of the paper, and the fitted parameters of Eqs. (3)–(5).

use catoptric_model::characterization::{Characterization, Parameter, StretchRow};
use catoptric_model::{RangeBias, TestKind, paper};

/// Subject of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// Table 1.
    Spot,
    /// Table 2.
    Distance,
    /// Table 3.
    Angle,
    /// Table 4.
    Color,
    /// The parameters of Eqs. (3)–(5).
    Numbers,
}

/// A table of text and numbers, for a terminal or a page.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Subject.
    pub subject: Subject,
    /// Title.
    pub title: &'static str,
    /// Column headings, with units.
    pub headings: Vec<&'static str>,
    /// The cells; a dash where a value does not exist.
    pub rows: Vec<Vec<String>>,
    /// Remark below the table; may be empty.
    pub remark: String,
}

/// Returns all tables for which data were recorded.
///
/// `injected` are the biases that a simulation injected, if known.
pub fn tables(found: &Characterization, injected: Option<&RangeBias>) -> Vec<Table> {
    let all = [
        spots(found),
        distances(found),
        angles(found),
        noise(found),
        numbers(found, injected),
    ];
    all.into_iter().filter(|t| !t.rows.is_empty()).collect()
}

/// Formats a number with the given number of decimals.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    // A negative number that is rounded to zero loses its sign.
    if text
        .trim_start_matches('-')
        .chars()
        .all(|c| matches!(c, '0' | '.'))
    {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

fn or_dash(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |v| fixed(v, decimals))
}

fn spots(found: &Characterization) -> Table {
    let row = |s: &catoptric_model::characterization::SpotRow| {
        let printed = paper::at_distance(&paper::TABLE_1, |r| r.0, s.distance_m);
        vec![
            fixed(s.distance_m, 2),
            s.spot.beams.to_string(),
            fixed(s.spot.height_mm, 1),
            or_dash(printed.map(|p| p.1), 1),
            fixed(s.spot.width_mm, 1),
            or_dash(printed.map(|p| p.2), 1),
            or_dash(printed.map(|p| s.spot.width_mm - p.2), 1),
        ]
    };
    let remark = found.spot_law.map_or(String::new(), |law| {
        format!(
            "height {} mm + {} mrad, width {} mm + {} mrad, full",
            fixed(law.height_offset_mm, 1),
            fixed(law.height_slope_mrad, 2),
            fixed(law.width_offset_mm, 1),
            fixed(law.width_slope_mrad, 1)
        )
    });
    Table {
        subject: Subject::Spot,
        title: "Table 1: spot of neighboring beams",
        headings: vec![
            "distance (m)",
            "beams",
            "height (mm)",
            "paper",
            "width (mm)",
            "paper",
            "difference",
        ],
        rows: found.spots.iter().map(row).collect(),
        remark,
    }
}

fn of(found: &Characterization, kind: TestKind) -> impl Iterator<Item = &StretchRow> {
    found.stretches.iter().filter(move |s| s.test == Some(kind))
}

/// Mean of the mean errors of one setting, at its last trial.
fn mean_of_setting(found: &Characterization, row: &StretchRow) -> Option<f64> {
    let trials: Vec<&StretchRow> = found
        .stretches
        .iter()
        .filter(|s| s.setting.is_some() && s.setting == row.setting)
        .collect();
    let last = trials.last().is_some_and(|s| s.pose == row.pose);
    let sum: f64 = trials.iter().map(|s| s.mean_error_mm).sum();
    (last && trials.len() > 1).then(|| sum / trials.len() as f64)
}

fn trial(values: Option<[f64; 3]>, row: &StretchRow) -> Option<f64> {
    values?.get(row.trial?.checked_sub(1)?).copied()
}

fn mean(values: Option<[f64; 3]>) -> Option<f64> {
    values.map(|v| v.iter().sum::<f64>() / 3.0)
}

fn distances(found: &Characterization) -> Table {
    let mut rows = Vec::new();
    for row in of(found, TestKind::Distance) {
        let printed = paper::at_distance(&paper::TABLE_2, |r| r.0, row.distance_m);
        rows.push(vec![
            fixed(row.distance_m, 3),
            row.trial.map_or("–".to_owned(), |t| t.to_string()),
            fixed(row.mean_error_mm, 1),
            or_dash(trial(printed.map(|p| p.1), row), 1),
            String::new(),
            fixed(row.sd_mm, 1),
            or_dash(trial(printed.map(|p| p.2), row), 1),
        ]);
        if let Some(of_setting) = mean_of_setting(found, row) {
            rows.push(vec![
                fixed(row.distance_m, 1),
                "mean".to_owned(),
                fixed(of_setting, 1),
                or_dash(mean(printed.map(|p| p.1)), 1),
                fixed(found.bias.distance.error(row.distance_m) * 1e3, 1),
                String::new(),
                String::new(),
            ]);
        }
    }
    let scatter = found.trial_scatter.map_or(String::new(), |s| {
        format!(
            "E_r is fitted to all boards together; trials scatter by {} mm ({} degrees of freedom; paper 0.88)",
            fixed(s.sd_mm, 2),
            s.degrees_of_freedom
        )
    });
    let line = found.distance_line.map_or(String::new(), |law| {
        let verdict = if law.fit.is_rejected() {
            "does not fit"
        } else {
            "fits"
        };
        format!(
            "; a line through the distances, {} mm/m and {} mm, {verdict}: χ² {} with {}",
            fixed(law.slope_mm_per_m, 2),
            fixed(law.offset_mm, 2),
            fixed(law.fit.chi_squared, 1),
            law.fit.degrees_of_freedom
        )
    });
    Table {
        subject: Subject::Distance,
        title: "Table 2: mean error and standard deviation over the distance",
        headings: vec![
            "distance (m)",
            "trial",
            "mean (mm)",
            "paper",
            "E_r (mm)",
            "STD (mm)",
            "paper",
        ],
        rows,
        remark: scatter + &line,
    }
}

fn angles(found: &Characterization) -> Table {
    let mut rows = Vec::new();
    for row in of(found, TestKind::Angle) {
        let printed = paper::at_incidence(row.incidence_deg).map(|p| p.1);
        let cos = libm::cos(row.incidence_deg.to_radians());
        let law = found.bias.terms(row.distance_m, cos, &row.color).total() * 1e3;
        rows.push(vec![
            fixed(row.incidence_deg, 1),
            fixed(row.distance_m, 2),
            row.trial.map_or("–".to_owned(), |t| t.to_string()),
            fixed(row.mean_error_mm, 1),
            or_dash(trial(printed, row), 1),
            fixed(law, 1),
        ]);
        if let Some(of_setting) = mean_of_setting(found, row) {
            rows.push(vec![
                fixed(row.incidence_deg, 0),
                String::new(),
                "mean".to_owned(),
                fixed(of_setting, 1),
                or_dash(mean(printed), 1),
                String::new(),
            ]);
        }
    }
    let remark = found.angle_law.map_or(String::new(), |fit| {
        let worst = found
            .angle_misfit
            .iter()
            .map(|m| m.misfit_mm.abs())
            .fold(0.0, f64::max);
        let verdict = if fit.is_rejected() {
            "is rejected and replaced by a table"
        } else {
            "fits"
        };
        format!(
            "the cosine law {verdict}: χ² {} with {}, maximum misfit {} mm",
            fixed(fit.chi_squared, 1),
            fit.degrees_of_freedom,
            fixed(worst, 1)
        )
    });
    Table {
        subject: Subject::Angle,
        title: "Table 3: mean error over the incidence",
        headings: vec![
            "incidence (°)",
            "distance (m)",
            "trial",
            "mean (mm)",
            "paper",
            "as fitted",
        ],
        rows,
        remark,
    }
}

fn noise(found: &Characterization) -> Table {
    let tested = |color: &str| of(found, TestKind::Color).any(|s| s.color == color);
    let row = |n: &catoptric_model::characterization::NoiseRow| {
        let printed = paper::noise(&n.color, n.distance_m);
        vec![
            n.color.clone(),
            fixed(n.distance_m, 2),
            fixed(n.sd_mm, 2),
            or_dash(printed, 2),
            or_dash(printed.map(|p| 100.0 * (n.sd_mm / p - 1.0)), 1),
        ]
    };
    Table {
        subject: Subject::Color,
        title: "Table 4: standard deviation by color",
        headings: vec!["color", "distance (m)", "STD (mm)", "paper", "difference (%)"],
        rows: found.noise.iter().filter(|n| tested(&n.color)).map(row).collect(),
        remark: String::new(),
    }
}

/// Returns the injected value of a fitted parameter.
fn injected_value(parameter: &Parameter, bias: &RangeBias, moved_to_normal: bool) -> f64 {
    let color = parameter.color.as_deref().and_then(|c| bias.color.get(c));
    match parameter.symbol.as_str() {
        "E_r" => {
            let distance = parameter.distance_m.unwrap_or(0.0);
            let normal = if moved_to_normal {
                bias.angle.error(1.0)
            } else {
                0.0
            };
            (bias.distance.error(distance) + normal) * 1e3
        }
        "A_a" => bias.angle.gain_mm,
        "B_a" => bias.angle.offset_mm,
        "A_c" => color.map_or(0.0, |c| c.slope_mm_per_m),
        _ => color.map_or(0.0, |c| c.offset_mm),
    }
}

fn numbers(found: &Characterization, injected: Option<&RangeBias>) -> Table {
    let normal_in_distance = !found.bias.distance.range_m.is_empty();
    let mut headings = vec!["number", "of", "value", "σ", "unit", "paper"];
    if injected.is_some() {
        headings.extend(["injected", "error (σ)"]);
    }
    let row = |p: &Parameter| {
        let printed = match p.symbol.as_str() {
            "E_r" => p
                .distance_m
                .and_then(|d| mean(paper::at_distance(&paper::TABLE_2, |r| r.0, d).map(|r| r.1))),
            "A_a" => Some(paper::EQUATION_4[0]),
            "B_a" => Some(paper::EQUATION_4[1]),
            _ => None,
        };
        let place = p.distance_m.map(|d| format!("{} m", fixed(d, 2)));
        let mut cells = vec![
            p.symbol.clone(),
            place.or_else(|| p.color.clone()).unwrap_or_default(),
            fixed(p.value, 2),
            fixed(p.sd, 2),
            p.unit.clone(),
            or_dash(printed, 1),
        ];
        if let Some(bias) = injected {
            let truth = injected_value(p, bias, normal_in_distance);
            cells.extend([fixed(truth, 2), fixed((p.value - truth) / p.sd, 1)]);
        }
        cells
    };
    let convention = if normal_in_distance {
        "E_r includes the error at normal incidence, B_a = −A_a"
    } else {
        "E_r is 0"
    };
    let verdict = if found.fit.is_rejected() {
        "does not fit"
    } else {
        "fits"
    };
    Table {
        subject: Subject::Numbers,
        title: "Parameters of Eqs. (3)–(5)",
        headings,
        rows: found.parameters.iter().map(row).collect(),
        remark: format!(
            "{convention}; the model {verdict} the {} means: χ² {} with {}",
            found.fit.degrees_of_freedom + found.parameters.len(),
            fixed(found.fit.chi_squared, 0),
            found.fit.degrees_of_freedom
        ),
    }
}

impl Table {
    /// Formats the table as text with aligned columns, numbers right-aligned.
    pub fn text(&self) -> String {
        let width = |column: usize| {
            let cells = self.rows.iter().map(|row| row[column].chars().count());
            cells
                .chain([self.headings[column].chars().count()])
                .max()
                .unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.headings.len()).map(width).collect();
        let line = |cells: Vec<&str>| {
            let padded = cells.iter().zip(&widths).map(|(cell, width)| {
                let space = " ".repeat(width - cell.chars().count());
                if cell.starts_with(char::is_alphabetic) {
                    format!("{cell}{space}")
                } else {
                    format!("{space}{cell}")
                }
            });
            padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
        };
        let mut text = format!("{}\n", self.title);
        text += &format!("  {}\n", line(self.headings.clone()));
        for row in &self.rows {
            text += &format!("  {}\n", line(row.iter().map(String::as_str).collect()));
        }
        if !self.remark.is_empty() {
            text += &format!("  {}\n", self.remark);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned() {
        let table = Table {
            subject: Subject::Numbers,
            title: "T",
            headings: vec!["a", "wide"],
            rows: vec![
                vec!["red".to_owned(), "−1.5".to_owned()],
                vec!["b".to_owned(), "–".to_owned()],
            ],
            remark: "end".to_owned(),
        };
        assert_eq!(table.text(), "T\n  a    wide\n  red  −1.5\n  b       –\n  end\n");
    }

    #[test]
    fn numbers_rounded_to_zero_have_no_sign() {
        assert_eq!(fixed(-0.04, 1), "0.0");
        assert_eq!(fixed(-0.06, 1), "-0.1");
    }

    #[test]
    fn values_of_the_paper_are_shown_next_to_close_ones_only() {
        assert_eq!(paper::noise("jet_black", 1.02), Some(6.06));
        assert_eq!(paper::noise("jet_black", 1.3), None);
        assert_eq!(paper::noise("white", 1.011), None);
        assert_eq!(paper::at_incidence(-44.0).map(|p| p.1[0]), Some(35.4));
        assert!(paper::at_incidence(44.7).is_none());
    }
}
