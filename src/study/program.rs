//! Anybody's calibrator as a program: it gets the folder of a blind dataset and writes `calibration.json`.

use crate::io::{self, dataset::DatasetWriter, manifest::Provenance};
use crate::validate::{Severity, validate};
use catoptric_model::Calibration;
use catoptric_sim::{Laboratory, noise};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Characters of a program's own words that are passed on.
const QUOTED: usize = 300;

/// Time between two looks whether a program has ended.
const POLL: Duration = Duration::from_millis(20);

/// A program and how it is called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    /// What tables call it.
    pub name: String,
    /// Words of the command; `{dataset}` and `{out}` stand for the folder and for the file to write, and are added at the
    /// end where no word has them.
    pub command: Vec<String>,
    /// After how long it is taken to hang, in seconds.
    pub timeout_s: u64,
}

impl Program {
    /// A program from `NAME=COMMAND`, the command split at spaces; `None` without a name or a command.
    pub fn parse(text: &str, timeout_s: u64) -> Option<Self> {
        let (name, command) = text.split_once('=')?;
        let command: Vec<String> = command.split_whitespace().map(str::to_owned).collect();
        (!name.is_empty() && !command.is_empty()).then(|| Self {
            name: name.to_owned(),
            command,
            timeout_s,
        })
    }

    /// Records an experiment into a folder that goes afterwards, without its truth, and runs the program on it.
    ///
    /// # Errors
    /// In words: the program cannot be started, fails, hangs, or what it writes is no sane calibration.
    pub fn calibrate(&self, laboratory: &Laboratory) -> Result<Calibration, String> {
        let folder = tempfile::tempdir().map_err(|e| format!("no folder can be made for it: {e}"))?;
        let (dataset, out) = (
            folder.path().join("dataset"),
            folder.path().join("calibration.json"),
        );
        record(laboratory, &dataset).map_err(|e| format!("its dataset cannot be written: {e}"))?;
        self.run(&dataset, &out)?;
        if !out.exists() {
            return Err("it wrote no calibration".to_owned());
        }
        let calibration: Calibration =
            io::read_json(&out).map_err(|e| format!("what it wrote cannot be read: {e}"))?;
        let problems = validate(&calibration);
        match problems.iter().find(|p| p.severity == Severity::Error) {
            Some(problem) => Err(format!("what it wrote is not valid: {problem}")),
            None => Ok(calibration),
        }
    }

    fn run(&self, dataset: &Path, out: &Path) -> Result<(), String> {
        let filled = |word: &String| {
            word.replace("{dataset}", &dataset.to_string_lossy())
                .replace("{out}", &out.to_string_lossy())
        };
        let mut words: Vec<String> = self.command.iter().map(filled).collect();
        if !self
            .command
            .iter()
            .any(|w| w.contains("{dataset}") || w.contains("{out}"))
        {
            words.push(dataset.to_string_lossy().into_owned());
            words.push(out.to_string_lossy().into_owned());
        }
        let said = tempfile::tempfile().map_err(|e| e.to_string())?;
        let errors = said.try_clone().map_err(|e| e.to_string())?;
        let mut child = Command::new(&words[0])
            .args(&words[1..])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(errors)
            .spawn()
            .map_err(|e| format!("{:?} cannot be started: {e}", words[0]))?;
        let begin = Instant::now();
        let status = loop {
            match child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) if begin.elapsed() > Duration::from_secs(self.timeout_s) => {
                    // It may just have ended by itself.
                    let _ = child.kill();
                    let _ = child.wait();
                    return Err(format!("it did not end within {} s", self.timeout_s));
                }
                Ok(None) => std::thread::sleep(POLL),
                Err(e) => return Err(format!("it cannot be waited for: {e}")),
            }
        };
        if status.success() {
            return Ok(());
        }
        Err(format!("it ended with {status}{}", last_words(said)))
    }
}

/// The end of what a program said.
fn last_words(mut said: std::fs::File) -> String {
    use std::io::{Read, Seek, SeekFrom};
    let mut text = Vec::new();
    if said.seek(SeekFrom::Start(0)).is_err() || said.read_to_end(&mut text).is_err() {
        return String::new();
    }
    let text = String::from_utf8_lossy(&text);
    let text = text.trim();
    let skipped = text.chars().count().saturating_sub(QUOTED);
    let end: String = text.chars().skip(skipped).collect();
    if end.is_empty() {
        String::new()
    } else {
        format!(": {}", end.replace('\n', " "))
    }
}

/// The dataset of a laboratory, blind.
fn record(laboratory: &Laboratory, out: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let mut writer = DatasetWriter::create(out, false, &laboratory.session()?)?;
    for number in 0..laboratory.stretches() {
        writer.write_stretch(&laboratory.stretch(number)?)?;
    }
    writer.finish(Provenance {
        seed: 0,
        command_line: "catoptric study".to_owned(),
        rng_rule: noise::RULE.to_owned(),
    })?;
    Ok(())
}
