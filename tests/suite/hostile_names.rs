//! Names that other people chose reach neither a terminal as commands nor a spreadsheet as formulas.
//!
//! A hostile name is put wherever a scene, a calibration or a command line takes one, and everything that any verb prints is
//! searched. That is more than what a verb prints about that name, and less than what every error could ever print.

use crate::common::{VALID, run};
use std::path::Path;
use std::process::Output;

/// Sets the title and the colors of a terminal, deletes its screen, turns the direction of writing; in C0, C1 and DEL.
const HOSTILE: &str = "x\u{1b}]0;owned\u{7}\u{1b}[2J\u{9b}31m\u{7f}\u{202e}\u{2066}y";

/// The same in a TOML or JSON file.
const WRITTEN: &str = r"x\u001b]0;owned\u0007\u001b[2J\u009b31m\u007f\u202e\u2066y";

#[track_caller]
fn is_harmless(arguments: &[&str], output: &Output) {
    for printed in [&output.stdout, &output.stderr] {
        let text = String::from_utf8(printed.clone()).unwrap();
        let obeyed = |c: char| {
            c.is_control() && c != '\n' && c != '\t'
                || matches!(c, '\u{200e}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{61c}')
        };
        let found: Vec<&str> = text.lines().filter(|line| line.contains(obeyed)).collect();
        assert!(found.is_empty(), "{arguments:?}: {found:?}");
    }
}

/// Runs a verb, looks at what it prints, and returns its exit code.
fn code(at: &Path, arguments: &[&str]) -> Option<i32> {
    let output = run(at, arguments);
    is_harmless(arguments, &output);
    output.status.code()
}

#[test]
fn no_verb_prints_what_a_terminal_obeys() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let named = VALID
        .replace("name = \"small\"", &format!("name = \"{WRITTEN}\""))
        .replace("\"wedge\"", &format!("\"{WRITTEN}\""))
        .replace("\"polygon\"", &format!("\"p{WRITTEN}\""));
    std::fs::write(at.join("scene.toml"), &named).unwrap();
    let mut ran = Vec::new();
    for arguments in [
        &["check", "scene.toml"][..],
        &["simulate", "scene.toml", "--out", "data", "--returns"],
        &["simulate", "scene.toml", "--out", "data", "--json", "--replace"],
        &["calibrate", "data", "--method", "beam", "--out", "c.json"],
        &["calibrate", "data", "--out", "joint.json", "-v"],
        &["validate", "c.json"],
        &["validate", "c.json", "--json"],
        &["score", "data", "c.json"],
        &["score", "data", "joint.json", "--json", "-v"],
        &["compare", "data", "c.json", "joint.json"],
        &["compare", "data", "c.json", "joint.json", "--json"],
        &["report", "data", "c.json", "--out", "report.html"],
        &["apply", "data", "c.json", "--out", "c.ply"],
        &["plan", "scene.toml", "--poses", "1"],
        &["plan", "scene.toml", "--poses", "1", "--facet", HOSTILE],
        &["plan", "scene.toml", "--poses", "1", "--facet", "\u{1b}[1mnone"],
        &["plan", "data", "--poses", "1", "--json"],
        &["layout", "scene.toml", "-v"],
        &["layout", "scene.toml", "--json"],
        &["tolerance", "scene.toml", "--draws", "2", "--bounds", "0"],
        &[
            "tolerance",
            "scene.toml",
            "--draws",
            "2",
            "--bounds",
            "0",
            "--json",
        ],
        &[
            "study",
            "scene.toml",
            "--seeds",
            "1",
            "--methods",
            "oracle,beam",
            "--out",
            "s",
        ],
        &["export", "scene.toml", "--format", "csv", "--out", "t.csv"],
        &["characterize", "data", "--out", "ch.json"],
        // Errors quote what they do not know.
        &["check", "no\u{1b}[2Jsuch.toml"],
        &["check", "scene.toml", "--set", "na\u{1b}[2J\u{9b}me=1"],
        &["score", "data", "c.json", "--min", "\u{1b}[2J=1"],
        &["study", "scene.toml", "--methods", "\u{9b}2J", "--out", "s2"],
        &["study", "scene.toml", "--program", "\u{1b}[2J", "--out", "s2"],
    ] {
        ran.push((arguments[0], code(at, arguments)));
    }
    // The name is legal: what is tested above is not only how it is refused.
    let succeeded = |verb: &str| {
        ran.iter()
            .any(|(v, code)| *v == verb && matches!(code, Some(0 | 1)))
    };
    for verb in [
        "check",
        "simulate",
        "calibrate",
        "layout",
        "tolerance",
        "plan",
        "export",
        "report",
        "score",
    ] {
        assert!(succeeded(verb), "{verb}: {ran:?}");
    }
}

#[test]
fn no_error_about_a_file_prints_what_a_terminal_obeys() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let raw = |text: String, name: &str| std::fs::write(at.join(name), text).unwrap();
    // Without escapes: the excerpt of the file shows the line.
    raw(
        VALID.replace(
            "seed = 7",
            &format!("seed = 7 # \u{9b}31m\u{202e}\n\"na{WRITTEN}me\" = 1"),
        ),
        "key.toml",
    );
    raw(
        VALID.replace("seed = 7", "seed = \"\u{9b}31m\u{202e}\""),
        "value.toml",
    );
    raw(
        VALID.replace("\"card\"", &format!("\"c{WRITTEN}\"")),
        "color.toml",
    );
    raw(
        VALID.replace("\"ust-20lx\"", &format!("\"{WRITTEN}\"")),
        "preset.toml",
    );
    raw(
        VALID.replace('\n', "\r\n").replace("seed = 7", "sed = 7"),
        "lines.toml",
    );
    raw(VALID.replace("seed = 7", "seed = \u{1b}[2J"), "syntax.toml");
    for name in ["key", "value", "color", "preset", "lines", "syntax"] {
        let file = format!("{name}.toml");
        assert_eq!(code(at, &["check", &file]), Some(2), "{name}");
    }
    for (name, text) in [
        (
            "method",
            format!(
                "{{\"schema_version\": 2, \"method\": \"{WRITTEN}\", \"frame\": \"{WRITTEN}\", \"beams\": []}}"
            ),
        ),
        ("key", format!("{{\"schema_version\": 2, \"{WRITTEN}\": 1}}")),
        (
            "status",
            format!(
                "{{\"schema_version\": 2, \"method\": \"x\", \"frame\": \"sensor\", \"beams\": [{{\"beam\": 1, \"status\": \"{WRITTEN}\"}}]}}"
            ),
        ),
    ] {
        let file = format!("{name}.json");
        raw(text, &file);
        assert_eq!(code(at, &["validate", &file]), Some(2), "{name}");
        assert_eq!(code(at, &["validate", &file, "--json"]), Some(2), "{name}");
    }
}

#[test]
fn no_table_has_a_name_that_a_spreadsheet_computes() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let formula = "=HYPERLINK('http://x','y')";
    let named = VALID
        .replace("\"wedge\"", &format!("\"{formula}\""))
        .replace("\"polygon\"", "\"+1+1\"")
        .replace("\"rectangle\"", "\"@SUM(A1)\"")
        .replace("\"pillar\"", "\"-2+3\"")
        .replace("\"card\"", "\"=card\"")
        .replace("color.card", "color.\"=card\"");
    std::fs::write(at.join("scene.toml"), named).unwrap();
    std::fs::write(
        at.join("rays.csv"),
        "x_m,y_m,z_m,dx,dy,dz\n0,0,1.2,-0.3,0.9,0\n0,0,1.2,0,-1,0\n",
    )
    .unwrap();
    std::fs::write(at.join("p.sh"), "echo '=1+1' >&2; exit 1\n").unwrap();
    for arguments in [
        &[
            "simulate",
            "scene.toml",
            "--out",
            "data",
            "--returns",
            "--readings",
            "--set",
            "experiment.scans_per_pose=1",
        ][..],
        &["export", "scene.toml", "--format", "csv", "--out", "drawing.csv"],
        &["export", "data", "--format", "csv", "--out", "boards.csv"],
        &["trace", "scene.toml", "--rays", "rays.csv", "--out", "paths.csv"],
        &[
            "study",
            "scene.toml",
            "--seeds",
            "1",
            "--methods",
            "oracle",
            "--program",
            "@mine=sh p.sh",
            "--elements",
            "--set",
            "experiment.scans_per_pose=1",
            "--out",
            "s",
        ],
    ] {
        let output = run(at, arguments);
        assert!(
            matches!(output.status.code(), Some(0 | 1)),
            "{}",
            crate::common::stderr(&output)
        );
    }
    let mut defused = 0;
    for table in [
        "drawing.csv",
        "boards.csv",
        "paths.csv",
        "s/runs.csv",
        "s/elements.csv",
        "s/times.csv",
        "s/spread.csv",
        "data/truth/returns.csv",
        "data/truth/readings.csv",
    ] {
        let text = std::fs::read_to_string(at.join(table)).unwrap();
        for cell in cells(&text) {
            let computed = cell.starts_with(['=', '+', '-', '@', '\t', '\r']) && cell.parse::<f64>().is_err();
            assert!(!computed, "{table}: {cell}");
            defused += usize::from(cell.starts_with('\''));
        }
    }
    let drawing = std::fs::read_to_string(at.join("drawing.csv")).unwrap();
    assert!(
        drawing.contains(&format!("\"'{formula}\"")) && drawing.contains(",-"),
        "{drawing}"
    );
    assert!(defused > 10, "{defused}");
    // The study that is gone on with knows its program by its name.
    let again = run(
        at,
        &[
            "study",
            "scene.toml",
            "--seeds",
            "1",
            "--methods",
            "oracle",
            "--program",
            "@mine=sh p.sh",
            "--elements",
            "--set",
            "experiment.scans_per_pose=1",
            "--out",
            "s",
        ],
    );
    assert_eq!(again.status.code(), Some(1), "{}", crate::common::stderr(&again));
}

/// The cells of a table, without their quotes.
fn cells(text: &str) -> Vec<String> {
    let (mut cells, mut cell, mut quoted) = (Vec::new(), String::new(), false);
    for c in text.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' | '\n' if !quoted => cells.push(std::mem::take(&mut cell)),
            c => cell.push(c),
        }
    }
    cells
}
