//! What a scene's table `[session]` lays over the session that is written, and the thickness of boards.

use crate::scenes::{BARE, PROTOTYPE, TWO_MIRROR, scene, set_board_ahead};
use catoptric::calib::observations::BoardInSensor;
use catoptric::files::scene::{self as files, SceneErrors, json_schema};
use catoptric::model::{Pose, Session};
use catoptric::sim::{Laboratory, Scene};
use serde_json::Value;

fn session(scene: &Scene) -> Session {
    let laboratory = Laboratory::new(scene, scene.seed).expect("the scene can be simulated");
    laboratory.session().expect("it has a session")
}

/// The two-mirror scene with some text after it.
fn with(text: &str, sets: &[&str]) -> Result<Scene, String> {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    let whole = format!("{TWO_MIRROR}\n{text}");
    files::parse(&whole, "scene.toml", &sets).map_err(|e| match e {
        SceneErrors::Invalid(all) => all.to_string(),
        other => other.to_string(),
    })
}

#[test]
fn what_is_laid_over_is_written_and_nothing_else_changes() {
    let plain = session(&with("", &[]).expect("the plain scene is valid"));
    let text = r#"
[session]
name = "believed otherwise"
[session.believed]
drift_sd_mm = 0.1
[session.believed.bias.angle]
gain_mm = 0.0
[session.bare_structure]
mirror_thickness_mm = 2.5
[session.glass]
thickness_mm = 2
[[session.boards]]
name = "board"
thickness_mm = 3
[[session.facets]]
name = "left"
beams = [10, 20]
"#;
    let found = session(&with(text, &["session.believed.marker_sd_mm=0.4"]).expect("it is valid"));
    let mut expected = plain;
    expected.name = "believed otherwise".to_owned();
    expected.believed.drift_sd_mm = 0.1;
    expected.believed.marker_sd_mm = 0.4;
    expected.believed.bias.angle.gain_mm = 0.0;
    expected.bare_structure.mirror_thickness_mm = 2.5;
    let glass = expected.glass.insert(Default::default());
    glass.thickness_mm = 2.0;
    expected.boards[0].thickness_mm = 3.0;
    let left = expected.facets.iter_mut().find(|f| f.name == "left");
    left.expect("the scene has it").beams = [10, 20];
    assert_eq!(found, expected);
}

#[test]
fn one_noise_replaces_the_table_and_a_table_replaces_a_table() {
    let plain = session(&with("", &[]).expect("the plain scene is valid"));
    let of_table = plain.believed.noise.as_ref().expect("the scene has a table");
    // Table 2, with whole millimeters: √(3.9² + 1/12).
    assert_eq!(of_table.range_m, [0.5, 2.0, 4.0]);
    assert!((plain.believed.noise_sd(2.0, "white") - 3.910_669e-3).abs() < 1e-9);
    let one = session(&with("[session.believed]\nrange_noise_sd_mm = 7", &[]).expect("it is valid"));
    assert_eq!(one.believed.noise_sd(2.0, "white"), 7e-3);
    let other = "[session.believed.noise]\nrange_m = [1, 3]\nsd_mm = [2, 4]";
    let other = session(&with(other, &[]).expect("it is valid"));
    assert!((other.believed.noise_sd(2.0, "white") - 3e-3).abs() < 1e-15);
}

#[test]
fn what_is_no_session_is_refused_where_it_is_written() {
    let refused = |text: &str, sets: &[&str]| with(text, sets).expect_err("it is no session");
    let line = TWO_MIRROR.lines().count() + 3;
    let cases = [
        ("[session.believed]\ndrift_sd = 1", "did you mean `drift_sd_mm`?"),
        (
            "[session.believed]\ndrift_sd_mm = -1",
            "0 mm to 100 mm is allowed",
        ),
        ("[session.beleived]\ndrift_sd_mm = 1", "did you mean `believed`?"),
        (
            "[[session.boards]]\nname = \"bord\"\nthickness_mm = 2",
            "did you mean `board`?",
        ),
        (
            "[session.believed.noise]\nrange_m = [1, 2]",
            "is given without `sd_mm`",
        ),
        (
            "[session.believed.bias.distance]\nrange_m = [1, 2]\nerror_mm = [1]",
            "error_mm",
        ),
        ("[session.scanner]\nbeams = 100", "the scanner records 1081"),
        (
            "[session.nominal_rig_from_sensor]\nrotation_xyzw = [0, 0, 0, 0.5]",
            "unit quaternion",
        ),
        ("[session.room]\nmin_m = [9, 0, 0]", "leaves no room"),
    ];
    for (text, words) in cases {
        let found = refused(text, &[]);
        assert!(found.contains(words), "{text}: {found}");
        assert!(
            (line - 1..=line + 2).any(|l| found.contains(&format!("scene.toml:{l}:"))),
            "{found}"
        );
    }
    let found = refused("", &["session.believed.drift_sd=1"]);
    assert!(found.contains("did you mean `drift_sd_mm`?"), "{found}");
}

/// Every key of a whole session can be laid over: the schema of the table has all of them.
#[test]
fn the_table_has_every_key_of_a_session() {
    let mut whole = session(&with("", &[]).expect("the plain scene is valid"));
    whole.glass = Some(Default::default());
    whole.bare_structure.noise_sd_mm = 0.1;
    whole.bare_structure.scanned = true;
    whole.believed.element_sd_mm = 0.1;
    whole.boards[0].thickness_mm = 1.0;
    let schema = json_schema();
    let value = serde_json::to_value(&whole).expect("a session has a JSON form");
    let of_table = &schema["properties"]["session"];
    let mut checked = 0;
    keys(&value, of_table, &schema, "session", &mut checked);
    assert!(checked > 50, "{checked} keys");
}

fn keys(value: &Value, schema: &Value, root: &Value, path: &str, checked: &mut usize) {
    let mut schema = schema;
    loop {
        if let Some(pointer) = schema["$ref"].as_str() {
            schema = root.pointer(&pointer[1..]).expect("the schema has its parts");
        } else if let Some(own) = schema["anyOf"]
            .as_array()
            .and_then(|all| all.iter().find(|s| s["type"] != "null"))
        {
            schema = own;
        } else {
            break;
        }
    }
    match value {
        Value::Object(entries) => {
            for (key, value) in entries {
                let of_key = schema["properties"]
                    .get(key)
                    .or(schema.get("additionalProperties"));
                let of_key = of_key.unwrap_or_else(|| panic!("`{path}.{key}` cannot be laid over: {schema}"));
                *checked += 1;
                keys(value, of_key, root, &format!("{path}.{key}"), checked);
            }
        }
        Value::Array(items) if items.first().is_some_and(Value::is_object) => {
            keys(&items[0], &schema["items"], root, path, checked);
        }
        _ => {}
    }
}

/// A board at 2 m whose face is 30 mm in front of its markers is read at 1.97 m, and predicted there.
#[test]
fn a_thick_board_is_nearer_than_its_markers() {
    let mut thick = scene(BARE);
    set_board_ahead(&mut thick, 2.0);
    thick.board[0].thickness_mm = 30.0;
    let dataset = Laboratory::new(&thick, 1)
        .expect("it can be simulated")
        .dataset()
        .expect("it is recorded");
    let pose = dataset
        .poses
        .iter()
        .find(|p| p.room_from_board.is_some())
        .expect("a board is set up");
    let read = pose.summarize()[540].mean;
    assert!((read - 1.97).abs() < 1e-9, "{read}");
    let board = BoardInSensor::of(pose, &dataset.session, &Pose::identity()).expect("it is tracked");
    let (origin, ahead) = (nalgebra::Point3::origin(), nalgebra::Vector3::x_axis());
    let predicted = board.hit(&origin, &ahead).expect("the beam hits it").distance;
    assert!((predicted - 1.97).abs() < 1e-9, "{predicted}");
    assert!(board.markers.iter().all(|m| (m.x - 2.0).abs() < 1e-9));
    // The thickness that the session states is the believed one.
    thick.session =
        toml::from_str("boards = [{ name = \"board\", thickness_mm = 0 }]").expect("it is a table");
    assert_eq!(session(&thick).boards[0].thickness_mm, 0.0);
    assert_eq!(session(&scene(PROTOTYPE)).boards[0].thickness_mm, 0.0);
}
