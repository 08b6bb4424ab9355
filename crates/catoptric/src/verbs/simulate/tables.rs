//! The tables of the truth: what every beam hits, `truth/returns.csv`, and every error of every reading,
//! `truth/readings.csv`.

use crate::Error;
use catoptric_files::names::defused;
use catoptric_sim::laboratory::Returns;
use catoptric_sim::light::Role;
use catoptric_sim::receive::{RandomEffects, Return};
use catoptric_sim::scene::ErrorModel;
use catoptric_sim::{Laboratory, Scene};
use std::fmt::Write as _;

/// A sink for the rows of a table.
pub(crate) type EmitRows<'a> = &'a mut dyn FnMut(&str) -> Result<(), Error>;

/// Header of truth/returns.csv. A reading is geometric + mixed + detection + the three biases, plus the errors listed in
/// truth/readings.csv, rounded. A beam has one row per echo, and none without an echo. `scan` is empty where nothing
/// moves and the row holds for every scan; the incidences on the facets are joined in the same way as their names.
pub(crate) const RETURNS_HEADER: &str = "pose,beam,surface,facets,geometric_m,cos_incidence,power_w,share,mixed_m,detection_m,\
                              distance_bias_m,angle_bias_m,color_bias_m,noise_sd_m,echo,detection_probability,\
                              facet_cos_incidence,scan\n";

/// Returns the names of all mirrors, by index.
pub(crate) fn mirror_names(scene: &Scene) -> Vec<&str> {
    let facets = scene.superstructure.facet.iter().map(|f| f.name.as_str());
    let mirrors = scene.room.mirror.iter().map(|m| m.name.as_str());
    facets.chain(mirrors).collect()
}

/// Returns the role of a surface as written in the tables of the truth.
pub(crate) fn role_name(role: Role) -> &'static str {
    match role {
        Role::Facet(_) => "facet",
        Role::Structure => "structure",
        Role::Board => "board",
        Role::Wall => "wall",
        Role::Object => "object",
    }
}

/// Quotes a field of free text, since a name may contain commas and quotes, or begin like a formula.
pub(crate) fn field(text: &str) -> String {
    format!("\"{}\"", defused(text).replace('"', "\"\""))
}

/// Returns the names of the mirrors on a path, as one field.
pub(crate) fn path_field(names: &[&str], facets: &[usize]) -> String {
    let facets: Vec<&str> = facets.iter().map(|f| names[*f]).collect();
    field(&facets.join(">"))
}

/// A column of numbers as text: a number equal to that of the previous row is not formatted again.
#[derive(Default)]
struct Column {
    last: Option<f64>,
    text: String,
}

impl Column {
    fn add(&mut self, number: f64, to: &mut String) {
        if self.last.map(f64::to_bits) != Some(number.to_bits()) {
            self.last = Some(number);
            self.text.clear();
            // Writing to a string never fails.
            let _ = write!(self.text, "{number},");
        }
        to.push_str(&self.text);
    }
}

/// Formats the rows of truth/returns.csv, in the order of the beams.
pub(crate) struct ReturnRows<'a> {
    names: Vec<&'a str>,
    before_echo: [Column; 10],
    probability: Column,
}

impl<'a> ReturnRows<'a> {
    pub(crate) fn new(laboratory: &'a Laboratory) -> Self {
        Self {
            names: mirror_names(laboratory.scene()),
            before_echo: Default::default(),
            probability: Column::default(),
        }
    }

    /// Appends the rows of a scan; `scan` is empty if they hold for every scan.
    pub(crate) fn add(&mut self, pose: usize, returns: &Returns, scan: &str, text: &mut String) {
        for (beam, found) in returns.iter().enumerate() {
            for (echo, r) in found.iter().flat_map(Return::echoes).enumerate() {
                // Writing to a string never fails.
                let facets = path_field(&self.names, &r.facets);
                let _ = write!(text, "{pose},{beam},{},{facets},", role_name(r.role));
                let numbers = [
                    r.geometric,
                    r.cos_incidence,
                    r.power,
                    r.share,
                    r.mixed,
                    r.detection,
                    r.bias.distance,
                    r.bias.angle,
                    r.bias.color,
                    r.noise_sd,
                ];
                for (number, column) in numbers.into_iter().zip(&mut self.before_echo) {
                    column.add(number, text);
                }
                let _ = write!(text, "{echo},");
                self.probability.add(r.probability, text);
                for (k, cos) in r.facet_cos_incidence.iter().enumerate() {
                    let _ = write!(text, "{}{cos}", if k == 0 { "" } else { ">" });
                }
                text.extend([",", scan, "\n"]);
            }
        }
    }
}

/// Header of truth/readings.csv. `echo` is the reported echo of truth/returns.csv, empty if none was detected; a
/// reading is the range of that echo plus the six errors, rounded, unless `lost` is 1.
pub(crate) const READINGS_HEADER: &str =
    "pose,scan,beam,echo,lost,drift_m,warm_up_m,noise_m,correlated_m,interference_m,reading_m,element_m\n";

/// Formats the rows of a scan from its returns, its random effects and its readings.
pub(crate) fn rows_of_readings(
    laboratory: &Laboratory,
    (pose, scan): (usize, usize),
    returns: &Returns,
    effects: &[RandomEffects],
    readings: &[f64],
) -> String {
    let errors = &laboratory.scene().errors;
    let dropout = match errors.model {
        ErrorModel::None => 0.0,
        _ => errors.dropout,
    };
    let mut text = String::new();
    let beams = returns.iter().zip(effects).zip(readings).enumerate();
    for (beam, ((found, effects), reading)) in beams {
        let mut echoes = found.iter().flat_map(Return::echoes).zip(effects.detection);
        let detected = echoes.position(|(echo, draw)| draw < echo.probability);
        let noise_sd = found.as_ref().zip(detected).and_then(|(r, k)| r.echoes().nth(k));
        let noise = noise_sd.map_or(0.0, |echo| echo.noise_sd * effects.noise);
        let echo = detected.map_or(String::new(), |k| k.to_string());
        let lost = u8::from(detected.is_some() && effects.dropout < dropout);
        // Writing to a string never fails.
        let _ = writeln!(
            text,
            "{pose},{scan},{beam},{echo},{lost},{},{},{noise},{},{},{reading},{}",
            effects.drift, effects.warm_up, effects.correlated, effects.interference, effects.element,
        );
    }
    text
}
