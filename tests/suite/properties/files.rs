//! Files round-trip: data are read back as written, bit for bit where the format stores all bits.

use super::cases;
use crate::scenes::layouts;
use catoptric::files::{mesh, npy, rays, scene};
use catoptric::model::{BeamEstimate, Calibration, ScanAngles, Status};
use catoptric::sim::Mesh;
use nalgebra::Point3;
use proptest::collection::vec;
use proptest::prelude::*;

/// Any finite number, including subnormal, huge and −0.
fn any_number() -> impl Strategy<Value = f64> {
    prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO | prop::num::f64::NEGATIVE
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|n| n.to_bits()).collect()
}

proptest! {
    #![proptest_config(cases(100))]

    #[test]
    fn scenes_round_trip_through_toml(scene in layouts(), seed: u32) {
        let mut scene = scene;
        scene.seed = u64::from(seed);
        let text = scene::to_toml(&scene).expect("it is a scene");
        let back = scene::parse(&text, "again.toml", &[]).map_err(|e| TestCaseError::fail(e.to_string()))?;
        prop_assert_eq!(&back, &*scene);
        prop_assert_eq!(scene::to_toml(&back).expect("it is a scene"), text);
    }

    #[test]
    fn calibrations_round_trip_through_json(
        beams in vec((0..1081_usize, 0..6_usize, any_number(), any_number(), [any_number(), any_number()]), 0..20),
        name in ".{0,12}",
    ) {
        let beams = beams.into_iter().map(|(beam, status, azimuth, elevation, [a, b])| BeamEstimate {
            facet: Some(name.clone()),
            azimuth_rad: Some(azimuth),
            elevation_rad: Some(elevation),
            covariance_rad2: Some([[a, b], [b, a]]),
            ..BeamEstimate::without_angles(beam, Status::ALL[status], Some(name.clone()))
        });
        let calibration = Calibration {
            schema_version: 1,
            method: name.clone(),
            frame: "sensor".to_owned(),
            scanner: Some(ScanAngles::centered(0.352, 682)),
            dataset: Some(name.clone()),
            beams: beams.collect(),
            facets: Vec::new(),
            rig_from_sensor: None,
            bias: None,
            warnings: Vec::new(),
            assessment: None,
        };
        let text = serde_json::to_string(&calibration).expect("all values are finite");
        let back: Calibration = serde_json::from_str(&text).expect("our own");
        let numbers = |c: &Calibration| -> Vec<f64> {
            let of_beam = |b: &BeamEstimate| [b.azimuth_rad, b.elevation_rad, b.covariance_rad2.map(|c| c[0][1])];
            c.beams.iter().flat_map(of_beam).flatten().collect()
        };
        prop_assert_eq!(bits(&numbers(&back)), bits(&numbers(&calibration)));
        prop_assert_eq!(back, calibration);
    }

    #[test]
    fn meshes_round_trip_through_ply(vertices in vec([any_number(), any_number(), any_number()], 3..30), picks in vec([0..1000_usize, 0..1000, 0..1000], 1..30)) {
        let index = |i: usize| u32::try_from(i % vertices.len()).expect("few");
        let triangles = picks.iter().map(|t| t.map(index)).collect();
        let mesh = Mesh::new(vertices.iter().copied().map(Point3::from).collect(), triangles).expect("finite");
        let back = mesh::parse_mesh(&mesh::to_ply(&mesh), "a.ply").expect("our own");
        let numbers = |m: &Mesh| -> Vec<f64> { m.vertices().iter().flat_map(|p| p.coords.iter().copied().collect::<Vec<_>>()).collect() };
        prop_assert_eq!(bits(&numbers(&back)), bits(&numbers(&mesh)));
        prop_assert_eq!(back.triangles(), mesh.triangles());
    }

    #[test]
    fn rays_are_the_same_from_text_and_from_numbers(
        list in vec([-1e3..1e3_f64, -1e3..1e3, -1e3..1e3, -1.0..1.0, -1.0..1.0, 0.01..1.0], 1..40),
    ) {
        let folder = tempfile::tempdir().expect("a folder");
        let mut text = "x_m,y_m,z_m,dx,dy,dz\n".to_owned();
        let mut bytes = npy::header(list.len(), 6);
        for row in &list {
            text.push_str(&row.map(|n| n.to_string()).join(","));
            text.push('\n');
            bytes.extend(row.iter().flat_map(|n| n.to_le_bytes()));
        }
        let read = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).expect("there is room");
            rays::RayReader::open(&path).and_then(|mut r| r.next_rays(1000)).expect("our own")
        };
        let of_text = read("a.csv", text.as_bytes());
        prop_assert_eq!(&of_text, &read("a.npy", &bytes));
        prop_assert_eq!(of_text.len(), list.len());
        for (ray, [x, y, z, dx, dy, dz]) in of_text.iter().zip(&list) {
            prop_assert_eq!(ray.origin, Point3::new(*x, *y, *z));
            let length = libm::hypot(libm::hypot(*dx, *dy), *dz);
            prop_assert!((ray.direction.into_inner() * length - nalgebra::Vector3::new(*dx, *dy, *dz)).norm() < 1e-15);
        }
    }
}
