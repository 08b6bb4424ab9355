//! The table of every sub-ray compared with the table of every return, and with results independent of both.
//!
//! This proves that the energy of a beam is listed completely and that the listed light is the light of its echoes. The
//! paths of that light are covered by `physics` and `traps`.

use crate::common::{VALID, folder_with, run, stderr};
use crate::scenes::{BARE, scene};
use catoptric::sim::build::Structure;
use catoptric::sim::light::{Mirrors, Setting};
use catoptric::sim::receive::{Sensor, SubRayLight, SubRayStop};
use catoptric::sim::scene::{Facet, FacetShape, RectangleShape};
use catoptric_fixtures::ust20lx;
use std::collections::BTreeMap;
use std::path::Path;

/// The columns, as listed in the guide.
const COLUMNS: &str = "pose,scan,beam,sub_ray,wide,narrow,weight,light,facets,end,surface,name,path_m,cos_incidence,\
                       power_w,x_m,y_m,z_m";

/// Records [`VALID`] with changes.
fn record(folder: &Path, out: &str, sets: &[&str]) {
    let mut arguments = vec![
        "simulate",
        "scene.toml",
        "--out",
        out,
        "--returns",
        "--sub-rays",
        "--set",
        "experiment.scans_per_pose=1",
    ];
    for set in sets {
        arguments.extend(["--set", set]);
    }
    let output = run(folder, &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
}

/// The rows of a table of the truth, by the names of its columns.
fn table(folder: &Path, name: &str) -> Vec<BTreeMap<String, String>> {
    let text = std::fs::read_to_string(folder.join("set/truth").join(name)).unwrap();
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    reader.deserialize().map(|row| row.unwrap()).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    let field = &row[column];
    field.parse().unwrap_or_else(|_| panic!("{column} is {field:?}"))
}

/// Rows by pose and beam.
type Beams = BTreeMap<(String, String), Vec<BTreeMap<String, String>>>;

fn by_beam(rows: Vec<BTreeMap<String, String>>) -> Beams {
    let mut beams = Beams::new();
    for row in rows {
        let key = (row["pose"].clone(), row["beam"].clone());
        beams.entry(key).or_default().push(row);
    }
    beams
}

/// Power of each path and surface: (facets, surface) and name.
fn powers(rows: &[BTreeMap<String, String>]) -> BTreeMap<(String, String), BTreeMap<String, f64>> {
    let mut sums = BTreeMap::<_, BTreeMap<String, f64>>::new();
    for row in rows.iter().filter(|r| r["end"] == "hit") {
        let way = (row["facets"].clone(), row["surface"].clone());
        *sums
            .entry(way)
            .or_default()
            .entry(row["name"].clone())
            .or_default() += number(row, "power_w");
    }
    sums
}

#[test]
fn the_rows_of_a_beam_are_its_energy_and_its_echoes() {
    let (folder, _) = folder_with(VALID);
    record(folder.path(), "set", &[]);
    let path = folder.path().join("set/truth/sub_rays.csv");
    let text = std::fs::read_to_string(path).unwrap();
    assert_eq!(text.lines().next(), Some(COLUMNS));
    let beams = by_beam(table(folder.path(), "sub_rays.csv"));
    let returns = by_beam(table(folder.path(), "returns.csv"));
    assert_eq!(beams.len() % ust20lx::COUNT, 0);
    for (key, rows) in &beams {
        let numbers: Vec<f64> = rows.iter().map(|r| number(r, "sub_ray")).collect();
        assert!(numbers.iter().copied().eq((0..19).map(f64::from)), "{key:?}");
        let weight: f64 = rows.iter().map(|r| number(r, "weight")).sum();
        assert!((weight - 1.0).abs() < 1e-12, "{key:?}: {weight}");
        assert!(rows.iter().all(|r| r["scan"].is_empty() && r["light"] == "beam"));
    }
    let (mut of_one_surface, mut split) = (0, 0);
    for (key, found) in &returns {
        let rows = &beams[key];
        let sums = powers(rows);
        for echo in found {
            // Two walls are both a "wall": the echo is that of one of them.
            let power = number(echo, "power_w");
            let sums = &sums[&(echo["facets"].clone(), echo["surface"].clone())];
            // Only the order of summation differs.
            let agrees = sums.values().any(|sum| (sum / power - 1.0).abs() < 1e-12);
            assert!(agrees, "{key:?}: {sums:?} against {power}");
        }
        let first = &rows[0];
        let same =
            |r: &BTreeMap<String, String>| r["facets"] == first["facets"] && r["name"] == first["name"];
        if rows.iter().all(same) {
            of_one_surface += 1;
            // Sub-ray 0 is the chief ray.
            assert_eq!(found[0]["geometric_m"], first["path_m"], "{key:?}");
            assert_eq!(found[0]["cos_incidence"], first["cos_incidence"], "{key:?}");
            assert!((number(&found[0], "share") - 1.0).abs() < 1e-12);
        } else {
            split += 1;
        }
        for row in rows
            .iter()
            .filter(|r| r["end"] == "hit" && r["facets"].is_empty())
        {
            // Without an aperture, every sub-ray starts at the sensor's origin.
            let from_origin = libm::hypot(
                libm::hypot(number(row, "x_m"), number(row, "y_m")),
                number(row, "z_m"),
            );
            assert!((from_origin - number(row, "path_m")).abs() < 1e-12, "{row:?}");
        }
    }
    assert!(of_one_surface > 4000 && split > 50, "{of_one_surface}, {split}");
}

#[test]
fn ghosts_and_dust_are_listed_as_such() {
    let (folder, _) = folder_with(VALID);
    let sets = [
        "superstructure.mirror.thickness_mm=3",
        "superstructure.mirror.glass={index=1.51,thickness_mm=3,ghost=true}",
        "superstructure.mirror.diffuse_reflectivity=0.05",
        "superstructure.mirror.coating.stack={n=2.1,k=8.4}",
        "light.vignetting=true",
        "scanner.preset=utm-30lx-ew",
        "detection.echo=all",
    ];
    record(folder.path(), "set", &sets);
    let beams = by_beam(table(folder.path(), "sub_rays.csv"));
    let returns = by_beam(table(folder.path(), "returns.csv"));
    let mut count = BTreeMap::<&str, usize>::new();
    for rows in beams.values() {
        let weights = rows
            .iter()
            .filter(|r| r["light"] == "beam")
            .map(|r| number(r, "weight"));
        assert!((weights.sum::<f64>() - 1.0).abs() < 1e-12);
        for row in rows {
            *count.entry(row["light"].as_str()).or_default() += 1;
            assert!(row["light"] != "mirror" || row["surface"] == "facet", "{row:?}");
        }
    }
    assert!(count["ghost"] > 1000 && count["mirror"] > 1000, "{count:?}");
    let mut echoes_of_mirrors = 0;
    for (key, found) in &returns {
        let sums = powers(&beams[key]);
        for echo in found {
            let power = number(echo, "power_w");
            let sums = &sums[&(echo["facets"].clone(), echo["surface"].clone())];
            assert!(
                sums.values().any(|sum| (sum / power - 1.0).abs() < 1e-12),
                "{key:?}"
            );
            echoes_of_mirrors += usize::from(echo["surface"] == "facet");
        }
    }
    assert!(echoes_of_mirrors > 10, "{echoes_of_mirrors}");
    // The number of threads changes nothing.
    let read = || std::fs::read(folder.path().join("set/truth/sub_rays.csv")).unwrap();
    let before = read();
    let threads = [&sets[..], &["experiment.scans_per_pose=1"]].concat();
    let mut arguments = vec![
        "simulate",
        "scene.toml",
        "--out",
        "set",
        "--sub-rays",
        "--replace",
        "--threads",
        "3",
    ];
    threads.iter().for_each(|set| arguments.extend(["--set", set]));
    let output = run(folder.path(), &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(before == read());
}

#[test]
fn light_that_hits_nothing_has_no_position() {
    let mut scene = scene(BARE);
    // Straight ahead, two mirrors face each other at 45°, and only one bounce is allowed.
    scene.superstructure.max_bounces = 1;
    let facet = |name: &str, center_mm: [f64; 3], normal: [f64; 3]| Facet {
        name: name.to_owned(),
        curve: None,
        bow_um: 0.0,
        two_sided: false,
        reflectivity: None,
        coating: None,
        shape: FacetShape::Rectangle(RectangleShape {
            center_mm,
            normal,
            width_mm: 40.0,
            height_mm: 20.0,
        }),
    };
    scene.superstructure.facet = vec![
        facet("first", [80.0, 0.0, 0.0], [-1.0, 1.0, 0.0]),
        facet("second", [80.0, 60.0, 0.0], [0.0, -1.0, 1.0]),
    ];
    let structure = Structure::nominal(&scene).unwrap();
    let setting = Setting::new(&scene, &structure, Mirrors::Attached, Vec::new()).unwrap();
    let sensor = Sensor::new(&scene).unwrap();
    let ahead = sensor.sub_ray_ends(&setting, ust20lx::FORWARD);
    assert_eq!(ahead.len(), 19);
    for end in &ahead {
        assert_eq!((&end.stop, end.light), (&SubRayStop::Trapped, SubRayLight::Beam));
        assert_eq!(end.facets, [0]);
        assert!((end.path - 0.08).abs() < 1e-3 && end.path > 0.0);
    }
    // The chief ray's path to the last mirror it hit.
    assert!((ahead[0].path - 0.08).abs() < 1e-15, "{:?}", ahead[0]);
    let behind = sensor.sub_ray_ends(&setting, 0);
    assert!(
        behind
            .iter()
            .all(|e| e.stop == SubRayStop::Escaped && e.facets.is_empty() && e.path == 0.0)
    );
    let weights: f64 = behind.iter().map(|e| e.sub_ray.weight).sum();
    assert!((weights - 1.0).abs() < 1e-12);
}

#[test]
fn in_flight_every_scan_has_its_own_rows() {
    let flight = r#"
[[flight]]
name = "ahead"
waypoint = [
    { time_s = 0, position_m = [0, 0, 1.2] },
    { time_s = 0.05, position_m = [0.1, 0.02, 1.2], yaw_deg = 3 },
]
"#;
    let (folder, _) = folder_with(&(VALID.to_owned() + flight));
    record(folder.path(), "set", &["scanner.sub_rays=7"]);
    let in_flight = |name: &str| {
        let rows = table(folder.path(), name);
        let last = rows.last().unwrap()["pose"].clone();
        let of_flight = rows.into_iter().filter(|r| r["pose"] == last);
        let mut scans = BTreeMap::<(String, String), Vec<_>>::new();
        for row in of_flight {
            scans
                .entry((row["scan"].clone(), row["beam"].clone()))
                .or_default()
                .push(row);
        }
        scans
    };
    let (rays, returns) = (in_flight("sub_rays.csv"), in_flight("returns.csv"));
    assert_eq!(rays.len(), 2 * ust20lx::COUNT);
    let mut moved = 0;
    for ((scan, beam), rows) in &rays {
        assert!(scan == "0" || scan == "1", "{scan:?}");
        let weight: f64 = rows.iter().map(|r| number(r, "weight")).sum();
        assert!((weight - 1.0).abs() < 1e-12, "{scan} {beam}: {weight}");
        let Some(found) = returns.get(&(scan.clone(), beam.clone())) else {
            continue;
        };
        let sums = powers(rows);
        let sums = &sums[&(found[0]["facets"].clone(), found[0]["surface"].clone())];
        let power = number(&found[0], "power_w");
        assert!(
            sums.values().any(|sum| (sum / power - 1.0).abs() < 1e-12),
            "{scan} {beam}"
        );
        let other = &rays[&("0".to_owned(), beam.clone())];
        moved += usize::from(scan == "1" && other[0]["path_m"] != rows[0]["path_m"]);
    }
    // Between the scans the rig moves 50 mm: everything that is not on the rig itself is elsewhere.
    assert!(moved > 900, "{moved}");
}
