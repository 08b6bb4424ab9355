//! The page on a layout search: the trade-off between the goals, the best layout, and why it is better.

use super::figure::{self, Axes, Mark, Stroke, color, css};
use super::layout::{Drawn, before_and_after};
use super::page::{escape, figure as block, page, table};
use catoptric_design::optimize::{Better, LayoutCandidate, Optimum, Stated};
use plotters::style::RGBColor;
use std::ops::Range;

/// Size of the plot, in pixels.
const SIZE: (u32, u32) = (640, 480);

/// Color of layouts that are neither on the front nor the drawing.
const EVALUATED: RGBColor = RGBColor(0x8C, 0x8C, 0x8C);

/// Palette indices of the front, the drawing and the best layout.
const FRONT: usize = 0;
const START: usize = 1;
const BEST: usize = 2;

/// Formats the value of a goal with at most six significant digits.
pub fn goal_value(value: f64) -> String {
    let size = value.abs();
    let decimals = match size {
        _ if value.fract() == 0.0 => 0,
        _ if size >= 1000.0 => 1,
        _ if size >= 10.0 => 2,
        _ if size >= 0.1 => 4,
        _ => 6,
    };
    format!("{value:.decimals$}")
}

/// Returns the front over the first two goals as a standalone SVG file; `None` with one goal or nothing to show.
pub fn front_picture(found: &Optimum) -> Option<String> {
    picture(found).map(|svg| figure::standalone(&svg))
}

/// Returns the page, as HTML. `layouts` are the layout as drawn and the best, if there is one.
pub fn optimum(found: &Optimum, layouts: Option<&[Drawn; 2]>) -> String {
    let mut html = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"subtitle\">A search for better layouts</p>\n</header>\n<p>{}</p>\n",
        escape(&found.name),
        escape(&summary(found))
    );
    html += &layouts.map_or_else(String::new, |pair| {
        format!("<h2>Before and after</h2>\n{}", before_and_after(pair))
    });
    html += &held_back(found);
    html += "<h2>Trade-off between the goals</h2>\n";
    let mut headings = vec!["layout"];
    let names: Vec<String> = found.goals.iter().map(heading).collect();
    headings.extend(names.iter().map(String::as_str));
    let row = |name: String, candidate: &LayoutCandidate| {
        let values = found.goals.iter().map(|g| value(candidate, &g.name));
        std::iter::once(name).chain(values).collect::<Vec<String>>()
    };
    let mut rows = vec![row("as drawn".to_owned(), &found.start)];
    rows.extend(
        found
            .best
            .iter()
            .map(|b| row(format!("best, no. {}", b.number), b)),
    );
    rows.extend(found.front.iter().map(|c| row(format!("no. {}", c.number), c)));
    let legend = [
        (EVALUATED, "evaluated"),
        (color(FRONT), "front"),
        (color(START), "as drawn"),
        (color(BEST), "best"),
    ];
    let legend = legend.map(|(color, name)| (css(color), name.to_owned()));
    html += &match picture(found) {
        Some(svg) => block(
            &svg,
            "Every layout that meets the requirements. None is better in both goals than those on the front; the best \
             is the one whose smallest gain in any goal is largest, gains being relative to the spread of the front.",
            &legend,
            &headings,
            &rows,
        ),
        None => table(&headings, &rows),
    };
    html += &best(found);
    html += &next(found);
    html += "<footer>Found by particle swarms, each along one direction of the front, with one random number generator: \
             the same seed gives the same layouts on any number of threads. The best layouts are stored next to this \
             page as scenes.</footer>\n";
    page(&format!("{} – catoptric optimize", found.name), &html)
}

/// What holds the search back: requirements, refused scenes, and parameters that change nothing.
fn held_back(found: &Optimum) -> String {
    let mut html = String::new();
    if !found.holds.is_empty() {
        let rows: Vec<Vec<String>> = found
            .holds
            .iter()
            .map(|hold| {
                vec![
                    hold.requirement.clone(),
                    hold.unmet.to_string(),
                    hold.reached.map_or_else(|| "–".to_owned(), goal_value),
                    if hold.binding { "binding" } else { "" }.to_owned(),
                ]
            })
            .collect();
        html += "<h2>What holds it back</h2>\n<p>A requirement is binding if a layout that fails only this one is better than \
                 the best in some goal and worse in none.</p>\n";
        html += &table(
            &[
                "requirement",
                "layouts that fail it",
                "best value reached",
                "binding",
            ],
            &rows,
        );
    }
    if !found.refused.is_empty() {
        let rows: Vec<Vec<String>> = found
            .refused
            .iter()
            .map(|refusal| vec![refusal.reason.clone(), refusal.layouts.to_string()])
            .collect();
        html += "<p>Layouts that are no valid scene, with their first problem:</p>\n";
        html += &table(&["for example", "layouts"], &rows);
    }
    if !found.without_effect.is_empty() {
        html += &format!(
            "<p>Left as drawn, since they alone change neither a goal nor a requirement: {}.</p>\n",
            escape(&found.without_effect.join(", "))
        );
    }
    html
}

/// What to do with the result.
fn next(found: &Optimum) -> String {
    let steps = match &found.best {
        None => "<li>Loosen the requirement that fewest layouts meet, or give the parameters wider limits.</li>\n".to_owned(),
        Some(_) => "<li>Look at it: <code>catoptric layout SCENE best.toml --out side-by-side</code>.</li>\n\
                    <li>Ask what the workshop will make of it: <code>catoptric tolerance best.toml</code>.</li>\n\
                    <li>Build it: <code>catoptric export best.toml --format stl --out mirrors.stl</code>.</li>\n"
            .to_owned(),
    };
    format!("<h2>What to do next</h2>\n<ul>\n{steps}</ul>\n")
}

fn summary(found: &Optimum) -> String {
    let beats = match (&found.best, found.beats_start_in_every_goal) {
        (None, _) => "No evaluated layout meets every requirement.",
        (Some(_), true) => "The best is better than the drawing in every goal.",
        (Some(_), false) => "None is better than the drawing in every goal.",
    };
    let requirements = if found.requirements.is_empty() {
        String::new()
    } else {
        format!(" Required: {}.", found.requirements.join(", "))
    };
    format!(
        "{} layouts were evaluated under seed {}; {} of them meet the requirements, and {} of those are not beaten in \
         all goals by any other. {beats}{requirements}{}",
        found.evaluations,
        found.seed,
        found.tried.len(),
        found.front.len(),
        if found.interrupted {
            " The search was interrupted."
        } else {
            ""
        },
    )
}

/// Describes the best layout: its parameters, and why it is better.
fn best(found: &Optimum) -> String {
    let Some(best) = &found.best else {
        return String::new();
    };
    let mut html = "<h2>The best layout</h2>\n".to_owned();
    let rows: Vec<Vec<String>> = found
        .parameters
        .iter()
        .map(|open| {
            let value = best.parameters.get(&open.name).copied().unwrap_or(open.start);
            // As it is written to the scene: in steps that can be made.
            let value = if value == open.start {
                "as drawn".to_owned()
            } else {
                value.to_string()
            };
            let limits = format!("{} to {}", open.low, open.high);
            vec![open.name.clone(), open.start.to_string(), value, limits]
        })
        .collect();
    html += &table(&["parameter", "as drawn", "best", "limits"], &rows);
    let Some(why) = &found.why else { return html };
    html += "<h2>Why it is better</h2>\n<p>Elements by class:</p>\n";
    let pair = |name: String, [start, best]: [usize; 2]| vec![name, start.to_string(), best.to_string()];
    let mut rows: Vec<Vec<String>> = why
        .elements
        .iter()
        .map(|(class, counts)| pair(class.words().to_owned(), *counts))
        .collect();
    rows.extend(
        why.facets
            .iter()
            .map(|(facet, counts)| pair(format!("by {facet} alone"), *counts)),
    );
    html += &table(&["elements", "as drawn", "best"], &rows);
    html += "<p>The effect of each change: the best layout with one parameter left as drawn, the costliest \
             first.</p>\n";
    let mut headings = vec!["left as drawn", "drawn", "best"];
    let names: Vec<String> = found.goals.iter().map(heading).collect();
    headings.extend(names.iter().map(String::as_str));
    headings.push("requirements");
    let rows: Vec<Vec<String>> = why
        .left_as_it_was
        .iter()
        .map(|left| {
            let mut row = vec![
                left.parameter.clone(),
                left.start.to_string(),
                left.best.to_string(),
            ];
            let goals = found.goals.iter().map(|g| left.goals.get(&g.name));
            row.extend(goals.map(|v| v.map_or_else(|| "–".to_owned(), |v| goal_value(*v))));
            row.push(if left.unmet.is_empty() {
                "kept".to_owned()
            } else {
                left.unmet.join("; ")
            });
            row
        })
        .collect();
    html + &table(&headings, &rows)
}

fn heading(goal: &Stated) -> String {
    let unit = goal.unit.map_or_else(String::new, |unit| format!(" ({unit})"));
    let direction = match goal.better {
        Better::Up => "more is better",
        Better::Down => "less is better",
    };
    format!("{}{unit}, {direction}", goal.name)
}

fn value(candidate: &LayoutCandidate, goal: &str) -> String {
    let value = candidate.goals.get(goal);
    value.map_or_else(|| "–".to_owned(), |v| goal_value(*v))
}

fn picture(found: &Optimum) -> Option<String> {
    let [first, second, ..] = found.goals.as_slice() else {
        return None;
    };
    let at = |c: &LayoutCandidate| Some((*c.goals.get(&first.name)?, *c.goals.get(&second.name)?));
    let mark = |(x, y): (f64, f64), color, hollow| Mark {
        x,
        y,
        half_bar: 0.0,
        color,
        hollow,
    };
    let tried = found
        .tried
        .iter()
        .filter_map(|goals| Some((*goals.first()?, *goals.get(1)?)));
    let mut marks: Vec<Mark> = tried.map(|place| mark(place, EVALUATED, false)).collect();
    let front: Vec<(f64, f64)> = found.front.iter().filter_map(at).collect();
    marks.extend(front.iter().map(|place| mark(*place, color(FRONT), false)));
    let ends = [(Some(&found.start), START), (found.best.as_ref(), BEST)];
    for (candidate, number) in ends {
        if let Some(place) = candidate.and_then(at) {
            marks.push(mark(place, color(number), false));
            marks.push(mark(place, color(number), true));
        }
    }
    if front.is_empty() {
        return None;
    }
    // Layouts far worse than the drawing would squeeze the front into a corner.
    let shown = || marks.iter().filter(|m| m.color != EVALUATED);
    let axes = Axes {
        x: reach(shown().map(|m| m.x)),
        y: reach(shown().map(|m| m.y)),
        x_label: heading(first),
        y_label: heading(second),
    };
    let inside = |m: &Mark| axes.x.contains(&m.x) && axes.y.contains(&m.y);
    marks.retain(inside);
    let line = Stroke {
        points: if found.goals.len() == 2 { front } else { Vec::new() },
        color: color(FRONT),
        width: 1,
        opacity: 0.6,
    };
    let title = format!("{} over {}", second.name, first.name);
    Some(figure::laws(SIZE, &axes, &title, &marks, &[line]))
}

/// The range from minimum to maximum, with a margin on either side.
fn reach(values: impl Iterator<Item = f64> + Clone) -> Range<f64> {
    let low = values.clone().fold(f64::INFINITY, f64::min);
    let high = values.fold(f64::NEG_INFINITY, f64::max);
    let room = if high > low {
        0.15 * (high - low)
    } else {
        0.1 * high.abs().max(1.0)
    };
    low - room..high + room
}
