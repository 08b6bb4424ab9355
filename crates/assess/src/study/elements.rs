//! Angles of every element of every run, and their table `elements.csv`, which preserves every number exactly.

use catoptric_files::names::{defused, original};

/// Header of `elements.csv`. Angles are in degrees.
pub const ELEMENTS_HEADER: [&str; 8] = [
    "cell",
    "seed",
    "method",
    "beam",
    "azimuth_deg",
    "elevation_deg",
    "true_azimuth_deg",
    "true_elevation_deg",
];

/// Angles of an element in one run, in degrees.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementAngles {
    /// Index of the cell.
    pub cell: usize,
    /// Seed.
    pub seed: u64,
    /// Name of the contestant.
    pub method: String,
    /// Beam.
    pub beam: usize,
    /// Estimated θ_a and φ.
    pub estimate: [f64; 2],
    /// True θ_a and φ.
    pub truth: [f64; 2],
}

impl ElementAngles {
    /// Returns the error of θ_a, wrapped to −180° … 180°, and of φ, in degrees.
    pub fn error(&self) -> [f64; 2] {
        let azimuth = self.estimate[0] - self.truth[0];
        [
            azimuth - 360.0 * (azimuth / 360.0).round(),
            self.estimate[1] - self.truth[1],
        ]
    }
}

/// Formats elements as a table.
pub fn elements_to_csv(elements: &[ElementAngles]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    // Writing to memory cannot fail.
    let _ = writer.write_record(ELEMENTS_HEADER);
    for e in elements {
        let [azimuth, elevation] = e.estimate.map(|a| a.to_string());
        let [true_azimuth, true_elevation] = e.truth.map(|a| a.to_string());
        let _ = writer.write_record([
            e.cell.to_string(),
            e.seed.to_string(),
            defused(&e.method).into_owned(),
            e.beam.to_string(),
            azimuth,
            elevation,
            true_azimuth,
            true_elevation,
        ]);
    }
    let bytes = writer.into_inner().unwrap_or_default();
    String::from_utf8(bytes).unwrap_or_default()
}

/// Parses elements from a table.
///
/// # Errors
/// As text, with the line that [`elements_to_csv`] could not have written.
pub fn elements_from_csv(text: &str) -> Result<Vec<ElementAngles>, String> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| e.to_string())?;
    if header != ELEMENTS_HEADER[..] {
        return Err(format!(
            "line 1: the columns are not {}",
            ELEMENTS_HEADER.join(",")
        ));
    }
    let mut elements = Vec::new();
    for (i, record) in reader.records().enumerate() {
        let record = record.map_err(|e| e.to_string())?;
        elements.push(parsed(&record).ok_or_else(|| format!("line {}: not a valid element", i + 2))?);
    }
    Ok(elements)
}

fn parsed(record: &csv::StringRecord) -> Option<ElementAngles> {
    let angle = |i: usize| record.get(i)?.parse::<f64>().ok();
    Some(ElementAngles {
        cell: record.get(0)?.parse().ok()?,
        seed: record.get(1)?.parse().ok()?,
        method: original(record.get(2)?).to_owned(),
        beam: record.get(3)?.parse().ok()?,
        estimate: [angle(4)?, angle(5)?],
        truth: [angle(6)?, angle(7)?],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_round_trips_exactly() {
        let element = ElementAngles {
            cell: 2,
            seed: 3,
            method: "=mine, with \"words\"".to_owned(),
            beam: 700,
            estimate: [179.9, 0.1 + 0.2],
            truth: [-179.9, 1.0 / 3.0],
        };
        let text = elements_to_csv(std::slice::from_ref(&element));
        assert_eq!(elements_from_csv(&text), Ok(vec![element.clone()]));
        assert!((element.error()[0] + 0.2).abs() < 1e-9, "{:?}", element.error());
        let broken = text.replace("700", "seven");
        assert_eq!(
            elements_from_csv(&broken),
            Err("line 2: not a valid element".to_owned())
        );
        assert!(elements_from_csv("a,b\n").is_err());
    }
}
