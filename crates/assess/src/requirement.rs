//! Requirements on figures, such as `field_of_regard>=0.004`, for pipelines that check results automatically.
//!
//! Every number of the JSON except those of single elements has a name: its keys joined by dots, facets by their names,
//! other lists by index. `*` instead of a facet's name means every facet.

use catoptric_model::place::nearest;
use serde_json::Value;
use std::fmt;

/// A limit on a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Requirement {
    key: String,
    comparison: Comparison,
    limit: f64,
    /// The text as written.
    text: String,
}

/// Description of a requirement that is not met.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unmet(String);

/// A figure that a requirement names.
#[derive(Debug, Clone, PartialEq)]
pub struct Checked {
    /// Its name.
    pub key: String,
    /// Its value, if it has one.
    pub value: Option<f64>,
    /// Whether the requirement is met.
    pub met: bool,
}

/// Why a requirement is invalid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RequirementError {
    /// Not a comparison of a name with a number.
    #[error("{text:?} is not a requirement: it takes a name, one of >= <= > <, and a number")]
    Form {
        /// The text as written.
        text: String,
    },
    /// Not a name, `=` and a number.
    #[error("{text:?} is not a limit: it takes a name, =, and a number")]
    Limit {
        /// The text as written.
        text: String,
    },
    /// Nothing has that name.
    #[error("{key:?} is not a figure")]
    Unknown {
        /// The name.
        key: String,
        /// The name that was probably meant, or some of the existing ones.
        help: String,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Comparison {
    AtLeast,
    AtMost,
    Above,
    Below,
}

/// Longer signs first: `>=` begins with `>`.
const SIGNS: [(&str, Comparison); 4] = [
    (">=", Comparison::AtLeast),
    ("<=", Comparison::AtMost),
    (">", Comparison::Above),
    ("<", Comparison::Below),
];

impl RequirementError {
    /// Returns advice on how to correct it, where there is any.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::Form { .. } | Self::Limit { .. } => None,
            Self::Unknown { help, .. } => Some(help.clone()),
        }
    }
}

impl Requirement {
    /// Parses a requirement.
    ///
    /// ```
    /// use catoptric_assess::Requirement;
    /// assert!(Requirement::parse("field_of_regard>=0.004").is_ok());
    /// assert!(Requirement::parse("field_of_regard").is_err());
    /// ```
    ///
    /// # Errors
    /// [`RequirementError::Form`] for anything that is not a comparison of a name with a number.
    pub fn parse(text: &str) -> Result<Self, RequirementError> {
        let form = || RequirementError::Form {
            text: text.to_owned(),
        };
        let found = SIGNS
            .iter()
            .find_map(|(sign, c)| Some((text.split_once(sign)?, *c)));
        let ((key, limit), comparison) = found.ok_or_else(form)?;
        let (key, limit) = (
            key.trim(),
            limit.trim().parse::<f64>().ok().filter(|l| l.is_finite()),
        );
        let limit = limit.filter(|_| !key.is_empty()).ok_or_else(form)?;
        Ok(Self {
            key: key.to_owned(),
            comparison,
            limit,
            text: text.to_owned(),
        })
    }

    /// Parses `figure=x` as the smallest value allowed.
    ///
    /// ```
    /// use catoptric_assess::Requirement;
    /// assert_eq!(Requirement::minimum("coverage_95=0.8").unwrap().to_string(), "coverage_95>=0.8");
    /// assert_eq!(Requirement::maximum("distance_mm.rms=2").unwrap().to_string(), "distance_mm.rms<=2");
    /// ```
    ///
    /// # Errors
    /// [`RequirementError::Limit`] for anything that is not a name, `=` and a number.
    pub fn minimum(text: &str) -> Result<Self, RequirementError> {
        Self::limit_of(text, ">=")
    }

    /// Parses `figure=x` as the largest value allowed.
    ///
    /// # Errors
    /// Same as [`minimum`](Self::minimum).
    pub fn maximum(text: &str) -> Result<Self, RequirementError> {
        Self::limit_of(text, "<=")
    }

    fn limit_of(text: &str, sign: &str) -> Result<Self, RequirementError> {
        let limit = || RequirementError::Limit {
            text: text.to_owned(),
        };
        let (key, number) = text.split_once('=').ok_or_else(limit)?;
        if key.contains(['<', '>']) {
            return Err(limit());
        }
        Self::parse(&format!("{}{sign}{}", key.trim(), number.trim())).map_err(|_| limit())
    }

    /// Checks it on the named figures of any named object.
    ///
    /// `examples` are figures for the help of an unknown name; a figure without a value meets no limit.
    ///
    /// # Errors
    /// [`RequirementError::Unknown`] if no figure has that name.
    pub fn judge_figures(
        &self,
        name: &str,
        figures: &[(String, Option<f64>)],
        examples: &str,
    ) -> Result<Vec<Unmet>, RequirementError> {
        let found = self.check(figures, examples)?;
        let unmet = found.iter().filter(|c| !c.met);
        let describe = |c: &Checked| match c.value {
            Some(value) => Unmet(format!(
                "{name}: {} is {}, required {}",
                c.key,
                self.shown(value),
                self.text
            )),
            None => Unmet(format!("{name}: {} has no value, required {}", c.key, self.text)),
        };
        Ok(unmet.map(describe).collect())
    }

    /// Returns every figure that it names, and whether it is met.
    ///
    /// # Errors
    /// Same as [`judge_figures`](Self::judge_figures).
    pub fn check(
        &self,
        figures: &[(String, Option<f64>)],
        examples: &str,
    ) -> Result<Vec<Checked>, RequirementError> {
        let all = figures.iter().filter(|(key, _)| matches(&self.key, key));
        let checked = all.map(|(key, value)| Checked {
            key: key.clone(),
            value: *value,
            met: value.is_some_and(|v| self.holds(v)),
        });
        let checked: Vec<Checked> = checked.collect();
        if !checked.is_empty() {
            return Ok(checked);
        }
        let mut names: Vec<String> = figures.iter().map(|(key, _)| starred(key)).collect();
        names.extend(figures.iter().map(|(key, _)| key.clone()));
        let help = match nearest(&self.key, names.iter().map(String::as_str)) {
            Some(near) => format!("did you mean {near}?"),
            None => format!("every number of --json has a name, its keys joined by dots: {examples}"),
        };
        Err(RequirementError::Unknown {
            key: self.key.clone(),
            help,
        })
    }

    /// Returns the smallest value allowed, if it bounds from below.
    pub fn at_least(&self) -> Option<f64> {
        match self.comparison {
            Comparison::AtLeast | Comparison::Above => Some(self.limit),
            Comparison::AtMost | Comparison::Below => None,
        }
    }

    /// Returns the largest value allowed, if it bounds from above.
    pub fn at_most(&self) -> Option<f64> {
        match self.comparison {
            Comparison::AtLeast | Comparison::Above => None,
            Comparison::AtMost | Comparison::Below => Some(self.limit),
        }
    }

    /// Returns the name of the figure.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Returns the relative violation: the distance of figures from the limit over the limit, summed over all figures
    /// it names; 1 for a figure without a value.
    pub fn shortfall(&self, figures: &[(String, Option<f64>)]) -> f64 {
        let named = figures.iter().filter(|(key, _)| matches(&self.key, key));
        let scale = if self.limit == 0.0 { 1.0 } else { self.limit.abs() };
        named
            .map(|(_, value)| match value {
                Some(value) if self.holds(*value) => 0.0,
                Some(value) => (value - self.limit).abs() / scale,
                None => 1.0,
            })
            .sum()
    }

    /// A value in six digits, or in as many as show that it is not met.
    fn shown(&self, value: f64) -> String {
        let digits = |count: usize| format!("{value:.*e}", count - 1).parse().unwrap_or(value);
        let short = (6..=17).map(digits).find(|short: &f64| !self.holds(*short));
        short.unwrap_or(value).to_string()
    }

    fn holds(&self, value: f64) -> bool {
        match self.comparison {
            Comparison::AtLeast => value >= self.limit,
            Comparison::AtMost => value <= self.limit,
            Comparison::Above => value > self.limit,
            Comparison::Below => value < self.limit,
        }
    }
}

impl fmt::Display for Requirement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl fmt::Display for Unmet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Returns every number of an object with its name, except those below the given keys; `None` for one without a value.
pub fn numbers(object: &Value, skipped: &[&str]) -> Vec<(String, Option<f64>)> {
    let mut found = Vec::new();
    for (key, value) in object.as_object().into_iter().flatten() {
        if !skipped.contains(&key.as_str()) {
            collect(key, value, &mut found);
        }
    }
    found
}

fn collect(key: &str, value: &Value, found: &mut Vec<(String, Option<f64>)>) {
    match value {
        Value::Number(number) => found.push((key.to_owned(), number.as_f64())),
        Value::Null => found.push((key.to_owned(), None)),
        Value::Object(fields) => {
            for (name, value) in fields {
                collect(&format!("{key}.{name}"), value, found);
            }
        }
        Value::Array(list) => {
            for (place, value) in list.iter().enumerate() {
                let name = value.get("name").and_then(Value::as_str);
                let step = name.map_or_else(|| place.to_string(), str::to_owned);
                collect(&format!("{key}.{step}"), value, found);
            }
        }
        Value::Bool(_) | Value::String(_) => {}
    }
}

/// Whether a pattern, perhaps with `*` for a facet, matches the name of a figure.
fn matches(pattern: &str, key: &str) -> bool {
    pattern == key || pattern == starred(key)
}

/// Returns the name of a facet's figure with `*` for the facet.
fn starred(key: &str) -> String {
    for list in ["accuracy.facets.", "facets."] {
        if let Some(rest) = key.strip_prefix(list)
            // Names of facets may hold dots; names of their figures do not, except those of several numbers.
            && let Some(figure) = FACET_FIGURES.iter().find(|f| rest.ends_with(**f)).copied()
        {
            return format!("{list}*{figure}");
        }
        if let Some(rest) = key.strip_prefix(list)
            && let Some((_, figure)) = rest.rsplit_once('.')
        {
            return format!("{list}*.{figure}");
        }
    }
    key.to_owned()
}

/// Figures of a facet that consist of several numbers.
const FACET_FIGURES: [&str; 16] = [
    ".beams.0",
    ".beams.1",
    ".exit_azimuth_deg.0",
    ".exit_azimuth_deg.1",
    ".exit_elevation_deg.0",
    ".exit_elevation_deg.1",
    ".mirror_at_m.0",
    ".mirror_at_m.1",
    ".direction_deg.rms",
    ".direction_deg.median",
    ".direction_deg.p95",
    ".direction_deg.max",
    ".point_at_4m_mm.rms",
    ".point_at_4m_mm.median",
    ".point_at_4m_mm.p95",
    ".point_at_4m_mm.max",
];
