//! Which elements a mirror deflects (step 4): compares what each beam read in the known room and elsewhere with what an
//! undeflected beam would have read.

mod abnormal;
mod evidence;
mod near;
mod tally;

use crate::mount::pose::Mount;
use crate::readings::observations::BoardInSensor;
use catoptric_model::{Dataset, Summary};
use evidence::Screen;
use near::facets_near;
use rayon::prelude::*;

/// The class of an element by screening.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ScreenClass {
    /// It reads what an undeflected beam reads; the text states how often.
    Direct(String),
    /// A mirror may deflect it: indices of facets, the most probable first.
    Deflected(Vec<usize>),
    /// Its readings are unusable, with the reason.
    Rejected(String),
}

/// The class of every element, in order; `boards` holds each pose's board in the sensor frame.
pub(crate) fn candidates(
    dataset: &Dataset,
    summaries: &[Vec<Summary>],
    mount: &Mount,
    boards: &[Option<BoardInSensor>],
) -> Vec<ScreenClass> {
    let screen = Screen::new(dataset, summaries, mount, boards);
    let beams = (0..dataset.session.scanner.scan.beams()).into_par_iter();
    beams.map(|b| screen.classify(b)).collect()
}

impl Screen<'_> {
    /// The class of one element, from statistics alone.
    fn classify(&self, beam: usize) -> ScreenClass {
        let session = &self.dataset.session;
        let facets = facets_near(&session.scanner.scan, &session.facets, beam);
        let tally = self.tally(beam, &facets);
        if let Some(reason) = self.abnormal(beam, &facets) {
            return ScreenClass::Rejected(reason);
        }
        if tally.is_direct() {
            return ScreenClass::Direct(format!(
                "reads what is straight ahead in {} of {} stretches",
                tally.agreeing, tally.usable
            ));
        }
        if !facets.is_empty() {
            return ScreenClass::Deflected(facets);
        }
        ScreenClass::Rejected(match tally.worst {
            Some((expected, found, stretch)) => format!(
                "no mirror is drawn for it, yet it reads what is straight ahead in only {} of {} stretches: \
                 expected {expected:.3} m in stretch {stretch}, found {found:.3} m",
                tally.agreeing, tally.usable
            ),
            None => "no mirror is drawn for it and no stretch shows what it reads".to_owned(),
        })
    }
}
