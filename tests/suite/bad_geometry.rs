//! Invalid geometry in scenes: corners that form no mirror, facets that no light reaches, boards that fit nowhere.
//!
//! Each is refused as in `bad_input`, whose helpers corrupt one valid scene.

use crate::bad_input::expect_one;
use crate::common::VALID;
use catoptric::files::scene;
use catoptric::sim::check;

#[test]
fn facets_must_be_mirrors() {
    let corners = "    [-40.0, 70.0, -10.0],\n    [-20.0, 70.0, -10.0],\n    [-20.0, 80.0, 10.0],\n    [-40.0, 80.0, 10.0],\n";
    let expect = |with: &str, at: &str, words: &[&str]| expect_one(corners, with, at, words);
    expect(
        "[-40.0, 70.0, 0.0], [-30.0, 70.0, 0.0], [-20.0, 70.0, 0.0]\n",
        "[\n[-40.0",
        &["superstructure.facet[1]", "on one line"],
    );
    expect(
        "[-40.0, 70.0, 0.0], [-20.0, 70.0, 0.0], [-40.0, 70.0, 0.0]\n",
        "[\n[-40.0",
        &["2 different corners", "at least 3"],
    );
    // Lifted off the plane by one millimeter.
    expect(
        "[-40.0, 70.0, -10.0], [-20.0, 70.0, -10.0], [-20.0, 80.0, 10.0], [-40.0, 81.0, 10.0]\n",
        "[\n[-40.0",
        &["0.221 mm off one plane", "0.01 mm is allowed"],
    );
    // Two corners exchanged: a bow tie.
    expect(
        "[-40.0, 70.0, -10.0], [-20.0, 70.0, -10.0], [-40.0, 80.0, 10.0], [-20.0, 80.0, 10.0]\n",
        "[\n[-40.0",
        &["crosses itself"],
    );
    // A concave outline: the third corner pulled in.
    expect(
        "[-40.0, 70.0, -10.0], [-20.0, 70.0, -10.0], [-36.0, 72.0, -6.0], [-40.0, 80.0, 10.0]\n",
        "[-36.0, 72.0, -6.0]",
        &["convex"],
    );
    // The same mirror, seen from behind.
    expect(
        "[-40.0, 80.0, 10.0], [-20.0, 80.0, 10.0], [-20.0, 70.0, -10.0], [-40.0, 70.0, -10.0]\n",
        "[\n[-40.0",
        &["face away from the scanner", "opposite order"],
    );
    let normal = "normal = [0.0, 1.0, 1.0]";
    expect_one(
        normal,
        "normal = [0.0, -1.0, -1.0]",
        "[0.0, -1.0, -1.0]",
        &["face away"],
    );
    expect_one(normal, "normal = [0, 0, 0.0]", "[0, 0, 0.0]", &["length 0"]);
    let azimuths = "azimuth_deg = [62.0, 77.0]";
    expect_one(
        azimuths,
        "azimuth_deg = [77.0, 62.0]",
        "[77.0, 62.0]",
        &["write [62, 77]"],
    );
    expect_one(
        azimuths,
        "azimuth_deg = [140.0, 155.0]",
        "[140.0, 155.0]",
        &["-135° to 135°"],
    );
    // Without deflection no mirror is defined.
    expect_one(
        "exit_elevation_deg = 50.0",
        "exit_elevation_deg = 0",
        "{ azimuth_deg",
        &["no mirror"],
    );
}

#[test]
fn a_facet_smaller_than_its_spot_is_a_warning() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/gallery/altimeter.toml");
    let with = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
        check::warnings(&scene::load(&path, &sets).unwrap_or_else(|e| panic!("{e}")))
    };
    assert_eq!(with(&[]), []);
    // Eleven beams of a scanner without width; of the measured one, none. 45 mm away it is 4.6 mm wide along the scan.
    let found = with(&["scanner.preset=ust-20lx-measured"]);
    assert!(
        found.len() == 1
            && found[0].message.contains("has no whole beam")
            && found[0].message.contains("4.6 mm"),
        "{found:?}"
    );
}

#[test]
fn a_facet_that_no_light_reaches_is_a_warning() {
    let warns = |from: &str, to: &str, words: &str| {
        let text = VALID.replacen(from, to, 1);
        assert_ne!(text, VALID);
        let scene = scene::parse(&text, "scene.toml", &[]).unwrap_or_else(|e| panic!("{e}"));
        let found = check::warnings(&scene);
        assert!(
            found.len() == 1
                && found[0].message.contains("superstructure.facet[2]")
                && found[0].message.contains(words),
            "{found:?}"
        );
    };
    let valid = scene::parse(VALID, "scene.toml", &[]).unwrap();
    assert_eq!(check::warnings(&valid), []);
    warns(
        "[0.0, -80.0, 0.0]",
        "[0.0, -80.0, 30.0]",
        "lies between z = 22.929 mm",
    );
    // Behind the scan: azimuth 180°.
    warns(
        "center_mm = [0.0, -80.0, 0.0], normal = [0.0, 1.0, 1.0]",
        "center_mm = [-80.0, 0.0, 0.0], normal = [1.0, 0.0, 1.0]",
        "the scan reaches from -135° to 135°",
    );
    // Behind the pillar.
    warns(
        "center_mm = [-60.0, 0.0, 0.0]\nsize_mm = [10.0, 20.0, 30.0]",
        "center_mm = [0.0, -60.0, 0.0]\nsize_mm = [60.0, 5.0, 30.0]",
        "post \"pillar\"",
    );
    expect_one(
        "[-60.0, 0.0, 0.0]",
        "[1.0, 1.0, 1.0]",
        "[1.0, 1.0, 1.0]",
        &["over the origin"],
    );
}

#[test]
fn mirrors_may_not_pass_through_each_other_or_the_scanner() {
    let header = "[[superstructure.facet]]\nname = \"rectangle\"";
    // Into the polygon, which lies in the plane of y = 70 mm + (z + 10 mm)/2.
    expect_one(
        "center_mm = [0.0, -80.0, 0.0], normal = [0.0, 1.0, 1.0]",
        "center_mm = [-30.0, 75.0, 0.0], normal = [0.0, -1.0, 1.0]",
        header,
        &[
            "(\"rectangle\") passes through facet \"polygon\" at (",
            "mm in the sensor frame",
        ],
    );
    expect_one(
        "[0.0, -80.0, 0.0]",
        "[0.0, -22.0, 0.0]",
        header,
        &["passes through the scanner's housing at ("],
    );
}

#[test]
fn housings_that_block_all_light() {
    let preset = "preset = \"ust-20lx\"";
    let with = |lines: &str| format!("{preset}\n{lines}");
    expect_one(
        preset,
        &with("housing_box = [{ center_mm = [0, 0, 5], size_mm = [50, 50, 20] }]"),
        "[0, 0, 5]",
        &["over the origin of the scanner"],
    );
    expect_one(
        preset,
        &with("housing = false\nhousing_box = [{ center_mm = [0, 0, -30], size_mm = [50, 50, 20] }]"),
        "[{ center_mm",
        &["`scanner.housing` is false"],
    );
    expect_one(
        preset,
        &with("housing_box = [{ center_mm = [0, 0, -30], size_mm = [50, 0, 20] }]"),
        "0, 20]",
        &["0.01"],
    );
}

#[test]
fn everything_must_be_in_the_room() {
    expect_one(
        "[0.0, 0.0, 1.2]",
        "[0.0, 0.0, -0.2]",
        "[0.0, 0.0, -0.2]",
        &["floor"],
    );
    expect_one(
        "[0.0, 0.0, 1.2]",
        "[3.5, 0.0, 1.2]",
        "[3.5, 0.0, 1.2]",
        &["0.5 m beyond the +x wall"],
    );
    expect_one(
        "position_mm = [0.0, 0.0, 0.0]",
        "position_mm = [0.0, 0.0, -1300.0]",
        "[0.0, 0.0, 1.2]",
        &["the sensor 0.1 m beyond the floor"],
    );
    expect_one(
        "[1.5, 0.0, 1.2]",
        "[1.5, 2.9, 1.2]",
        "[1.5, 2.9, 1.2]",
        &["0.2 m beyond the +y wall"],
    );
}

#[test]
fn a_board_must_be_in_front_of_its_beams() {
    expect_one(
        "center_m = [1.5, 0.0, 1.2]\nnormal = [-1.0, 0.0, 0.0]",
        "center_m = [-1.5, 0.0, 1.2]\nnormal = [1.0, 0.0, 0.0]",
        "[-1.5, 0.0, 1.2]",
        &["behind the sensor", "azimuth 180°", "-135° to 135°"],
    );
    expect_one(
        "[1.5, 0.0, 1.2]",
        "[1.5, 0.0, 2.1]",
        "[1.5, 0.0, 2.1]",
        &["no undeflected beam", "0.9 m above"],
    );
    expect_one(
        "[-1.0, 0.0, 0.0]",
        "[1.0, 0.0, 0.0]",
        "[1.0, 0.0, 0.0]",
        &["the back of the board"],
    );
    // The wedge deflects its fan up and to the left; this board is low on the right.
    expect_one(
        "center_m = [0.3, 0.7, 2.1]\nnormal = [0.0, -0.5, -1.0]",
        "center_m = [-0.3, -0.7, 0.5]\nnormal = [0.0, 0.5, 1.0]",
        "[-0.3, -0.7, 0.5]",
        &["behind facet \"wedge\"", "the middle of the fan passes through"],
    );
    expect_one(
        "center_m = [0.3, 0.7, 2.1]",
        "center_m = [2.0, 0.7, 2.1]",
        "[2.0, 0.7, 2.1]",
        &["no beam of facet \"wedge\""],
    );
    expect_one(
        "facet = \"wedge\"",
        "facet = \"wegde\"",
        "\"wegde\"",
        &["did you mean `wedge`?"],
    );
    expect_one("[0.0, -0.5, -1.0]", "[0.0, 0, 0]", "[0.0, 0, 0]", &["length 0"]);
}
