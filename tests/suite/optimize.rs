//! The search for better layouts finds known optima, keeps requirements, and gives the same result every time.
//!
//! The goals of a candidate are compared with `layout` of the written scene. That the search finds the optimum is shown
//! only where it is known in closed form.

use crate::common::{folder_with, run, stderr, stdout};
use crate::parametric::PARAMETRIC;
use catoptric::files::{parametric::ParametricScene, scene};
use catoptric::layout::{self, Detail, Requirement};
use catoptric::optimize::{Goal, Optimum, SearchOptions, Wanted, optimize};
use serde_json::Value;

fn template(text: &str) -> ParametricScene {
    ParametricScene::parse(text, "scene.toml", &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn options(goals: &[&str], requirements: &[&str], evaluations: usize) -> SearchOptions {
    SearchOptions {
        goals: goals.iter().map(|g| Goal::parse(g, &[]).unwrap()).collect(),
        requirements: requirements
            .iter()
            .map(|r| Requirement::parse(r).unwrap())
            .collect(),
        evaluations,
        seed: 1,
        detail: Detail::Coarse,
    }
}

fn search(text: &str, options: &SearchOptions) -> Optimum {
    optimize(&template(text), options, &mut |_| true).unwrap()
}

#[test]
fn the_same_seed_gives_the_same_answer_on_any_number_of_threads() {
    let options = options(&["field_of_regard", "size"], &[], 90);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| search(PARAMETRIC, &options))
    };
    let one = on(1);
    assert_eq!(one, on(3));
    assert!(
        one.evaluations > 60 && one.evaluations <= 90,
        "{}",
        one.evaluations
    );
    assert!(one.front.len() > 1);
    let other = search(PARAMETRIC, &SearchOptions { seed: 2, ..options });
    assert_ne!(one.front, other.front);
}

#[test]
fn a_known_optimum_is_found() {
    // A single facet determines the size of the layout, and farther is larger: the minimum distance is optimal.
    // Elements that should look to 60° are closest at 47° if the limit is 47°.
    let text = r#"
        schema_version = 1
        name = "one"
        [parameters]
        reach_mm = { value = 90, low = 60, high = 120 }
        rise_deg = { value = 30, low = 20, high = 70 }
        [scanner]
        preset = "ust-20lx"
        housing = false
        [[superstructure.facet]]
        name = "a"
        [superstructure.facet.shape.plate]
        azimuth_deg = 0
        distance_mm = "= reach_mm"
        exit_azimuth_deg = 180
        exit_elevation_deg = "= rise_deg"
        width_mm = 30
        height_mm = 20
        [[superstructure.marker]]
        name = "a"
        position_mm = [90, 0, 30]
        [[superstructure.marker]]
        name = "b"
        position_mm = [0, 90, 30]
        [[superstructure.marker]]
        name = "c"
        position_mm = [0, -80, 20]
        [room]
        size_m = [5, 4, 3]
        rig_position_m = [0, 0, 1.5]
        [[board]]
        name = "board"
        width_mm = 600
        height_mm = 600
    "#;
    let found = search(text, &options(&["size.diameter_mm:down"], &[], 300));
    let best = found.best.unwrap();
    assert!((best.parameters["reach_mm"] - 60.0).abs() < 0.1, "{best:?}");
    assert!(found.beats_start_in_every_goal);
    let wanted = [Wanted::parse("180,47,4").unwrap()];
    let directions = SearchOptions {
        goals: vec![Goal::parse("directions", &wanted).unwrap()],
        ..options(&["size"], &[], 300)
    };
    let found = search(text, &directions);
    let best = found.best.unwrap();
    // The four nearest elements of a fan with beams 0.25° apart are at best 0.25° away on average.
    assert!((best.parameters["rise_deg"] - 47.0).abs() < 0.5, "{best:?}");
    assert!(
        best.goals["directions"] < 0.3 && found.start.goals["directions"] > 10.0,
        "{best:?}"
    );
}

#[test]
fn requirements_are_met() {
    let requirements = [
        "size.diameter_mm<=165",
        "facets.*.margin_across_mm>=3",
        "stopped_by_facets<=0",
    ];
    let found = search(PARAMETRIC, &options(&["field_of_regard"], &requirements, 200));
    assert!(
        !found.start.is_kept(),
        "the prototype is wider, and has less room"
    );
    assert!(
        found.start.unmet.iter().any(|u| u.contains("diameter")),
        "{:?}",
        found.start.unmet
    );
    let best = found.best.unwrap();
    let scene = template(PARAMETRIC).with(&best.choice()).unwrap();
    let analysis = layout::analyze(&scene, None, Detail::Coarse).unwrap();
    assert!(analysis.size.diameter_mm <= 165.0 && analysis.stopped_by_facets == 0);
    assert!(analysis.facets.iter().all(|f| f.margin_across_mm.unwrap() >= 3.0));
    assert_eq!(best.goals["field_of_regard"], analysis.field_of_regard);
}

#[test]
fn a_stopped_search_returns_what_it_has() {
    let mut batches = 0;
    let found = optimize(
        &template(PARAMETRIC),
        &options(&["field_of_regard", "size"], &[], 400),
        &mut |_| {
            batches += 1;
            batches < 3
        },
    )
    .unwrap();
    assert!(found.interrupted);
    assert_eq!(found.evaluations, 1 + 3 * 16);
    assert!(!found.front.is_empty());
}

#[test]
fn the_hand_made_prototype_is_beaten_in_both_goals() {
    let (folder, _) = folder_with(PARAMETRIC);
    let arguments = [
        "optimize",
        "scene.toml",
        "--goal",
        "field_of_regard",
        "--goal",
        "lost_beams",
        "--evaluations",
        "160",
        "--out",
        "found",
        "--json",
        "-q",
    ];
    let output = run(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let found: Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(found["beats_start_in_every_goal"], true);
    let goal = |of: &str, name: &str| found[of]["goals"][name].as_f64().unwrap();
    assert!(goal("best", "field_of_regard") > 1.02 * goal("start", "field_of_regard"));
    assert!(goal("best", "lost_beams") < 0.8 * goal("start", "lost_beams"));
    // The written scene is the one that was evaluated, with every sub-ray.
    let path = folder.path().join("found/best.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.starts_with("# Found by catoptric optimize in scene.toml: field_of_regard 0.00"),
        "{text}"
    );
    // The designer's own file, with other numbers.
    assert!(
        text.contains("second_deg = \"= first_deg + span_deg + gap_deg\"") && text.contains("# between two")
    );
    let written = scene::load(&path, &[]).unwrap();
    let analysis = layout::analyze(&written, None, Detail::Full).unwrap();
    assert_eq!(analysis.field_of_regard, goal("best", "field_of_regard"));
    assert_eq!(analysis.lost as f64, goal("best", "lost_beams"));
    // It can be simulated, and the report explains why it is better.
    let checked = run(folder.path(), &["check", "found/best.toml"]);
    assert_eq!(checked.status.code(), Some(0), "{}", stderr(&checked));
    let left = found["why"]["left_as_it_was"].as_array().unwrap();
    // Only what matters differs from the drawing.
    assert!(left.len() > 1, "{left:?}");
    let page = std::fs::read_to_string(folder.path().join("found/report.html")).unwrap();
    for words in [
        "Why it is better",
        "left as drawn",
        "<svg",
        "gap_deg",
        "better than the drawing in every goal",
    ] {
        assert!(page.contains(words), "{words}");
    }
    let csv = std::fs::read_to_string(folder.path().join("found/front.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + found["front"].as_array().unwrap().len());
    for k in 1..=found["front"].as_array().unwrap().len().min(12) {
        scene::load(&folder.path().join(format!("found/front-{k:02}.toml")), &[]).unwrap();
    }
}

#[test]
fn values_can_be_made_and_what_changes_nothing_stays_as_drawn() {
    // A parameter that no expression uses changes nothing.
    let text = BLANK.replace("[scanner]", "[parameters]\nreach_mm = { value = 90, low = 60, high = 120.04 }\n\
        rise_deg = { value = 60, low = 40, high = 80 }\nunused_mm = { value = 1, low = 0, high = 2 }\n[scanner]")
        .replace("distance_mm = 60", "distance_mm = \"= reach_mm\"")
        .replace("exit_elevation_deg = 90", "exit_elevation_deg = \"= rise_deg\"");
    let found = search(
        &text,
        &options(&["share_within_5_deg:up"], &["size.diameter_mm<=220"], 80),
    );
    assert_eq!(found.without_effect, ["unused_mm"]);
    let best = found.best.clone().unwrap();
    assert_eq!(best.parameters["unused_mm"], 1.0);
    for (name, steps) in [("reach_mm", 10.0), ("rise_deg", 100.0)] {
        for layout in found.front.iter().chain(&found.best) {
            let value = layout.parameters[name];
            assert_eq!(value, (value * steps).round() / steps, "{name}");
        }
    }
    // The reported figures are those of these values.
    let scene = template(&text).with(&best.choice()).unwrap();
    let analysis = layout::analyze(&scene, None, Detail::Coarse).unwrap();
    assert_eq!(best.goals["share_within_5_deg"], analysis.share_within_5_deg);
    let nothing = options(&["size"], &[], 40);
    let idle = text
        .replace("\"= reach_mm\"", "60")
        .replace("\"= rise_deg\"", "90");
    let refused = optimize(&template(&idle), &nothing, &mut |_| true).unwrap_err();
    assert!(
        refused
            .to_string()
            .contains("none of the scene's parameters changes"),
        "{refused}"
    );
}

const BLANK: &str = include_str!("../../scenes/blank.toml");

#[test]
fn a_binding_requirement_is_named() {
    // A farther mirror is larger, and only the limit keeps it from being nearer to its largest distance.
    let text = BLANK
        .replace(
            "[scanner]",
            "[parameters]\nreach_mm = { value = 70, low = 60, high = 120 }\n[scanner]",
        )
        .replace("distance_mm = 60", "distance_mm = \"= reach_mm\"");
    let requirements = ["size.diameter_mm<=180", "field_of_regard>=0.0001"];
    let found = search(&text, &options(&["size.diameter_mm:up"], &requirements, 60));
    let best = found.best.clone().unwrap();
    assert!(
        best.goals["size.diameter_mm"] <= 180.0 && best.goals["size.diameter_mm"] > 179.0,
        "{best:?}"
    );
    let binding: Vec<(&str, bool)> = found
        .holds
        .iter()
        .map(|h| (h.requirement.as_str(), h.binding))
        .collect();
    assert_eq!(binding, [(requirements[0], true), (requirements[1], false)]);
    let limit = &found.holds[0];
    assert!(limit.unmet > 0 && limit.reached.unwrap() < 180.0, "{limit:?}");
    assert_eq!(found.holds[1].unmet, 0);
}

#[test]
fn the_example_of_the_help_works() {
    let (folder, _) = folder_with(PARAMETRIC);
    let help = stdout(&run(folder.path(), &["optimize", "--help"]))
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ");
    let quoted = |after: &str| {
        help.split(after)
            .nth(1)
            .unwrap()
            .split(['\'', ' '])
            .find(|w| w.contains("="))
            .unwrap()
            .to_owned()
    };
    let requirement = quoted("in quotes:");
    for goal in [
        &["share_within_5_deg:up"][..],
        &["directions", "--direction", "90,-60,4"],
    ] {
        assert!(
            help.contains(goal[0]) && help.contains(goal.last().unwrap()),
            "{help}"
        );
        let mut arguments = vec![
            "optimize",
            "scene.toml",
            "--coarse",
            "--evaluations",
            "40",
            "--require",
            &requirement,
        ];
        arguments.push("--goal");
        arguments.extend(goal);
        let output = run(folder.path(), &arguments);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{requirement}: {}",
            stderr(&output)
        );
    }
    for verb in ["layout", "tolerance"] {
        let help = stdout(&run(folder.path(), &[verb, "--help"]));
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        let requirement = help
            .split("in quotes: '")
            .nth(1)
            .unwrap()
            .split('\'')
            .next()
            .unwrap();
        let output = run(folder.path(), &[verb, "scene.toml", "--require", requirement]);
        // Met or not, it is a figure of the verb.
        assert!(
            matches!(output.status.code(), Some(0 | 1)),
            "{verb}: {}",
            stderr(&output)
        );
    }
    // One that cannot be met with one ray a beam says so.
    let margin = [
        "optimize",
        "scene.toml",
        "--coarse",
        "--evaluations",
        "40",
        "--goal",
        "size",
        "--require",
        "facets.*.margin_mm>=0.3",
    ];
    let output = run(folder.path(), &margin);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(
        said.contains("facets.*.margin_mm>=0.3: not met by") && said.contains("best value reached: -0."),
        "{said}"
    );
    assert!(said.contains("with --coarse no beam counts as split"), "{said}");
}

#[test]
fn invalid_searches_are_explained() {
    let (folder, _) = folder_with(PARAMETRIC);
    let refuse = |arguments: &[&str], code: i32, words: &[&str]| {
        let mut all = vec!["optimize", "scene.toml", "--evaluations", "20", "--coarse"];
        all.extend(arguments);
        let output = run(folder.path(), &all);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{said}");
        for word in words {
            assert!(said.contains(word), "{word:?} is not in {said:?}");
        }
    };
    refuse(
        &["--goal", "feild_of_regard"],
        2,
        &["is not a goal", "did you mean field_of_regard?"],
    );
    refuse(
        &["--goal", "szie.height_mm:up"],
        2,
        &["is not a figure", "did you mean size.height_mm?"],
    );
    refuse(&["--goal", "directions"], 2, &["need one another"]);
    refuse(
        &["--goal", "size", "--direction", "90,-60"],
        2,
        &["need one another"],
    );
    refuse(
        &["--goal", "directions", "--direction", "90,-100"],
        2,
        &["is not a direction"],
    );
    refuse(&["--goal", "size", "--goal", "size"], 2, &["given twice"]);
    refuse(
        &["--goal", "size", "--require", "lots<=3"],
        2,
        &["is not a figure"],
    );
    refuse(
        &["--goal", "size", "--require", "size.diameter_mm<=10"],
        1,
        &[
            "none of",
            "size.diameter_mm<=10: not met by",
            "best value reached: 1",
        ],
    );
    let output = run(folder.path(), &["optimize", "scene.toml"]);
    assert_eq!(output.status.code(), Some(2));
    std::fs::write(folder.path().join("fixed.toml"), crate::scenes::PROTOTYPE).unwrap();
    let output = run(folder.path(), &["optimize", "fixed.toml", "--goal", "size"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("no parameter with both `low` and `high`"),
        "{}",
        stderr(&output)
    );
}
