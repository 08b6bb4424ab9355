//! Checks what mirrors reflect and scatter: their tables, and that none returns more light than it receives.

use super::values::increasing;
use crate::findings::Findings;
use crate::scene::{Coating, Scene};
use catoptric_model::place::KeyPath;

pub(super) fn check(scene: &Scene, found: &mut Findings) {
    let material = &scene.superstructure.mirror;
    let path = KeyPath::of("superstructure").key("mirror");
    let whole = (material.coating.as_ref(), material.reflectivity);
    reflects(scene, whole, &path, found);
    let facets = KeyPath::of("superstructure").key("facet");
    for (i, facet) in scene.superstructure.facet.iter().enumerate() {
        let path = facets.index(i);
        if facet.coating.is_some() && facet.reflectivity.is_some() {
            found.add(
                &path.key("reflectivity"),
                format_args!("and `{path}.coating` are both given"),
                "a coating says how much is reflected; remove one of them".to_owned(),
            );
        } else if let Some(own) = facet.reflectivity {
            reflects(scene, (None, own), &path, found);
        } else if let Some(coating) = &facet.coating {
            reflects(scene, (Some(coating), 0.0), &path, found);
        }
    }
}

/// Checks a mirror with a coating or a reflectivity, at a path.
fn reflects(
    scene: &Scene,
    (coating, reflectivity): (Option<&Coating>, f64),
    path: &KeyPath,
    found: &mut Findings,
) {
    let material = &scene.superstructure.mirror;
    let passed = material.dust.map_or(1.0, |dust| dust.passed());
    let most = match coating {
        None => reflectivity,
        Some(Coating::Table(table)) => {
            let path = path.key("coating").key("table");
            if table.incidence_deg.is_empty() {
                found.add(
                    &path.key("incidence_deg"),
                    "is empty",
                    "give at least one angle".to_owned(),
                );
            }
            let nodes = ("incidence_deg", "°", table.incidence_deg.as_slice());
            increasing(nodes, &table.across, &path, "across", found);
            if table.within.len() != table.across.len() {
                found.add(
                    &path.key("within"),
                    format_args!(
                        "has {} entries, `{path}.across` has {}",
                        table.within.len(),
                        table.across.len()
                    ),
                    "a table has one value for every angle".to_owned(),
                );
            }
            table
                .across
                .iter()
                .chain(&table.within)
                .copied()
                .fold(0.0, f64::max)
        }
        // At grazing incidence everything is reflected, but no light comes from there.
        Some(Coating::Stack(_)) => 0.0,
    };
    let total = most * passed + material.scattered();
    if total > 1.0 {
        let key = if material.diffuse_reflectivity > 0.0 {
            "diffuse_reflectivity"
        } else {
            "dust"
        };
        let mirror = KeyPath::of("superstructure").key("mirror");
        found.add(
            &mirror.key(key),
            format_args!(
                "scatters {} and `{path}` reflects {}: a mirror cannot return more light than it receives",
                material.scattered(),
                most * passed
            ),
            format!("their sum is {total}; 1 is allowed"),
        );
    }
}
