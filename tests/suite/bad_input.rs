//! Invalid scenes: each is refused with the location, what was found, what is allowed and what to do.
//!
//! Expected positions are found by searching the corrupted text, not by the code under test.

use crate::common::{VALID, folder_with, run, stderr};
use catoptric::files::diagnostic::{Diagnostics, Place};
use catoptric::files::scene::{self, SceneErrors};

/// All problems of a scene.
pub(crate) fn problems_with(text: &str, sets: &[&str]) -> Diagnostics {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    match scene::parse(text, "scene.toml", &sets) {
        Ok(_) => panic!("the scene was accepted:\n{text}"),
        Err(SceneErrors::Invalid(problems)) => *problems,
        Err(other) => panic!("{other}"),
    }
}

/// The valid scene with one part replaced.
pub(crate) fn spoiled(from: &str, to: &str) -> String {
    assert_eq!(VALID.matches(from).count(), 1, "{from:?} must occur once");
    VALID.replace(from, to)
}

/// Line and column, counted from 1, of the only occurrence of a text.
pub(crate) fn place_of(text: &str, part: &str) -> (usize, usize) {
    assert_eq!(text.matches(part).count(), 1, "{part:?} must occur once");
    let before = &text[..text.find(part).unwrap()];
    let line = before.split('\n').count();
    (line, before.split('\n').next_back().unwrap().chars().count() + 1)
}

/// Corrupts the scene and expects exactly one problem: at `at`, with all of `words`.
#[track_caller]
pub(crate) fn expect_one(from: &str, to: &str, at: &str, words: &[&str]) {
    expect_one_in(&spoiled(from, to), at, words);
}

/// Expects exactly one problem in a scene: at `at`, with all of `words`.
#[track_caller]
pub(crate) fn expect_one_in(text: &str, at: &str, words: &[&str]) {
    let problems = problems_with(text, &[]);
    assert_eq!(problems.list.len(), 1, "{problems}");
    let problem = &problems.list[0];
    assert_eq!(problems.position(problem), Some(place_of(text, at)), "{problems}");
    let said = format!("{} {}", problem.message, problem.help.as_deref().unwrap_or(""));
    for word in words {
        assert!(said.contains(word), "{word:?} is not in {said:?}");
    }
}

#[test]
fn the_scene_that_is_corrupted_here_is_valid() {
    scene::parse(VALID, "scene.toml", &[]).unwrap();
}

#[test]
fn an_unknown_key_gets_the_most_similar_one() {
    expect_one(
        "scans_per_pose",
        "scan_per_pose",
        "scan_per_pose",
        &[
            "unknown key `scan_per_pose` in `experiment`",
            "did you mean `scans_per_pose`?",
        ],
    );
    expect_one(
        "[room]\n",
        "[room]\nthickness_mm = 1.0\n",
        "thickness_mm",
        &["superstructure.mirror"],
    );
    expect_one("seed = 7", "sede = 7", "sede", &["did you mean `seed`?"]);
}

#[test]
fn an_angle_in_radians_gets_its_value_in_degrees() {
    expect_one(
        "tilt_deg = [30.0, 50.0]",
        "tilt_rad = [0.5, 0.75]",
        "tilt_rad",
        &["`tilt_deg`", "angles are in degrees", "[28.64789, 42.971835]"],
    );
    // 45 in radians is more than a turn, so degrees may have been meant.
    expect_one(
        "exit_elevation_deg = 50.0",
        "exit_elevation_rad = 45",
        "exit_elevation_rad",
        &["`exit_elevation_deg`", "2578.31", "exit_elevation_deg = 45"],
    );
    // 45 rad converted to degrees.
    expect_one(
        "exit_elevation_deg = 50.0",
        "exit_elevation_deg = 2578.31",
        "2578.31",
        &["2578.31°", "-90° to 90°", "angles are in degrees"],
    );
    expect_one(
        "azimuth_deg = [62.0, 77.0]",
        "azimuth_deg = [1.2, 1.3]",
        "[1.2, 1.3]",
        &["spans 0.1°", "[68.755, 74.485]"],
    );
    expect_one(
        "exit_elevation_deg = 50.0",
        "exit_elevation_deg = \"50 deg\"",
        "\"50 deg\"",
        &["write 50 without quotes"],
    );
}

#[test]
fn a_length_in_another_unit_is_converted() {
    expect_one(
        "width_mm = 600.0",
        "width_m = 0.6",
        "width_m ",
        &["`width_mm`", "width_mm = 600"],
    );
}

#[test]
fn numbers_must_be_finite() {
    expect_one("distance_mm = 70.0", "distance_mm = nan", "nan", &["finite"]);
    expect_one("seed = 7", "seed = inf", "inf", &["finite"]);
    expect_one(
        "normal = [-1.0, 0.0, 0.0]",
        "normal = [-1.0, -inf, 0.0]",
        "-inf",
        &["finite"],
    );
    expect_one("sd_mm = [4.0, 5.0]", "sd_mm = [4.0, 1e999]", "1e999", &["finite"]);
}

#[test]
fn types_ranges_and_words() {
    expect_one("seed = 7", "seed = -7", "-7", &["0 to 18446744073709551615"]);
    expect_one(
        "scans_per_pose = 10",
        "scans_per_pose = 10.5",
        "10.5",
        &["a whole number"],
    );
    expect_one("name = \"small\"", "name = 3", "3\nseed", &["a string", "quotes"]);
    expect_one(
        "[6.0, 6.0, 3.0]",
        "[6.0, 6.0]",
        "[6.0, 6.0]",
        &["2 entries", "exactly 3"],
    );
    expect_one(
        "\"empirical\"",
        "\"emprical\"",
        "\"emprical\"",
        &["none, empirical", "did you mean"],
    );
    expect_one(
        "shape.rectangle",
        "shape.square",
        "square",
        &["wedge, plate, rectangle, polygon"],
    );
    expect_one(
        "width_mm = 600.0\n",
        "",
        "[[board]]",
        &["missing key `width_mm` in `board[0]`"],
    );
    expect_one(
        "schema_version = 1",
        "schema_version = 2",
        "2\nname",
        &["1 is allowed"],
    );
    expect_one(
        "seed = 7",
        "seed = 7\nseed = 8",
        "seed = 8",
        &["duplicate key `seed`"],
    );
    expect_one("seed = 7", "seed = ", "\n\n[scanner]", &["value"]);
}

#[test]
fn names_and_markers() {
    expect_one(
        "name = \"b\"",
        "name = \"a\"",
        "\"a\"\nposition_mm = [100.0",
        &["marker[0]"],
    );
    expect_one(
        "name = \"polygon\"",
        "name = \"wedge\"",
        "\"wedge\"\n[super",
        &["facet[0]"],
    );
    expect_one(
        "position_mm = [0.0, 100.0, 60.0]",
        "position_mm = [50.0, 0.0, 60.0]",
        "[[superstructure.marker]]\nname = \"a\"",
        &["one line"],
    );
    expect_one(
        "[[superstructure.marker]]\nname = \"c\"\nposition_mm = [0.0, 100.0, 60.0]\n",
        "",
        "[[superstructure.marker]]\nname = \"a\"",
        &["2 markers", "at least 3"],
    );
    expect_one(
        "color = \"card\"",
        "color = \"crad\"",
        "\"crad\"",
        &["did you mean `card`?"],
    );
    expect_one(
        "size_m = [6.0",
        "color = \"whit\"\nsize_m = [6.0",
        "\"whit\"",
        &["`white`"],
    );
    // Every pose refers to the board by its old name, so both poses are wrong as well.
    let text = spoiled("name = \"big\"", "name = \"bigg\"");
    let problems = problems_with(&text, &[]);
    let helps: Vec<_> = problems.list.iter().map(|p| p.help.as_deref()).collect();
    assert_eq!(helps, [Some("did you mean `bigg`?"); 2]);
}

#[test]
fn tables_and_limits() {
    expect_one(
        "sd_mm = [4.0, 5.0]",
        "sd_mm = [4.0]",
        "[4.0]",
        &["1 entries", "has 2"],
    );
    expect_one(
        "[1.0, 2.0]",
        "[2.0, 1.0]",
        "1.0], sd_mm",
        &["strictly increasing"],
    );
    expect_one("[30.0, 50.0]", "[50.0, 30.0]", "[50.0, 30.0]", &["[30, 50]"]);
}

#[test]
fn all_problems_are_reported_at_once() {
    let text = VALID
        .replace("seed = 7", "sede = 7")
        .replace("preset = \"ust-20lx\"", "preset = \"ust-30lx\"")
        .replace("distance_mm = 70.0", "distance_mm = nan")
        .replace("model = \"empirical\"", "model = \"wrong\"");
    let (_folder, path) = folder_with(&text);
    let output = run(path.parent().unwrap(), &["check", "scene.toml"]);
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    for part in ["sede", "\"ust-30lx\"", "nan", "\"wrong\""] {
        let (line, column) = place_of(&text, part);
        let place = format!("scene.toml:{line}:{column}");
        assert!(said.contains(&place), "{place} is not in:\n{said}");
    }
    assert!(said.ends_with("scene.toml: 4 problems\n"), "{said}");
    assert!(!said.contains('\u{1b}'), "no colors without a terminal: {said:?}");
    // Carets mark the text that is wrong.
    assert!(
        said.contains("2 | name") || said.contains("3 | sede = 7\n  | ^^^^\n"),
        "{said}"
    );
}

#[test]
fn a_laboratory_needs_walls_and_a_mirror_returns_no_more_light_than_it_receives() {
    let said = |text: &str| problems_with(text, &[]).to_string();
    let text = VALID.replace("size_m = [6.0, 6.0, 3.0]\n", "");
    assert!(
        said(&text).contains("`room.size_m` is missing"),
        "{}",
        said(&text)
    );
    let text = format!("{VALID}\n[superstructure.mirror]\nreflectivity = 0.9\ndiffuse_reflectivity = 0.2\n");
    assert!(
        said(&text).contains("a mirror cannot return more light than it receives"),
        "{}",
        said(&text)
    );
    let text = format!("{VALID}\n[superstructure.mirror]\nglass = {{ thickness_mm = 3.0 }}\n");
    assert!(
        said(&text).contains("more than the 1 mm of the whole mirror"),
        "{}",
        said(&text)
    );
    let text = spoiled("size_mm = [10.0, 20.0, 30.0]", "");
    assert!(
        said(&text).contains("neither `size_mm` nor `shape`"),
        "{}",
        said(&text)
    );
    let text = format!(
        "{VALID}\n[[room.mirror]]\nname = \"m\"\nshape.rectangle = {{ normal = [0, 0, 0], width_m = 1, height_m = 1 }}\n"
    );
    assert!(
        said(&text).contains("`room.mirror[0].shape.rectangle.normal` has length 0"),
        "{}",
        said(&text)
    );
    let text = format!(
        "{VALID}\n[[room.surface]]\nname = \"s\"\ncolor = \"pink\"\nshape.box = {{ size_m = [1, 1, 1] }}\n"
    );
    assert!(said(&text).contains("`room.surface[0].color`"), "{}", said(&text));
}

#[test]
fn a_syntax_error_neither_hides_other_problems_nor_adds_any() {
    let text = spoiled("seed = 7", "seed = 7 8").replace("[room]\n", "[room]\nsiez = 1\n");
    let problems = problems_with(&text, &[]);
    let places: Vec<_> = problems
        .list
        .iter()
        .map(|p| problems.position(p).unwrap().0)
        .collect();
    assert!(places.contains(&3), "{problems}");
    assert!(places.contains(&place_of(&text, "siez").0), "{problems}");
    assert!(
        places
            .iter()
            .all(|line| *line == 3 || *line == place_of(&text, "siez").0),
        "{problems}"
    );
}

#[test]
fn a_wrong_setting_is_reported_as_such() {
    for (set, words) in [
        ("seed=-1", "`seed` is -1"),
        ("seed", "has no `=`"),
        ("sede=1", "unknown key `sede`"),
        (
            "superstructure.facet.7.name=x",
            "has 3 entries, numbered from 0 to 2",
        ),
        (
            "superstructure.facet.first.name=x",
            "`first` must be a number from 0 to 2",
        ),
        ("seed.of=1", "it has no keys"),
        ("mocap.profile=moder", "did you mean \"modern\"?"),
        ("experiment.tilt_deg=[50, 30]", "runs from 50° down to 30°"),
        ("experiment.tilt_deg[0]=60", "runs from 60° down to 50°"),
        ("experiment.tilt_deg=[50, 30", "not TOML"),
        (
            "experiment.pose[0].center_m=[-1.5, 0.0, 1.2]",
            "behind the sensor",
        ),
        // The consequence is reported elsewhere, at a line that is correct on its own.
        ("board.0.name=wide", "there is no such board"),
        ("seed=nan", "finite"),
    ] {
        let problems = problems_with(VALID, &[set]);
        for problem in &problems.list {
            assert_eq!(problem.place, Place::Set(set.to_owned()), "{problems}");
        }
        let said = problems.render(false);
        assert!(said.contains(words), "{words:?} is not in:\n{said}");
        assert!(said.contains(&format!("--set {set}: ")), "{said}");
    }
}

#[test]
fn a_setting_is_not_blamed_for_the_file() {
    let text = spoiled("[30.0, 50.0]", "[50.0, 30.0]");
    let problems = problems_with(&text, &["experiment.scans_per_pose=20"]);
    assert_eq!(problems.list.len(), 1);
    assert_eq!(
        problems.position(&problems.list[0]),
        Some(place_of(&text, "[50.0, 30.0]"))
    );
}

#[test]
fn settings_reach_into_tables_that_the_file_omits() {
    let sets = [
        "mocap.profile=ideal",
        "superstructure.facet.0.name=left",
        "experiment.pose[1].facet=left",
    ];
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    let scene = scene::parse(VALID, "scene.toml", &sets).unwrap();
    assert_eq!(scene.superstructure.facet[0].name, "left");
    assert_eq!(scene.mocap.profile, catoptric::sim::scene::MocapProfile::Ideal);
}

#[test]
fn files_that_are_missing_or_not_text() {
    let (folder, path) = folder_with(VALID);
    let output = run(folder.path(), &["check", "scnee.toml"]);
    assert_eq!(output.status.code(), Some(3));
    let said = stderr(&output);
    assert!(
        said.contains("cannot read scnee.toml") && said.contains("did you mean scene.toml?"),
        "{said}"
    );

    std::fs::write(&path, b"name = \"\xff\"\n").unwrap();
    let output = run(folder.path(), &["check", "scene.toml"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("scene.toml:1:9"), "{}", stderr(&output));

    let output = run(folder.path(), &["check", "."]);
    assert_eq!(
        output.status.code(),
        Some(3),
        "a folder is not a scene: {}",
        stderr(&output)
    );
}

#[test]
fn json_goes_through_the_same_checks() {
    let scene = scene::parse(VALID, "scene.toml", &[]).unwrap();
    let json = serde_json::to_string_pretty(&scene).unwrap();
    assert_eq!(scene::parse(&json, "scene.json", &[]).unwrap(), scene);

    let bad = |text: &str| match scene::parse(text, "scene.json", &[]) {
        Err(SceneErrors::Invalid(problems)) => problems,
        other => panic!("{other:?}"),
    };
    let problems = bad(&json.replace("\"seed\"", "\"sede\""));
    assert_eq!(problems.position(&problems.list[0]), Some((4, 3)), "{problems}");
    let problems = bad(&json.replacen(',', "", 1));
    assert_eq!(problems.position(&problems.list[0]), Some((3, 3)));
    let problems = bad(&json.replacen("\"seed\": 7,", "\"seed\": 7, \"seed\": 8,", 1));
    assert!(
        problems.list[0].message.contains("duplicate key `seed`"),
        "{problems}"
    );
}

#[test]
fn the_resolved_scene_is_read_back_unchanged() {
    let templates = scene::Template::ALL.map(scene::Template::text);
    for text in templates.into_iter().chain([VALID]) {
        let scene = scene::parse(text, "scene.toml", &[]).unwrap();
        let resolved = scene::to_toml(&scene).unwrap();
        let back = scene::parse(&resolved, "resolved.toml", &[]).unwrap();
        assert_eq!(back, scene);
        // Defaults are written explicitly, so a later version with other defaults reads the same scene.
        assert!(resolved.contains("threshold_reflectivity"));
    }
    // The largest seed exceeds TOML's integers.
    let mut scene = scene::parse(VALID, "scene.toml", &[]).unwrap();
    scene.seed = u64::MAX;
    let back = scene::parse(&scene::to_toml(&scene).unwrap(), "resolved.toml", &[]).unwrap();
    assert_eq!(back.seed, u64::MAX);
}

#[test]
fn a_board_that_fits_nowhere_is_found_by_check() {
    // Poses are chosen by the rules if none are given.
    let text = VALID.split("[[experiment.pose]]").next().unwrap();
    let (folder, _) = folder_with(text);
    let output = run(folder.path(), &["check", "scene.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let sets = ["check", "scene.toml", "--set", "board.0.height_mm=3500"];
    let output = run(folder.path(), &sets);
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(
        said.contains("no room for board \"big\"") && said.contains("help: "),
        "{said}"
    );
}

#[test]
fn no_corruption_of_the_text_causes_a_panic() {
    let check = |text: &str| {
        if let Err(SceneErrors::Invalid(problems)) = scene::parse(text, "scene.toml", &[]) {
            assert!(!problems.list.is_empty(), "{text}");
            let lines = text.split('\n').count();
            for problem in &problems.list {
                let (line, _) = problems.position(problem).unwrap();
                assert!((1..=lines).contains(&line), "{problems}");
            }
            // Excerpts in messages are taken from whatever is left of the text.
            assert!(problems.render(true).contains("scene.toml"));
        }
    };
    // Truncated anywhere.
    for end in (0..VALID.len()).step_by(5) {
        check(&VALID[..end]);
    }
    let lines: Vec<&str> = VALID.lines().collect();
    for at in 0..lines.len() {
        // A line removed, duplicated, or overwritten.
        let mut lost = lines.clone();
        lost.remove(at);
        check(&lost.join("\n"));
        let mut twice = lines.clone();
        twice.insert(at, lines[at]);
        check(&twice.join("\n"));
        for garbage in [
            "= 5",
            "é = \"ü",
            "x = [1, {",
            "[[room]]",
            "[board]",
            "scanner = 3",
            "\t\u{7f}",
        ] {
            let mut overwritten = lines.clone();
            overwritten[at] = garbage;
            check(&overwritten.join("\r\n"));
        }
    }
}
