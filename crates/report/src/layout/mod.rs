//! The page on mirror layouts, one or several side by side, and its pictures as files.

mod canvas;
mod depth;
mod drawn;
mod perspective;
mod picture;
mod sides;
mod tables;
mod views;

pub use drawn::Drawn;

use super::figure::{css, standalone};
use super::page::{escape, figure as block, legend, page, table};
use sides::SIDES;
use views::LOST;

/// Two layouts before and after: their structures in perspective side by side, and a table of what changed.
pub(super) fn before_and_after(layouts: &[Drawn; 2]) -> String {
    let (headings, rows) = tables::key_figures(layouts);
    let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
    chapter(layouts, structure) + &table(&headings, &rows)
}

/// Returns the page, as HTML.
pub fn layout(layouts: &[Drawn]) -> String {
    let names: Vec<&str> = layouts.iter().map(|l| l.analysis.name.as_str()).collect();
    let title = names.join(", ");
    let mut html = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"subtitle\">{}</p>\n</header>\n",
        escape(&title),
        if layouts.len() == 1 {
            "What this mirror layout sees, loses and allows"
        } else {
            "Mirror layouts side by side"
        }
    );
    for drawn in layouts {
        html += &format!("<p>{}</p>\n", escape(&tables::summary(&drawn.analysis)));
    }
    if let [one] = layouts {
        let picture = perspective::perspective(one).svg();
        html += &format!(
            "<div class=\"opening\">\n{picture}\n{}</div>\n",
            legend(&perspective::legend(one))
        );
    }
    html += "<h2>In numbers</h2>\n";
    let (headings, rows) = tables::key_figures(layouts);
    let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
    html += &table(&headings, &rows);
    let chapters: [(&str, OfLayout); 6] = [
        ("Where it looks", field),
        ("Ranges in its room", ranges),
        ("Elements of the scan", scan),
        ("The structure", structure),
        ("From three sides", three_sides),
        ("Footprints on the mirrors", mirrors),
    ];
    for (title, of) in chapters {
        html += &format!("<h2>{title}</h2>\n{}", chapter(layouts, of));
    }
    html += "<h2>Facet by facet</h2>\n<p>How far a point read at 4 m moves if the facet deviates from the drawing: for \
             a turn of 0.1° about the worst axis in its plane, and for a shift of 0.1 mm along its normal.</p>\n";
    for drawn in layouts {
        let (headings, rows) = tables::facets(drawn);
        html += &(name_of(layouts, drawn) + &table(headings, &rows));
    }
    html += "<footer>Field of regard: the share of all directions, 4π, that the cells of the elements cover, each \
             direction counted once. An element's cell extends half-way to its neighbors along the scan, and to the \
             1/e² contour of its own beam across it. Ranges are from the scanner, for face-on targets that fill the \
             beam, by Eq. (1) with both passes via the mirrors. Margins are from the 1/e² contour of a beam to an edge. \
             Sensor frame: x forward, y left, z up.</footer>\n";
    page(&format!("{title} – catoptric layout"), &html)
}

/// Returns the pictures as files, by name and content. With several layouts the names begin with the layout's number.
pub fn layout_pictures(layouts: &[Drawn]) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    for (number, drawn) in layouts.iter().enumerate() {
        let prefix = if layouts.len() == 1 {
            String::new()
        } else {
            format!("{}-", number + 1)
        };
        let mut add = |name: String, svg: &str| {
            files.push((format!("{prefix}{name}.svg"), standalone(svg).into_bytes()));
        };
        add("field".to_owned(), &views::map(drawn));
        add("depth".to_owned(), &depth::depth(drawn));
        add("scan".to_owned(), &views::scan(drawn));
        for side in &SIDES {
            add(side.name.to_owned(), &sides::side(drawn, side));
        }
        for (facet, view) in drawn.analysis.facets.iter().enumerate() {
            if let Some(svg) = views::footprints(drawn, facet) {
                add(
                    format!("footprints-{}-{}", facet + 1, file_name(&view.name)),
                    &svg,
                );
            }
        }
        let perspective = perspective::perspective(drawn);
        add("perspective".to_owned(), &perspective.svg());
        files.push((format!("{prefix}perspective.png"), perspective.png));
    }
    files
}

/// Returns a facet's name with characters that are safe in file names.
fn file_name(name: &str) -> String {
    let letter = |c: char| {
        if c.is_ascii_alphanumeric() || "-_".contains(c) {
            c
        } else {
            '_'
        }
    };
    name.chars().map(letter).collect()
}

/// The pictures of one layout, with caption, legend and table.
struct Chapter {
    pictures: String,
    caption: String,
    legend: Vec<(String, String)>,
    headings: &'static [&'static str],
    rows: Vec<Vec<String>>,
    /// Whether the pictures fill the page, so that several layouts are placed below one another.
    wide: bool,
}

/// A function that makes a chapter.
type OfLayout = fn(&Drawn) -> Chapter;

/// Returns a chapter on every layout: a figure for a single one, pictures side by side for several.
fn chapter(layouts: &[Drawn], of: OfLayout) -> String {
    let chapters: Vec<Chapter> = layouts.iter().map(of).collect();
    if layouts.len() == 1 || chapters.iter().any(|c| c.wide) {
        let one = |(drawn, c): (&Drawn, &Chapter)| {
            let figure = block(&c.pictures, &c.caption, &c.legend, c.headings, &c.rows);
            name_of(layouts, drawn) + &figure
        };
        return layouts.iter().zip(&chapters).map(one).collect();
    }
    let mut html = "<div class=\"views beside\">\n".to_owned();
    for (drawn, c) in layouts.iter().zip(&chapters) {
        let name = escape(&drawn.analysis.name);
        html += &format!("<div><h4>{name}</h4>{}{}</div>\n", c.pictures, legend(&c.legend));
    }
    html += "</div>\n";
    if let Some(first) = chapters.first() {
        html += &format!("<p>{}</p>\n", escape(&first.caption));
    }
    for (drawn, c) in layouts.iter().zip(&chapters) {
        html += &format!(
            "<details><summary>The numbers of {}</summary>\n{}</details>\n",
            escape(&drawn.analysis.name),
            table(c.headings, &c.rows)
        );
    }
    html
}

/// Returns the name of a layout as a heading, if there are several.
fn name_of(layouts: &[Drawn], drawn: &Drawn) -> String {
    if layouts.len() == 1 {
        String::new()
    } else {
        format!("<h3>{}</h3>\n", escape(&drawn.analysis.name))
    }
}

fn field(drawn: &Drawn) -> Chapter {
    let (headings, rows) = tables::directions(drawn);
    Chapter {
        pictures: views::map(drawn),
        caption: "Every direction around the scanner, forward in the center, unrolled like a map of the world. Each \
                  element is drawn as the cell of directions that it represents: gray where the scan passes by the \
                  mirrors, in the color of its facet where it is deflected. Directions without a color are not covered: gaps in \
                  the gray line are where mirrors are. Lost elements are drawn in the color of this text, where they \
                  would look without the structure. The gray line is thinnest where the long axis of the scanner's spot is along \
                  the scan."
            .to_owned(),
        legend: perspective::legend(drawn),
        headings,
        rows,
        wide: false,
    }
}

fn ranges(drawn: &Drawn) -> Chapter {
    let (headings, rows) = tables::ranges(drawn);
    Chapter {
        pictures: depth::depth(drawn),
        caption: "The scene's room without its boards, unrolled like the map above: in gray the distance of every \
                  surface from the scanner, darker where nearer, and in color the range of each element including the \
                  path via its mirror, without range errors."
            .to_owned(),
        legend: Vec::new(),
        headings,
        rows,
        wide: false,
    }
}

fn scan(drawn: &Drawn) -> Chapter {
    let mut legend = perspective::legend(drawn);
    legend.push((css(LOST), "lost".to_owned()));
    let (headings, rows) = tables::runs(drawn);
    Chapter {
        pictures: views::scan(drawn),
        caption: "The elements of the scan over azimuth: those with a direction of their own, those split by an edge, \
                  and those that end on the structure, are trapped between mirrors or are too faint."
            .to_owned(),
        legend,
        headings,
        rows,
        wide: false,
    }
}

fn structure(drawn: &Drawn) -> Chapter {
    let (headings, rows) = tables::sizes(drawn);
    Chapter {
        pictures: perspective::perspective(drawn).svg(),
        caption: format!(
            "Mirrors, posts and the scanner's housing, with every {}th beam in the color of the last facet it hits and \
             every {}th undeflected beam in gray, up to shortly after the mirrors. The back of a mirror is paler than \
             its face.",
            views::RAY_STEP,
            views::DIRECT_STEP
        ),
        legend: perspective::legend(drawn),
        headings,
        rows,
        wide: false,
    }
}

fn three_sides(drawn: &Drawn) -> Chapter {
    let side =
        |side: &sides::Side| format!("<div><h4>{}</h4>{}</div>\n", side.title, sides::side(drawn, side));
    let svgs: String = SIDES.iter().map(side).collect();
    let (headings, rows) = tables::places(drawn);
    Chapter {
        pictures: format!("<div class=\"views\">\n{svgs}</div>"),
        caption: "The same beams. Outlines are drawn whole, even where hidden: mirrors thick and in their colors, posts \
                  gray, the housing in the color of this text."
            .to_owned(),
        legend: perspective::legend(drawn),
        headings,
        rows,
        wide: true,
    }
}

fn mirrors(drawn: &Drawn) -> Chapter {
    let mut svgs = "<div class=\"views\">\n".to_owned();
    for (facet, view) in drawn.analysis.facets.iter().enumerate() {
        if let Some(svg) = views::footprints(drawn, facet) {
            svgs += &format!("<div><h4>{}</h4>{svg}</div>\n", escape(&view.name));
        }
    }
    svgs += "</div>";
    let (headings, rows) = tables::margins(drawn);
    Chapter {
        pictures: svgs,
        caption: "Each mirror seen from the front, its outline in the color of this text. An ellipse is the 1/e² contour of a beam; \
                  every second unsplit one and every lost one are drawn. An unsplit ellipse may move by its margin \
                  before an edge cuts it."
        .to_owned(),
        legend: vec![(css(LOST), "split at an edge, or otherwise lost".to_owned())],
        headings,
        rows,
        wide: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_design::layout::{Detail, analyze};
    use catoptric_sim::Scene;

    #[test]
    fn a_name_leads_into_no_other_folder() {
        for (name, file) in [
            ("left-1", "left-1"),
            ("../../etc/passwd", "______etc_passwd"),
            ("a\\b:c", "a_b_c"),
            ("..", "__"),
            ("ä\0", "__"),
        ] {
            assert_eq!(file_name(name), file);
        }
    }

    #[test]
    fn text_and_marks_have_contrast_in_light_and_dark() {
        let scene: Scene =
            toml::from_str(include_str!("../../../../scenes/prototype.toml")).expect("a scene");
        let analysis = analyze(&scene, None, Detail::Coarse).expect("it can be set up");
        let drawn = Drawn::new(&scene, &analysis).expect("it can be drawn");
        crate::contrast::tests::assert_contrast(&layout(std::slice::from_ref(&drawn)));
        let pair = [drawn.clone().named("one"), drawn.named("two")];
        let html = layout(&pair);
        assert!(
            html.contains(">Difference</th>")
                && html.contains("<h4>one</h4>")
                && html.contains("<h4>two</h4>")
        );
    }
}
