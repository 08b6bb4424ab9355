//! The table of the truth about every sub-ray: `truth/sub_rays.csv`.

use super::tables::{EmitRows, field, mirror_names, path_field, role_name};
use crate::Error;
use catoptric_sim::Laboratory;
use catoptric_sim::laboratory::Sight;
use catoptric_sim::light::Setting;
use catoptric_sim::receive::{SubRayEnd, SubRayLight, SubRayStop};
use rayon::prelude::*;
use std::ops::Range;

/// Header of the table. `scan` is empty where a row holds for every scan of its pose; `weight` is the share of the
/// sub-ray, which sums to one over the rows with `light` "beam"; the power is received from `name`, the point is in the
/// sensor frame.
pub(crate) const HEADER: &str = "pose,scan,beam,sub_ray,wide,narrow,weight,light,facets,end,surface,name,path_m,\
                                 cos_incidence,power_w,x_m,y_m,z_m\n";

/// Number of beams whose rows are in memory at a time.
const BEAMS_AT_ONCE: usize = 64;

/// Emits the rows of some scans of a stretch; where nothing moves, the rows of the first scan hold for all.
pub(crate) fn rows(
    laboratory: &Laboratory,
    pose: usize,
    mut scans: Range<usize>,
    sight: &Sight<'_>,
    emit: EmitRows<'_>,
) -> Result<(), Error> {
    if !sight.moves() {
        return match scans.start {
            0 => rows_of_scan(laboratory, pose, sight, None, emit),
            _ => Ok(()),
        };
    }
    scans.try_for_each(|scan| rows_of_scan(laboratory, pose, sight, Some(scan), emit))
}

/// Emits the rows of a scan, or of a stretch whose scans are all identical.
fn rows_of_scan(
    laboratory: &Laboratory,
    pose: usize,
    sight: &Sight<'_>,
    scan: Option<usize>,
    emit: EmitRows<'_>,
) -> Result<(), Error> {
    let setting = sight.setting();
    let mirrors = mirror_names(laboratory.scene());
    let names = setting.names();
    let named = scan.map_or(String::new(), |scan| scan.to_string());
    let all: Vec<usize> = (0..laboratory.sensor().scan().beams()).collect();
    for beams in all.chunks(BEAMS_AT_ONCE) {
        let texts: Vec<String> = beams
            .par_iter()
            .map(|&beam| {
                let ends = sight.sub_ray_ends(scan.unwrap_or(0), beam);
                ends.iter()
                    .map(|end| format!("{pose},{named},{beam},{}", row(setting, &names, &mirrors, end)))
                    .collect()
            })
            .collect();
        for text in &texts {
            emit(text)?;
        }
    }
    Ok(())
}

/// The columns of a row from `sub_ray` on.
fn row(setting: &Setting<'_>, names: &[&str], mirrors: &[&str], end: &SubRayEnd) -> String {
    let light = match end.light {
        SubRayLight::Beam => "beam",
        SubRayLight::Ghost => "ghost",
        SubRayLight::Mirror => "mirror",
    };
    let facets = path_field(mirrors, &end.facets);
    let (sub_ray, number, path) = (&end.sub_ray, end.number, end.path);
    let (wide, narrow, weight) = (sub_ray.wide, sub_ray.narrow, sub_ray.weight);
    let stop = match &end.stop {
        SubRayStop::Hit {
            surface,
            point,
            cos_incidence,
            power,
        } => {
            let (role, name) = (role_name(setting.role(*surface)), field(names[*surface]));
            let [x, y, z] = point.coords.into();
            format!("hit,{role},{name},{path},{cos_incidence},{power},{x},{y},{z}")
        }
        SubRayStop::Escaped => format!("escaped,,,{path},,0,,,"),
        SubRayStop::Trapped => format!("trapped,,,{path},,0,,,"),
    };
    format!("{number},{wide},{narrow},{weight},{light},{facets},{stop}\n")
}
