//! What the experimenter knows: the drawing, the surveys, and the results of steps 1 and 3.

use super::setup::Laboratory;
use crate::build::board::board_markers;
use crate::build::color;
use crate::build::structure::{self, Structure};
use crate::error::SimError;
use crate::laboratory::placement;
use crate::light::optics::{Mirrors, Setting};
use crate::noise::{Draws, Purpose};
use crate::scene::{ErrorModel, Marker, NoiseTable};
use catoptric_cast::Shape;
use catoptric_model::glass::GlassSheet;
use catoptric_model::noise::Noise;
use catoptric_model::session::{self, Session};
use catoptric_model::{PoseData, PoseKind, PoseRecord, Summary, beam};
use nalgebra::{Unit, Vector3};
use std::collections::BTreeMap;

/// Bare readings beyond this do not come from the structure, in meters.
const FARTHEST_STRUCTURE: f64 = 0.3;

/// Number of beams beyond the drawn ones for which a bare distance is still recorded: as built, the edges move.
const NEAR_FACET: usize = 12;

impl Laboratory {
    /// The session: everything the experimenter knows.
    ///
    /// # Errors
    /// As for [`Laboratory::returns`]: the bare structure is measured here.
    pub fn session(&self) -> Result<Session, SimError> {
        let scene = &self.scene;
        let mount = &scene.scanner.mount;
        let limits = scene.scanner.limits();
        // The standard deviation of a uniform error is its limit over √3.
        let sd = |limit: f64| limit / 3.0_f64.sqrt();
        let tilt = sd(mount.tilt_tolerance_deg);
        let [x, y, z] = scene.room.size_m;
        let mut session = Session {
            schema_version: session::SCHEMA_VERSION,
            name: scene.name.clone(),
            scanner: session::ScannerSheet {
                preset: scene.scanner.preset.name().to_owned(),
                scan: *self.sensor.scan(),
                range_min_m: limits.range_min_m,
                range_max_m: limits.range_max_m,
                divergence_full_mrad: scene.scanner.beam_shape().wide_full_mrad,
            },
            nominal_rig_from_sensor: PoseData::from(&structure::nominal_mount(scene)),
            mount_tolerance: session::MountTolerance {
                rotation_sd_deg: [tilt, tilt, sd(mount.yaw_tolerance_deg)],
                translation_sd_mm: [sd(mount.shift_tolerance_mm); 3],
            },
            room: scene.room.has_walls().then(|| session::RoomSurvey {
                min_m: [-0.5 * x, -0.5 * y, 0.0],
                max_m: [0.5 * x, 0.5 * y, z],
                color: scene.room.color.clone(),
            }),
            believed: self.beliefs(),
            bare_structure: self.bare_structure()?,
            glass: scene.superstructure.mirror.glass.map(|glass| GlassSheet {
                thickness_mm: glass.thickness_mm,
                thickness_sd_mm: 0.0,
                index: glass.index,
            }),
            rig_markers: known_markers(&scene.superstructure.marker),
            facets: self.nominal_facets()?,
            boards: scene
                .board
                .iter()
                .map(|b| session::BoardSheet {
                    name: b.name.clone(),
                    width_mm: b.width_mm,
                    height_mm: b.height_mm,
                    thickness_mm: b.thickness_mm,
                    color: b.color.clone(),
                    markers: known_markers(&board_markers(b)),
                })
                .collect(),
        };
        scene.session.lie_over(&mut session)?;
        Ok(session)
    }

    fn beliefs(&self) -> session::Beliefs {
        let errors = &self.scene.errors;
        let known = &self.scene.characterization;
        let perfect = errors.model == ErrorModel::None;
        let unless_perfect = |value: f64| if perfect { 0.0 } else { value };
        let biased = matches!(errors.model, ErrorModel::Empirical | ErrorModel::Both);
        let if_biased = |value: f64| if biased { value } else { 0.0 };
        let noise = &errors.noise.sd_mm;
        session::Beliefs {
            range_noise_sd_mm: unless_perfect(noise.iter().sum::<f64>() / noise.len().max(1) as f64),
            noise: (!perfect).then(|| self.stated(&errors.noise)),
            noise_of: if perfect {
                BTreeMap::new()
            } else {
                self.noise_of_colors()
            },
            drift_sd_mm: unless_perfect(errors.drift_sd_mm),
            element_sd_mm: unless_perfect(errors.element_sd_mm),
            marker_sd_mm: self.scene.mocap.errors().constant.norm() / 3.0_f64.sqrt() * 1e3,
            bias: self.believed.clone(),
            distance_bias_sd_mm: if_biased(known.distance_sd_mm),
            angle_gain_sd_mm: if_biased(known.angle_gain_sd_mm),
            color_bias_sd_mm: if_biased(known.color_sd_mm),
        }
    }

    /// A table of noise as the readings show it, with their rounding.
    fn stated(&self, table: &NoiseTable) -> Noise {
        // The standard deviation of a rounded value is its step over √12.
        let rounding = self.scene.errors.quantization_mm / 12.0_f64.sqrt();
        let sd = table.sd_mm.iter().map(|sd| libm::hypot(*sd, rounding));
        Noise {
            range_m: table.range_m.clone(),
            sd_mm: sd.collect(),
        }
    }

    /// Noise on the boards and the walls whose color has a table of its own.
    fn noise_of_colors(&self) -> BTreeMap<String, Noise> {
        let boards = self.scene.board.iter().map(|b| &b.color);
        let names = boards.chain([&self.scene.room.color]);
        let own = names.filter_map(|name| {
            let noise = color::paint(&self.scene, name).ok()?.noise;
            (noise != self.scene.errors.noise).then(|| (name.clone(), self.stated(&noise)))
        });
        own.collect()
    }

    fn nominal_facets(&self) -> Result<Vec<session::NominalFacet>, SimError> {
        let nominal = Structure::nominal(&self.scene)?;
        let setting = Setting::new(&self.scene, &nominal, Mirrors::Attached, Vec::new())?;
        let paths: Vec<_> = (0..self.sensor.scan().beams())
            .map(|b| self.sensor.chief_path(&setting, b))
            .collect();
        let served = placement::served_beams(&paths, nominal.facets.len(), self.sensor.scan());
        Ok(nominal
            .facets
            .iter()
            .zip(&self.scene.superstructure.facet)
            .zip(served)
            .filter_map(|((facet, drawn), beams)| {
                Some(session::NominalFacet {
                    name: facet.name.clone(),
                    corners_mm: facet
                        .face
                        .corners
                        .iter()
                        .map(|c| (c.coords * 1e3).into())
                        .collect(),
                    // A bow is what nobody drew.
                    curve: drawn.curve,
                    beams: beams?,
                })
            })
            .collect())
    }

    /// Step 3: mean ranges to the bare structure, corrected with the incidence from the drawing.
    fn bare_structure(&self) -> Result<session::BareStructure, SimError> {
        let thickness = self.scene.superstructure.mirror.thickness_mm;
        let facet_normals = self.drawn_normals()?;
        let number = self.planned.iter().position(|p| p.kind == PoseKind::Bare);
        let stretch = number.map(|number| self.stretch(number)).transpose()?;
        let record = stretch.and_then(|s| s.into_record().ok());
        // The experimenter examines the readings before averaging them.
        let noise_sd = self.beliefs().range_noise_sd_mm * 1e-3;
        let examined = |record: &PoseRecord, beam: usize, plain: Summary| {
            let ranges = record.readings.held().unwrap_or_default().iter();
            let readings = ranges.skip(beam).step_by(record.beams()).copied();
            let found = Summary::of_main_body(readings, noise_sd);
            found.filter(|s| s.outliers > 0).unwrap_or(plain)
        };
        let summaries: Vec<Summary> = record.map_or_else(Vec::new, |r| {
            let plain = r.summarize().into_iter().enumerate();
            plain.map(|(beam, plain)| examined(&r, beam, plain)).collect()
        });
        if let Some(sd_mm) = self.scene.experiment.bare_distance_sd_mm {
            return self.measured_bare(sd_mm);
        }
        let scan = self.sensor.scan();
        let mut distance_m = vec![0.0; scan.beams()];
        let mut variance: f64 = 0.0;
        for (beam, summary) in summaries.iter().enumerate() {
            let Some(normal) = facet_normals[beam] else {
                continue;
            };
            if summary.count == 0 || summary.mean > FARTHEST_STRUCTURE {
                continue;
            }
            let cos = normal.dot(&beam::direction(scan.azimuth(beam))).abs();
            let bias = self.believed.terms(summary.mean, cos, "structure").total();
            distance_m[beam] = summary.mean - bias + self.scene.experiment.bare_distance_error_mm * 1e-3;
            variance = variance.max(self.bare_variance(summary.count, cos));
        }
        Ok(session::BareStructure {
            mirror_thickness_mm: thickness,
            distance_sd_mm: variance.sqrt() * 1e3,
            noise_sd_mm: 0.0,
            scanned: true,
            first_beam: 0,
            distance_m,
        })
    }

    /// Step 3 with another instrument: the distances of all beams of a facet share one error, and each has its own.
    fn measured_bare(&self, sd_mm: f64) -> Result<session::BareStructure, SimError> {
        let served = self.nominal_facets()?;
        let scan = self.sensor.scan();
        let experiment = &self.scene.experiment;
        let noise_sd_mm = experiment.bare_noise_sd_mm.unwrap_or(sd_mm);
        let mut distance_m = vec![0.0; scan.beams()];
        for (index, built) in self.structure.facets.iter().enumerate() {
            let Some(sheet) = served.iter().find(|f| f.name == built.name) else {
                continue;
            };
            let mut draws = Draws::new(self.seed, Purpose::BareDistance, index as u64);
            let of_all = 1e-3 * (sd_mm * draws.normal() + experiment.bare_distance_error_mm);
            let face = built.face_shape();
            for beam in scan.run(scan.widened(sheet.beams, NEAR_FACET)) {
                let u = beam::direction(scan.azimuth(beam));
                // The plane of a flat mirror also says how far the structure beyond its edge is.
                let plane = built.face.normal;
                let (to_face, facing) = match &face {
                    Shape::Curved(curved) => match curved.surface.plane_along(&u) {
                        Some(touched) => {
                            let facing = touched.normal.dot(&u);
                            (touched.offset / facing, facing.abs())
                        }
                        None => continue,
                    },
                    _ => (
                        plane.dot(&built.face.corners[0].coords) / plane.dot(&u),
                        plane.dot(&u).abs(),
                    ),
                };
                draws.seek(1 + beam as u64);
                let own = 1e-3 * noise_sd_mm * draws.normal();
                distance_m[beam] = to_face + built.thickness / facing + of_all + own;
            }
        }
        let superstructure = &self.scene.superstructure;
        Ok(session::BareStructure {
            mirror_thickness_mm: superstructure.mirror.thickness_mm,
            distance_sd_mm: libm::hypot(sd_mm, superstructure.as_built.thickness_sd_mm),
            noise_sd_mm,
            scanned: false,
            first_beam: 0,
            distance_m,
        })
    }

    /// For every beam, the drawn normal of the facet that serves it or, within a few beams, of the nearest facet.
    fn drawn_normals(&self) -> Result<Vec<Option<Unit<Vector3<f64>>>>, SimError> {
        let facets = self.nominal_facets()?;
        let scan = self.sensor.scan();
        let away = |f: &session::NominalFacet, beam: usize| scan.beside(f.beams, beam);
        let nearest = |beam| {
            facets
                .iter()
                .min_by_key(|f| away(f, beam))
                .filter(|f| away(f, beam) <= NEAR_FACET)
        };
        Ok((0..scan.beams())
            .map(|beam| {
                let facet = nearest(beam)?;
                let touched = facet.touched(&beam::direction(scan.azimuth(beam)));
                Some(touched.map_or(facet.plane()?.normal, |plane| plane.normal))
            })
            .collect())
    }

    /// Variance that the experimenter assigns to a bare distance, in square meters.
    fn bare_variance(&self, readings: usize, cos: f64) -> f64 {
        let believed = self.beliefs();
        // The incidence comes from the drawing; facet and scanner are both slightly off it.
        let mount = self.scene.scanner.mount.tilt_tolerance_deg / 3.0_f64.sqrt();
        let tilt = libm::hypot(self.scene.superstructure.as_built.tilt_sd_deg, mount).to_radians();
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let terms = [
            believed.range_noise_sd_mm / (readings as f64).sqrt(),
            believed.drift_sd_mm,
            believed.distance_bias_sd_mm,
            believed.color_bias_sd_mm,
            believed.angle_gain_sd_mm * (1.0 - cos),
            believed.bias.angle.gain_mm * sin * tilt,
            // The nominal thickness of the mirror is added, whatever the true one is.
            self.scene.superstructure.as_built.thickness_sd_mm / cos.max(f64::EPSILON),
        ];
        terms.iter().map(|mm| mm * mm * 1e-6).sum()
    }
}

fn known_markers(markers: &[Marker]) -> Vec<session::Marker> {
    markers
        .iter()
        .map(|m| session::Marker {
            name: m.name.clone(),
            position_mm: m.position_mm,
        })
        .collect()
}
