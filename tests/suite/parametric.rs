//! Parameters, expressions and patterns of a scene: their values, and the messages for invalid ones.
//!
//! Expected error locations are found by searching the text. That a copy is at the mirror image of its original is
//! proven in `crates/sim/src/build/pattern/tests.rs`.

use crate::bad_input::{expect_one_in, place_of, problems_with};
use crate::common::{VALID, folder_with, run, stderr, stdout};
use crate::scenes::PROTOTYPE;
use catoptric::files::scene;
use catoptric::layout::{self, Detail};
use catoptric::sim::Scene;
use catoptric::sim::scene::FacetShape;
use nalgebra::Point3;

pub(crate) const PARAMETRIC: &str = include_str!("../../scenes/prototype-parametric.toml");

fn parsed(text: &str, sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    scene::parse(text, "scene.toml", &sets).unwrap_or_else(|e| panic!("{e}"))
}

/// Names and corners of the facets.
fn outlines(scene: &Scene) -> Vec<(String, Vec<Point3<f64>>)> {
    let facets = scene.superstructure.facet.iter();
    facets
        .map(|f| (f.name.clone(), f.shape.corners(&Default::default()).unwrap()))
        .collect()
}

#[test]
fn the_parametric_prototype_is_the_prototype() {
    let (by_hand, made) = (parsed(PROTOTYPE, &[]), parsed(PARAMETRIC, &[]));
    let (by_hand_outlines, outlines) = (outlines(&by_hand), outlines(&made));
    assert_eq!(outlines.len(), 8);
    for ((name, corners), (wanted, wanted_corners)) in outlines.iter().zip(&by_hand_outlines) {
        assert_eq!(name, wanted);
        for (corner, wanted) in corners.iter().zip(wanted_corners) {
            assert!((corner - wanted).norm() < 1e-15, "{name}: {corner} {wanted}");
        }
    }
    let posts = made.superstructure.post.iter().zip(&by_hand.superstructure.post);
    for (post, wanted) in posts {
        assert_eq!(
            (&post.name, post.size_mm, post.yaw_deg),
            (&wanted.name, wanted.size_mm, wanted.yaw_deg)
        );
        for (found, written) in post.center_mm.iter().zip(wanted.center_mm) {
            // Those of the prototype are rounded to a tenth of a millimeter.
            assert!(
                (found - written).abs() <= 0.05,
                "{}: {found} {written}",
                post.name
            );
        }
    }
    assert_eq!(made.superstructure.post.len(), by_hand.superstructure.post.len());
    // Everything else is identical.
    let mut made = made;
    made.name = by_hand.name.clone();
    made.parameters.clear();
    made.superstructure.post = by_hand.superstructure.post.clone();
    assert_eq!(made.superstructure.facet, by_hand.superstructure.facet);
    assert_eq!(made, by_hand);
}

#[test]
fn an_evaluated_scene_is_read_back_unchanged() {
    let scene = parsed(PARAMETRIC, &["parameters.gap_deg=1.25"]);
    let text = scene::to_toml(&scene).unwrap();
    assert!(!text.contains("pattern") && !text.contains("\"="), "{text}");
    assert_eq!(parsed(&text, &[]), scene);
}

#[test]
fn a_parameter_is_set_by_its_name() {
    let text = VALID.replace(
        "[scanner]",
        "[parameters]\nfar_mm = { value = 60, low = 50, high = 80 }\nmore_mm = \"= far_mm + 5\"\n[scanner]",
    );
    let text = text.replace("distance_mm = 70.0", "distance_mm = \"= more_mm + 5\"");
    assert_ne!(text, VALID);
    let distance = |scene: &Scene| match &scene.superstructure.facet[0].shape {
        FacetShape::Wedge(wedge) => wedge.distance_mm,
        other => panic!("{other:?}"),
    };
    assert_eq!(distance(&parsed(&text, &[])), 70.0);
    let set = parsed(&text, &["parameters.far_mm=70"]);
    assert_eq!((distance(&set), set.parameters["more_mm"].value), (80.0, 75.0));
    // Its limits remain and are enforced.
    assert_eq!(set.parameters["far_mm"].high, Some(80.0));
    let problems = problems_with(&text, &["parameters.far_mm=90"]);
    assert_eq!(
        problems.list[0].message,
        "`parameters.far_mm.value` is 90; 50 to 80 is allowed"
    );
    let problems = problems_with(&text, &["parameters.fra_mm=70"]);
    assert_eq!(
        problems.list[0].message,
        "the scene has no parameter `fra_mm`; did you mean parameters.far_mm?"
    );
    // A setting may itself be an expression.
    let set = parsed(&text, &["parameters.far_mm= = 2 * 33"]);
    assert_eq!(distance(&set), 76.0);
}

/// The parametric prototype with one part replaced: one problem at `at`, with all of `words`.
#[track_caller]
fn expect_one(from: &str, to: &str, at: &str, words: &[&str]) {
    assert_eq!(PARAMETRIC.matches(from).count(), 1, "{from:?} must occur once");
    expect_one_in(&PARAMETRIC.replace(from, to), at, words);
}

#[test]
fn a_wrong_expression_is_reported_where_it_is() {
    let from = "\"= reach_2_mm\"";
    expect_one(
        from,
        "\"= rech_2_mm + 1\"",
        "rech_2_mm + 1",
        &["names `rech_2_mm`", "did you mean `reach_2_mm`?"],
    );
    expect_one(
        from,
        "\"= reach_2_mm + \"",
        "\"\nexit_azimuth_deg = 82",
        &["ends where a number"],
    );
    expect_one(
        from,
        "\"= 2 * (reach_2_mm\"",
        "(reach_2_mm",
        &["parenthesis that is not closed"],
    );
    expect_one(from, "\"= reach_2_mm / (0 - 0)\"", "(0 - 0)", &["divides by 0"]);
    expect_one(
        from,
        "\"= reach_2_mm + 5mm\"",
        "5mm",
        &["no number", "write 5, not 5mm"],
    );
    expect_one(
        from,
        "\"= sine(90)\"",
        "sine(90)",
        &["`sine`, which is no function", "did you mean `sin`?"],
    );
    // A value out of range is reported, however it was computed.
    expect_one(
        from,
        "\"= reach_2_mm - 90\"",
        "\"= reach_2_mm - 90\"",
        &["`superstructure.facet[1].shape.wedge.distance_mm` is -18 mm"],
    );
}

#[test]
fn a_wrong_parameter_is_reported_where_it_is() {
    expect_one(
        "{ value = 12, low = 8",
        "{ value = 20, low = 8",
        "20, low = 8",
        &["is 20; 8 to 16 is allowed"],
    );
    expect_one(
        "low = 8, high = 16",
        "low = 16, high = 8",
        "{ value = 12, low = 16",
        &["write low = 8, high = 16"],
    );
    expect_one(
        ", low = 0.5, high = 4 }",
        ", low = 0.5 }",
        "{ value = 2, low",
        &["needs both `low` and `high`"],
    );
    expect_one(
        "{ value = 12, low = 8",
        "{ value = 12, lwo = 8",
        "lwo",
        &["unknown key `lwo`", "did you mean `low`?"],
    );
    let circle = PARAMETRIC.replace("first_deg = 62 ", "first_deg = \"= third_deg\" ");
    let problems = problems_with(&circle, &[]);
    assert!(
        problems.list.iter().any(|p| p.message.contains("is circular: `")),
        "{problems}"
    );
    let dash = PARAMETRIC.replace("first_deg = 62 ", "first-deg = 62 ");
    let problems = problems_with(&dash, &[]);
    let about = problems
        .list
        .iter()
        .find(|p| p.message.contains("`first-deg` cannot be used"))
        .unwrap();
    assert_eq!(
        problems.position(about),
        Some(place_of(&dash, "first-deg = 62")),
        "{problems}"
    );
}

#[test]
fn a_wrong_pattern_is_reported_where_it_is() {
    expect_one(
        "of = [\"left-1\", \"left-2\"",
        "of = [\"left-1\", \"lfet-2\"",
        "\"lfet-2\"",
        &["is \"lfet-2\"", "did you mean \"left-2\"?"],
    );
    expect_one(
        "\"right-3\", \"right-4\"]",
        "\"right-3\"]",
        "[\"right-1\"",
        &["3 names for 4 images"],
    );
    expect_one(
        "\"right-3\", \"right-4\"]",
        "\"right-3\", \"left-1\"]",
        "[[superstructure.pattern]]",
        &["in the copy \"left-1\"", "names must be unique"],
    );
    expect_one(
        "\"left_right\", \"up_down\"",
        "\"left_right\", \"updown\"",
        "\"updown\"",
        &["did you mean \"up_down\"?"],
    );
}

#[test]
fn a_ring_is_simulated_like_any_other_facets() {
    let petal = r#"
        schema_version = 1
        name = "ring"
        [[superstructure.facet]]
        name = "petal"
        shape.plate = { azimuth_deg = -60, distance_mm = 60, exit_azimuth_deg = -60, exit_elevation_deg = 60, width_mm = 20, height_mm = 20 }
        [[superstructure.pattern]]
        ring = { of = "petal", count = 5, step_deg = 30 }
    "#;
    let markers = "[[superstructure.marker]]\nname = \"a\"\nposition_mm = [90, 0, 30]\n[[superstructure.marker]]\nname = \"b\"\nposition_mm = [0, 90, 30]\n[[superstructure.marker]]\nname = \"c\"\nposition_mm = [0, -80, 20]\n[room]\nsize_m = [5, 4, 3]\nrig_position_m = [0, 0, 1.5]\n[[board]]\nname = \"board\"\nwidth_mm = 600\nheight_mm = 600\n";
    let scene = parsed(&format!("{petal}{markers}"), &[]);
    let found = layout::analyze(&scene, None, Detail::Coarse).unwrap();
    let names: Vec<&str> = found.facets.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["petal", "petal-2", "petal-3", "petal-4", "petal-5"]);
    // A step of 30° is 120 beams, so every petal serves the same number of them at the same elevation.
    for (k, facet) in found.facets.iter().enumerate() {
        let [first, last] = facet.beams.unwrap();
        let [own_first, own_last] = found.facets[0].beams.unwrap();
        assert_eq!([first, last], [own_first + 120 * k, own_last + 120 * k]);
        let high = |i: usize| found.facets[i].exit_elevation_deg.unwrap();
        assert!((high(k)[0] - high(0)[0]).abs() < 1e-10 && (high(k)[1] - high(0)[1]).abs() < 1e-10);
    }
    assert!(found.facets[0].elements > 60, "{}", found.facets[0].elements);
}

#[test]
fn a_plate_reports_what_it_lacks() {
    let plate = "shape.plate = { azimuth_deg = 70, beam = 800, distance_mm = 60, exit_azimuth_deg = 60, width_mm = 20, height_mm = 20 }";
    let from = VALID.lines().find(|l| l.starts_with("shape.wedge")).unwrap();
    let problems = problems_with(&VALID.replace(from, plate), &[]);
    let said = problems.to_string();
    assert!(
        said.contains("names a beam, and `azimuth_deg` names another"),
        "{said}"
    );
    assert!(
        said.contains("needs exactly one direction, but has none, half of one, or two"),
        "{said}"
    );
    assert_eq!(problems.list.len(), 2, "{said}");
    let away = plate.replace("beam = 800, ", "").replace(
        "exit_azimuth_deg = 60",
        "normal_azimuth_deg = 60, normal_elevation_deg = 20",
    );
    let problems = problems_with(&VALID.replace(from, &away), &[]);
    assert!(
        problems.to_string().contains("face away from the scanner"),
        "{problems}"
    );
}

#[test]
fn the_schema_for_editors_allows_expressions_for_numbers() {
    let schema = scene::file_schema();
    let wedge = &schema["$defs"]["Wedge"]["properties"];
    assert_eq!(
        wedge["distance_mm"]["type"],
        serde_json::json!(["number", "string"])
    );
    assert_eq!(wedge["distance_mm"]["minimum"], 1.0);
    assert_eq!(wedge["distance_mm"]["pattern"], "^\\s*=");
    assert_eq!(wedge["azimuth_deg"]["items"]["pattern"], "^\\s*=");
    assert_eq!(
        schema["$defs"]["Parameter"]["anyOf"][1]["required"],
        serde_json::json!(["value"])
    );
    // Once evaluated, they are numbers again.
    assert_eq!(
        scene::json_schema()["$defs"]["Wedge"]["properties"]["distance_mm"]["type"],
        "number"
    );
}

#[test]
fn text_that_begins_with_an_equals_sign_is_text_where_text_is_expected() {
    let text = VALID.replacen("name = \"", "name = \"= ", 1);
    assert!(parsed(&text, &[]).name.starts_with("= "));
}

#[test]
fn layout_shows_the_corners_it_uses() {
    let (folder, _) = folder_with(PARAMETRIC);
    let output = run(
        folder.path(),
        &[
            "layout",
            "scene.toml",
            "--coarse",
            "-v",
            "--set",
            "parameters.gap_deg=1",
        ],
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let said = stdout(&output);
    let scene = parsed(PARAMETRIC, &["parameters.gap_deg=1"]);
    let corner = scene.superstructure.facet[7]
        .shape
        .corners(&Default::default())
        .unwrap()[2]
        * 1e3;
    let wanted = format!("({:.3}, {:.3}, {:.3})", corner.x, corner.y, corner.z);
    assert!(said.contains(&wanted), "{wanted} is not in {said}");
    let output = run(
        folder.path(),
        &["export", "scene.toml", "--format", "csv", "--out", "corners.csv"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let table = std::fs::read_to_string(folder.path().join("corners.csv")).unwrap();
    assert_eq!(
        table.lines().filter(|l| l.starts_with("right-4,")).count(),
        4,
        "{table}"
    );
}

/// As many as 64 expressions may depend on one another in a row; one more is an error, not a full stack.
#[test]
fn a_chain_of_parameters_has_an_end() {
    let chain = |length: usize| {
        let link = |i: usize| {
            let value = if i + 1 == length {
                "1".to_owned()
            } else {
                format!("\"= p{} + 1\"", i + 1)
            };
            format!("[parameters.p{i}]\nvalue = {value}\n")
        };
        let links: String = (0..length).map(link).collect();
        format!("{PARAMETRIC}\n{links}")
    };
    assert_eq!(parsed(&chain(64), &[]).parameters["p0"].value, 64.0);
    for length in [66, 1000] {
        let problems = problems_with(&chain(length), &[]);
        assert!(
            problems.list[0]
                .message
                .contains("depends on more than 64 parameters in a row"),
            "{}",
            problems.list[0].message
        );
    }
}
