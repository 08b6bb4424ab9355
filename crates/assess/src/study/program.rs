//! Third-party calibrators as programs: each is given the folder of a blind dataset and writes `calibration.json`.

use super::process::{self, Ended};
use crate::validate::{Severity, validate};
use catoptric_files::{dataset::DatasetWriter, folder::WorkFolder, manifest::Provenance};
use catoptric_model::{Calibration, Stop};
use catoptric_sim::{Laboratory, noise};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Maximum number of characters quoted from a program's output.
const QUOTED: usize = 300;

/// A calibration program and its command line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Program {
    /// Its name in tables.
    pub name: String,
    /// Words of the command; `{dataset}` and `{out}` are replaced by the folder and by the file to write, and appended
    /// if no word contains them.
    pub command: Vec<String>,
    /// Time limit, in seconds. The program is ended then, on Unix along with its child processes: it is asked to end, and
    /// killed soon after.
    pub timeout_s: u64,
}

impl Program {
    /// Parses `NAME=COMMAND`. The command is split into words as a shell does, with quotes and backslashes, but nothing in
    /// it is expanded.
    ///
    /// ```
    /// use catoptric_assess::study::Program;
    /// let program = Program::parse("mine='my python' my\\ script.py {dataset}", 60)?;
    /// assert_eq!(program.command, ["my python", "my script.py", "{dataset}"]);
    /// # Ok::<(), String>(())
    /// ```
    ///
    /// # Errors
    /// As text: there is no name or no command, or a quote does not end.
    pub fn parse(text: &str, timeout_s: u64) -> Result<Self, String> {
        let (name, command) = match text.split_once('=') {
            Some((name, command)) if !name.is_empty() => (name, command),
            _ => return Err("expected NAME=COMMAND".to_owned()),
        };
        let command = shlex::split(command).ok_or("a quote in the command does not end")?;
        if command.first().is_none_or(String::is_empty) {
            return Err("expected NAME=COMMAND, and there is no command".to_owned());
        }
        Ok(Self {
            name: name.to_owned(),
            command,
            timeout_s,
        })
    }

    /// Records an experiment into a temporary folder, without its truth, and runs the program on it. Once `stop` is
    /// requested, the program is ended.
    ///
    /// # Errors
    /// As text independent of the path of the folder: the program cannot be started, fails, exceeds its time limit, or
    /// does not write a valid calibration.
    pub fn calibrate(&self, laboratory: &Laboratory, stop: &Stop) -> Result<Calibration, String> {
        let folder =
            WorkFolder::create("study").map_err(|e| format!("no folder can be created for it: {e}"))?;
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
        let limit = Duration::from_secs(self.timeout_s);
        let ended = process::run(&mut command, limit, stop)
            .map_err(|e| format!("{:?} cannot be started: {e}", self.command[0]))?;
        match ended {
            Ended::Alone(status) if status.success() => Ok(()),
            Ended::Alone(status) => Err(format!("it ended with {status}{}", last_words(said))),
            Ended::Stopped => Err("it was stopped".to_owned()),
            Ended::TimedOut => Err(format!("it did not end within {} s", self.timeout_s)),
        }
    }
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

/// Takes the path of the temporary folder out of a text, so that the same failure reads the same in every run: what is in
/// it is named by its name.
fn anywhere(folder: &Path, words: String) -> String {
    let real = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let mut words = words;
    for place in [real.as_path(), folder] {
        let place = place.to_string_lossy();
        let inside = format!("{place}{}", std::path::MAIN_SEPARATOR);
        words = words
            .replace(&inside, "")
            .replace(place.as_ref(), "its temporary folder");
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
        assert_eq!(said, "no dataset/x, no calibration.json, no y");
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
        for (text, why) in [
            ("mine", "expected NAME=COMMAND"),
            ("=true", "expected NAME=COMMAND"),
            ("mine=", "no command"),
            ("mine=  ", "no command"),
            ("mine=''", "no command"),
            ("mine=python3 'a b", "does not end"),
        ] {
            let error = Program::parse(text, 5).expect_err(text);
            assert!(error.contains(why), "{text}: {error}");
        }
    }

    #[test]
    fn words_are_split_as_a_shell_does_and_places_may_hold_spaces() {
        let text = r#"mine="/opt/my python" -c 'print("a  b")' two\ words --data={dataset}"#;
        let program = Program::parse(text, 5).expect("it has a command");
        let words = program.words(Path::new("/my data"), Path::new("/my out"));
        assert_eq!(
            words,
            [
                "/opt/my python",
                "-c",
                "print(\"a  b\")",
                "two words",
                "--data=/my data",
                "/my out"
            ]
        );
    }
}
