//! `catoptric layout`: analyzes the coverage, losses and attainable accuracy of mirror layouts, several side by side.

use super::context::Context;
use super::error::CliError;
use super::judging::{Limits, junit_place, require_help, write_junit};
use super::output::{print, quoted};
use super::outputs::Replacing;
use catoptric::files::names::printable_name;
use catoptric::junit::{Case, Ended, Suite};
use catoptric::layout::{Analysis, Class, FacetView, Requirement, RequirementError};
use catoptric::{
    LAYOUT_FOLDER, LAYOUT_PAGE, LayoutOptions, Scene, distinct_names, layout, layout_json, write_layouts,
};
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `layout`.
#[derive(Debug, Args)]
#[command(mut_arg("require", |option| option.help(require_help(EXAMPLE))))]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON; several are compared side by side.
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// Analyze the structure as built under the seed instead of the drawing.
    #[arg(long)]
    as_built: bool,
    /// Seed of the structure as built and of the predicted accuracy; the scene's own by default.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Use one ray per beam and predict no accuracy: takes milliseconds.
    #[arg(long)]
    coarse: bool,
    /// Change a value of every scene first: superstructure.mirror.reflectivity=0.95.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    limits: Limits,
    /// Also write the requirements as JUnit XML.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Write layout.json, the pictures and a page, report.html, to this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replacing: Replacing,
    /// Print all figures as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let requirements = arguments.limits.requirements(EXAMPLE)?;
    let outputs = arguments.replacing.outputs(&arguments.scenes);
    let place = |out: &PathBuf| outputs.folder(out, &LAYOUT_FOLDER);
    let out = arguments.out.as_ref().map(place).transpose()?;
    let junit = junit_place(arguments.junit.as_ref(), &outputs)?;
    let mut scenes = Vec::new();
    for path in &arguments.scenes {
        let scene = Scene::load_with(path, &arguments.set)?;
        context.warn_of(&scene);
        scenes.push(scene);
    }
    let options = LayoutOptions {
        as_built: arguments.as_built,
        seed: arguments.seed,
        coarse: arguments.coarse,
    };
    let begin = Instant::now();
    let mut analyses = Vec::new();
    for scene in &scenes {
        context.check()?;
        analyses.push(layout(scene, &options)?);
    }
    context.detail(&format!("analyzed in {:.3} s", begin.elapsed().as_secs_f64()));
    let (unmet, suites) = unmet(&requirements, &analyses)?;
    write_junit(junit.as_ref(), &suites)?;
    let mut said = String::new();
    if let Some(out) = out {
        said = format!("wrote {}\n", quoted(&out.path().join(LAYOUT_PAGE)));
        let layouts: Vec<(&Scene, &Analysis)> = scenes.iter().zip(&analyses).collect();
        write_layouts(&layouts, out, &context.control())?;
    }
    if arguments.json {
        print(&layout_json(&analyses)?)?;
    } else {
        let pairs: Vec<(&Scene, &Analysis)> = scenes.iter().zip(&analyses).collect();
        let names = distinct_names(&pairs);
        let mut text: Vec<String> = analyses
            .iter()
            .zip(&names)
            .map(|(a, name)| text(a, name))
            .collect();
        if context.global.verbose > 0 {
            for (text, (scene, analysis)) in text.iter_mut().zip(scenes.iter().zip(&analyses)) {
                text.push_str(&corners(&layout::Drawing::new(scene.resolved(), analysis.seed)?));
            }
        }
        print(&(text.join("\n") + &said + &next(arguments)))?;
    }
    if unmet.is_empty() {
        Ok(())
    } else {
        Err(CliError::Verdict(unmet.join("\n")))
    }
}

/// An example of a requirement.
const EXAMPLE: &str = "field_of_regard>=0.004";

/// The error for a requirement that names no figure.
pub(super) fn refused(error: RequirementError, example: &str) -> CliError {
    let message = format!("--require: {error}");
    let help = match error {
        RequirementError::Form { .. } | RequirementError::Limit { .. } => format!("--require '{example}'"),
        RequirementError::Unknown { help, .. } => help,
    };
    CliError::invalid(message, help)
}

/// What is not met, and one suite for each layout.
fn unmet(requirements: &[Requirement], analyses: &[Analysis]) -> Result<(Vec<String>, Vec<Suite>), CliError> {
    let (mut unmet, mut suites) = (Vec::new(), Vec::new());
    for analysis in analyses {
        let mut cases = Vec::new();
        for requirement in requirements {
            let found = layout::judge(requirement, analysis).map_err(|e| refused(e, EXAMPLE))?;
            cases.push(Case::of_requirement(&requirement.to_string(), &found));
            unmet.extend(found.iter().map(|u| format!("not met: {u}")));
        }
        let passes = cases.iter().all(|c| c.ended == Ended::Passed);
        suites.push(Suite {
            name: analysis.name.clone(),
            verdict: if passes { "pass" } else { "fail" }.to_owned(),
            cases,
        });
    }
    Ok((unmet, suites))
}

fn next(arguments: &Arguments) -> String {
    let scenes: Vec<String> = arguments.scenes.iter().map(|s| quoted(s)).collect();
    match (&arguments.out, arguments.scenes.as_slice()) {
        (None, _) => format!("next: catoptric layout {} --out layout\n", scenes.join(" ")),
        (Some(_), [one]) => format!(
            "next: catoptric export {} --format stl --out mirrors.stl\n",
            quoted(one)
        ),
        (Some(_), _) => String::new(),
    }
}

/// An analysis as text.
fn text(analysis: &Analysis, name: &str) -> String {
    let counts: Vec<String> = Class::ALL
        .iter()
        .filter_map(|class| {
            let count = analysis.counts.get(class).filter(|c| **c > 0)?;
            Some(format!("{count} {}", class.words()))
        })
        .collect();
    let built = analysis
        .seed
        .map_or_else(String::new, |seed| format!(" as built under seed {seed}"));
    let elevation = analysis.elevation_deg.map_or_else(
        || "no elevation".to_owned(),
        |[low, high]| format!("elevation {low:.1}° to {high:.1}°"),
    );
    let mut text = format!(
        "{}{built}: {}\n  largest gap {:.2}° of the scan; field of regard {:.3} % of all directions ({:.4} sr), {:.1} % within \
         5° of a beam; {elevation}, {:.0} of 360° of azimuth\n",
        printable_name(name),
        counts.join(", "),
        analysis.largest_gap_deg,
        100.0 * analysis.field_of_regard,
        analysis.solid_angle_sr,
        100.0 * analysis.share_within_5_deg,
        analysis.azimuth_covered_deg,
    );
    let width = analysis
        .facets
        .iter()
        .map(|f| f.name.chars().count())
        .max()
        .unwrap_or(0);
    text.extend(analysis.facets.iter().map(|f| facet(f, width)));
    let spots = analysis
        .spots
        .iter()
        .map(|s| format!("{:.0} × {:.0} mm at {:.0} m", s.wide_mm, s.narrow_mm, s.range_m));
    let size = &analysis.size;
    let [x, y, z] = size.extent_mm;
    text += &format!(
        "  spot {}\n  size {x:.0} × {y:.0} × {z:.0} mm, mirrors {:.1} cm², {:.0} g of mirrors and posts\n",
        spots.collect::<Vec<_>>().join(", "),
        size.mirror_area_mm2 / 100.0,
        size.structure_mass_g,
    );
    if let Some(accuracy) = &analysis.accuracy {
        text += &match (accuracy.per_axis_deg, &accuracy.reason) {
            (Some(bound), _) => format!(
                "  calibration from {} board poses can reach {bound:.4}° per axis, {:.1} mm at 4 m; {} elements open\n",
                accuracy.board_poses,
                accuracy.point_at_4m_mm.unwrap_or(f64::NAN),
                accuracy.open,
            ),
            (None, reason) => format!(
                "  calibration: no bound: {}\n",
                reason.as_deref().unwrap_or("nothing limits it")
            ),
        };
    }
    text
}

/// The polygons that were analyzed.
fn corners(drawing: &layout::Drawing) -> String {
    let facets = drawing.facets.iter().map(|facet| {
        let corners = facet.face.corners.iter().map(|c| {
            let c = c * 1e3;
            format!("({:.3}, {:.3}, {:.3})", c.x, c.y, c.z)
        });
        let corners: Vec<String> = corners.collect();
        let curve = facet.bent.as_ref().map_or_else(String::new, |bent| {
            let (radius, name) = bent.curve.radius_mm();
            let side = if radius > 0.0 { "concave" } else { "convex" };
            format!(", a {side} {name} of radius {:.3} mm over them", radius.abs())
        });
        format!("  {}: corners {} mm{curve}\n", facet.name, corners.join(", "))
    });
    facets.collect()
}

fn facet(facet: &FacetView, width: usize) -> String {
    let Some(([low, high], [left, right])) = facet.exit_elevation_deg.zip(facet.exit_azimuth_deg) else {
        return format!("  {:width$}  serves no element\n", printable_name(&facet.name));
    };
    let number = |value: Option<f64>, decimals: usize| {
        value.map_or_else(|| "–".to_owned(), |v| format!("{v:.decimals$}"))
    };
    format!(
        "  {:width$}  {:3} elements to azimuth {left:.0}° to {right:.0}°, elevation {low:.0}° to {high:.0}°; {} split; margin {} \
         mm ({} beams); to {} m at 10 %; 0.1° of tilt moves 4 m by {} mm\n",
        printable_name(&facet.name),
        facet.elements,
        facet.split,
        number(facet.margin_mm, 2),
        number(facet.margin_beams, 1),
        number(facet.range_max_dark_m, 1),
        number(facet.point_at_4m_per_0_1_deg_rms_mm, 1),
    )
}
