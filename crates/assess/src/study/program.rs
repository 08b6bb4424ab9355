//! Third-party calibrators as programs: each is given the folder of a blind dataset and writes `calibration.json`.

use crate::validate::{Severity, validate};
use catoptric_files::{dataset::DatasetWriter, manifest::Provenance};
use catoptric_model::{Calibration, Stop};
use catoptric_sim::{Laboratory, noise};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Maximum number of characters quoted from a program's output.
const QUOTED: usize = 300;

/// Interval at which a program is polled for its end.
const POLL: Duration = Duration::from_millis(20);

/// A calibration program and its command line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Program {
    /// Its name in tables.
    pub name: String,
    /// Words of the command; `{dataset}` and `{out}` are replaced by the folder and by the file to write, and appended
    /// if no word contains them.
    pub command: Vec<String>,
    /// Time limit, in seconds. The program is killed then, on Unix along with its child processes.
    pub timeout_s: u64,
}

impl Program {
    /// Parses `NAME=COMMAND`, splitting the command at spaces; `None` without a name or a command.
    pub fn parse(text: &str, timeout_s: u64) -> Option<Self> {
        let (name, command) = text.split_once('=')?;
        let command: Vec<String> = command.split_whitespace().map(str::to_owned).collect();
        (!name.is_empty() && !command.is_empty()).then(|| Self {
            name: name.to_owned(),
            command,
            timeout_s,
        })
    }

    /// Records an experiment into a temporary folder, without its truth, and runs the program on it. Once `stop` is
    /// requested, the program is killed.
    ///
    /// # Errors
    /// As text independent of the path of the folder: the program cannot be started, fails, exceeds its time limit, or
    /// does not write a valid calibration.
    pub fn calibrate(&self, laboratory: &Laboratory, stop: &Stop) -> Result<Calibration, String> {
        let folder = tempfile::tempdir().map_err(|e| format!("no folder can be created for it: {e}"))?;
        self.calibrate_in(folder.path(), laboratory, stop)
            .map_err(|words| shortened(&anywhere(folder.path(), words)))
    }

    fn calibrate_in(
        &self,
        folder: &Path,
        laboratory: &Laboratory,
        stop: &Stop,
    ) -> Result<Calibration, String> {
        let (dataset, out) = (folder.join("dataset"), folder.join("calibration.json"));
        record(laboratory, &dataset).map_err(|e| format!("its dataset cannot be written: {e}"))?;
        self.run(&dataset, &out, stop)?;
        if !out.exists() {
            return Err("it wrote no calibration".to_owned());
        }
        let calibration: Calibration = catoptric_files::read_calibration(&out)
            .map_err(|e| format!("what it wrote cannot be read: {e}"))?;
        let problems = validate(&calibration);
        match problems.iter().find(|p| p.severity == Severity::Error) {
            Some(problem) => Err(format!("what it wrote is not valid: {problem}")),
            None => Ok(calibration),
        }
    }

    /// Returns the words of the command with the paths of the files.
    fn words(&self, dataset: &Path, out: &Path) -> Vec<String> {
        let places =
            [("{dataset}", dataset), ("{out}", out)].map(|(key, path)| (key, path.to_string_lossy()));
        let mut words = self.command.clone();
        for (key, path) in &places {
            if !self.command.iter().any(|word| word.contains(key)) {
                words.push(path.clone().into_owned());
            }
            for word in &mut words {
                *word = word.replace(key, path);
            }
        }
        words
    }

    fn run(&self, dataset: &Path, out: &Path, stop: &Stop) -> Result<(), String> {
        let words = self.words(dataset, out);
        let said = tempfile::tempfile().map_err(|e| e.to_string())?;
        let errors = said.try_clone().map_err(|e| e.to_string())?;
        let mut command = Command::new(&words[0]);
        command
            .args(&words[1..])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(errors);
        let mut child = spawn(&mut command).map_err(|e| format!("{:?} cannot be started: {e}", words[0]))?;
        let begin = Instant::now();
        let status = loop {
            match child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) if stop.is_requested() => {
                    end(&mut child);
                    return Err("it was stopped".to_owned());
                }
                Ok(None) if begin.elapsed() > Duration::from_secs(self.timeout_s) => {
                    end(&mut child);
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

/// Starts a program as the leader of a new process group, so that its child processes can be killed with it.
#[cfg(unix)]
fn spawn(command: &mut Command) -> std::io::Result<Child> {
    use std::os::unix::process::CommandExt;
    command.process_group(0).spawn()
}

#[cfg(not(unix))]
fn spawn(command: &mut Command) -> std::io::Result<Child> {
    command.spawn()
}

/// Kills a program and its process group. It has not been waited for, so its process ID is still valid.
fn end(child: &mut Child) {
    #[cfg(unix)]
    if let Ok(group) = i32::try_from(child.id()) {
        use nix::sys::signal::{Signal, killpg};
        // The group may be empty already.
        let _ = killpg(nix::unistd::Pid::from_raw(group), Signal::SIGKILL);
    }
    // It may just have ended on its own.
    let _ = child.kill();
    let _ = child.wait();
}

/// Returns what a program wrote to standard error.
fn last_words(mut said: std::fs::File) -> String {
    use std::io::{Read, Seek, SeekFrom};
    let mut text = Vec::new();
    if said.seek(SeekFrom::Start(0)).is_err() || said.read_to_end(&mut text).is_err() {
        return String::new();
    }
    let text = String::from_utf8_lossy(&text);
    match text.trim() {
        "" => String::new(),
        text => format!(": {text}"),
    }
}

/// Replaces the path of the temporary folder in a text, so that the same failure reads the same in every run.
fn anywhere(folder: &Path, words: String) -> String {
    let real = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let mut words = words;
    for place in [real.as_path(), folder] {
        for (file, key) in [("dataset", "{dataset}"), ("calibration.json", "{out}")] {
            words = words.replace(place.join(file).to_string_lossy().as_ref(), key);
        }
        words = words.replace(place.to_string_lossy().as_ref(), "{folder}");
    }
    words
}

/// Joins a text to one line, and shortens a long one to its beginning and end, where programs report what is wrong.
fn shortened(words: &str) -> String {
    let line = words.split_whitespace().collect::<Vec<_>>().join(" ");
    let length = line.chars().count();
    if length <= QUOTED {
        return line;
    }
    let half = QUOTED / 2;
    let begin: String = line.chars().take(half).collect();
    let end: String = line.chars().skip(length - half).collect();
    format!("{begin} … {end}")
}

/// Writes the dataset of a laboratory without the truth.
fn record(laboratory: &Laboratory, out: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let mut writer = DatasetWriter::create(out, false, &laboratory.session()?)?;
    for number in 0..laboratory.stretches() {
        writer.write_stretch(&laboratory.stretch(number)?)?;
    }
    writer.finish_blind(Provenance {
        seed: 0,
        command_line: "catoptric study".to_owned(),
        rng_rule: noise::RULE.to_owned(),
    })?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_reads_the_same_in_every_folder() {
        let folder = Path::new("/folder/of-random");
        let words =
            "no /folder/of-random/dataset/x,\n no /folder/of-random/calibration.json, no /folder/of-random/y"
                .to_owned();
        let said = shortened(&anywhere(folder, words));
        assert_eq!(said, "no {dataset}/x, no {out}, no {folder}/y");
        let long = shortened(&format!("ended: {}why", "word ".repeat(200)));
        assert!(
            long.starts_with("ended: word")
                && long.ends_with("word why")
                && long.chars().count() <= QUOTED + 3
        );
    }

    #[test]
    fn missing_placeholders_are_appended_to_a_command() {
        let words = |command: &str| {
            let program = Program::parse(&format!("mine={command}"), 5).expect("it has a command");
            program.words(Path::new("/d"), Path::new("/o")).join(" ")
        };
        assert_eq!(words("run"), "run /d /o");
        assert_eq!(words("run {dataset}"), "run /d /o");
        assert_eq!(words("run --out={out}"), "run --out=/o /d");
        assert_eq!(words("run {out} {dataset}/x"), "run /o /d/x");
    }

    #[test]
    fn a_program_has_a_name_and_a_command() {
        let program = Program::parse("mine=python3 a.py --data={dataset}", 5).expect("it has both");
        assert_eq!((program.name.as_str(), program.command.len()), ("mine", 3));
        assert!(
            ["mine", "=true", "mine=", "mine=  "]
                .iter()
                .all(|t| Program::parse(t, 5).is_none())
        );
    }
}
