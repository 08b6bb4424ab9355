//! Verdicts as JUnit XML, which CI services show: one suite for each result, one case for each gate.

use crate::compare::Comparison;
use crate::requirement::Unmet;
use crate::score::{Gate, Outcome, Score};
use crate::study::Summary;
use crate::validate::{Problem, Severity};
use std::fmt::Write;

/// What became of a case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ended {
    /// It passed.
    Passed,
    /// It did not pass: its kind, and why.
    Failed {
        /// A word, such as `fail` or `not_judged`.
        kind: &'static str,
        /// What was found and what is allowed.
        message: String,
    },
    /// It could not be judged because its input is not valid.
    Invalid(String),
    /// It does not apply.
    Skipped(String),
}

/// One case of a suite.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    /// Its name.
    pub name: String,
    /// What became of it.
    pub ended: Ended,
}

/// The cases of one result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Suite {
    /// What was judged.
    pub name: String,
    /// The verdict as one word.
    pub verdict: String,
    /// The cases.
    pub cases: Vec<Case>,
}

impl Case {
    fn of_gate(gate: &Gate) -> Self {
        let message = || gate.message.clone();
        Self {
            name: gate.name.clone(),
            ended: match gate.outcome {
                Outcome::Pass => Ended::Passed,
                Outcome::Fail => Ended::Failed {
                    kind: "fail",
                    message: message(),
                },
                Outcome::NotJudged => Ended::Failed {
                    kind: "not_judged",
                    message: message(),
                },
                Outcome::NotTested => Ended::Skipped(message()),
                Outcome::Invalid => Ended::Invalid(message()),
            },
        }
    }

    /// A requirement on some results, and by what they do not meet it.
    pub fn of_requirement(requirement: &str, unmet: &[Unmet]) -> Self {
        let messages: Vec<String> = unmet.iter().map(ToString::to_string).collect();
        let ended = if messages.is_empty() {
            Ended::Passed
        } else {
            Ended::Failed {
                kind: "fail",
                message: messages.join("; "),
            }
        };
        Self {
            name: requirement.to_owned(),
            ended,
        }
    }
}

impl Suite {
    /// The gates of a score.
    pub fn of_score(name: &str, score: &Score) -> Self {
        Self {
            name: name.to_owned(),
            verdict: score.verdict.word().to_owned(),
            cases: score.gates.iter().map(Case::of_gate).collect(),
        }
    }

    /// The gates of every calibration of a comparison.
    pub fn of_comparison(found: &Comparison) -> Vec<Self> {
        let suite = |row: &crate::compare::Row| Self {
            name: row.name.clone(),
            verdict: row.verdict.word().to_owned(),
            cases: row.gates.iter().map(Case::of_gate).collect(),
        };
        found.rows.iter().map(suite).collect()
    }

    /// The problems of a calibration; warnings are skipped cases.
    pub fn of_problems(name: &str, problems: &[Problem]) -> Self {
        let case = |p: &Problem| Case {
            name: p.key.clone(),
            ended: match p.severity {
                Severity::Error => Ended::Invalid(p.to_string()),
                Severity::Warning => Ended::Skipped(p.to_string()),
            },
        };
        let mut cases: Vec<Case> = problems.iter().map(case).collect();
        let invalid = problems.iter().any(|p| p.severity == Severity::Error);
        if !invalid {
            cases.insert(
                0,
                Case {
                    name: "valid".to_owned(),
                    ended: Ended::Passed,
                },
            );
        }
        Self {
            name: name.to_owned(),
            verdict: if invalid { "invalid" } else { "pass" }.to_owned(),
            cases,
        }
    }

    /// The contestants of a study, one case each; those of the given reasons fail.
    pub fn of_study(name: &str, summary: &Summary, reasons: &[(String, String)]) -> Self {
        let case = |contestant: String| {
            let why: Vec<&str> = reasons
                .iter()
                .filter(|(of, _)| *of == contestant)
                .map(|(_, why)| why.as_str())
                .collect();
            let ended = if why.is_empty() {
                Ended::Passed
            } else {
                Ended::Failed {
                    kind: "fail",
                    message: why.join("; "),
                }
            };
            Case {
                name: contestant,
                ended,
            }
        };
        Self {
            name: name.to_owned(),
            verdict: if reasons.is_empty() { "pass" } else { "fail" }.to_owned(),
            cases: summary.methods.iter().map(|m| case(m.label())).collect(),
        }
    }
}

/// Formats suites as JUnit XML.
pub fn to_xml(suites: &[Suite]) -> String {
    let mut xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n".to_owned();
    for suite in suites {
        let count = |is: fn(&Ended) -> bool| suite.cases.iter().filter(|c| is(&c.ended)).count();
        // Writing to a string cannot fail.
        let _ = write!(
            xml,
            "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\">\n    <properties>\n      <property name=\"verdict\" value=\"{}\"/>\n    </properties>\n",
            escaped(&suite.name),
            suite.cases.len(),
            count(|e| matches!(e, Ended::Failed { .. })),
            count(|e| matches!(e, Ended::Invalid(_))),
            count(|e| matches!(e, Ended::Skipped(_))),
            escaped(&suite.verdict)
        );
        for case in &suite.cases {
            let head = format!(
                "    <testcase classname=\"{}\" name=\"{}\"",
                escaped(&suite.name),
                escaped(&case.name)
            );
            let body = match &case.ended {
                Ended::Passed => String::new(),
                Ended::Failed { kind, message } => {
                    format!("<failure type=\"{kind}\" message=\"{}\"/>", escaped(message))
                }
                Ended::Invalid(message) => {
                    format!("<error type=\"invalid\" message=\"{}\"/>", escaped(message))
                }
                Ended::Skipped(message) => format!("<skipped message=\"{}\"/>", escaped(message)),
            };
            xml += &if body.is_empty() {
                format!("{head}/>\n")
            } else {
                format!("{head}>{body}</testcase>\n")
            };
        }
        xml += "  </testsuite>\n";
    }
    xml + "</testsuites>\n"
}

/// Text as the value of an attribute; characters that XML cannot hold become spaces.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\n' => out += "&#10;",
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_outcome_is_counted_and_nothing_breaks_out_of_an_attribute() {
        let case = |name: &str, ended| Case {
            name: name.to_owned(),
            ended,
        };
        let suite = Suite {
            name: "a \"name\" <b>&\u{1b}[31m".to_owned(),
            verdict: "fail".to_owned(),
            cases: vec![
                case("passes", Ended::Passed),
                case(
                    "fails",
                    Ended::Failed {
                        kind: "not_judged",
                        message: "1 < 2\nand more".to_owned(),
                    },
                ),
                case("invalid", Ended::Invalid("why".to_owned())),
                case("skipped", Ended::Skipped("why".to_owned())),
            ],
        };
        let xml = to_xml(&[suite]);
        assert!(
            xml.contains("tests=\"4\" failures=\"1\" errors=\"1\" skipped=\"1\""),
            "{xml}"
        );
        assert!(
            xml.contains("name=\"a &quot;name&quot; &lt;b&gt;&amp; [31m\""),
            "{xml}"
        );
        assert!(
            xml.contains("<failure type=\"not_judged\" message=\"1 &lt; 2&#10;and more\"/>"),
            "{xml}"
        );
        assert!(xml.contains("name=\"passes\"/>\n") && xml.ends_with("</testsuites>\n"));
    }
}
