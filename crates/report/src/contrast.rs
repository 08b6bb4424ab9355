//! Colors that can be seen: the style sheet's rules that darken the colors of plots on a light page and lighten them on a
//! dark one, as far as marks (3 : 1) and text (4.5 : 1) need (WCAG 2.1, 1.4.11 and 1.4.3).

use catoptric_assess::palette::facet_color;
use plotters::style::RGBColor;

/// Least contrast of marks and of text against the page.
const MARKS: f64 = 3.0;
const TEXT: f64 = 4.5;

/// The page, light and dark: `--paper` of the style sheet.
const PAPER: [RGBColor; 2] = [RGBColor(0xFF, 0xFF, 0xFF), RGBColor(0x15, 0x18, 0x1B)];

/// Other colors of plots than those of facets: statuses without a mirror, undeflected beams, points.
const OTHERS: [RGBColor; 3] = [
    RGBColor(0x8C, 0x8C, 0x8C),
    RGBColor(0x5E, 0x5E, 0x5E),
    RGBColor(0x7A, 0x80, 0x87),
];

/// Number of facet colors before they repeat.
const FACETS: usize = 8;

/// The rules for all colors of plots: for a light page, and for a dark one.
pub(super) fn style() -> String {
    let rules = |paper| -> String { colors().into_iter().map(|c| rules(c, paper)).collect() };
    format!(
        "{}@media (prefers-color-scheme: dark) {{\n{}}}\n",
        rules(PAPER[0]),
        rules(PAPER[1])
    )
}

fn colors() -> Vec<RGBColor> {
    let facets = (0..FACETS)
        .map(facet_color)
        .map(|[red, green, blue]| RGBColor(red, green, blue));
    facets.chain(OTHERS).collect()
}

/// A color as plots write it.
fn css(color: RGBColor) -> String {
    format!("#{:02X}{:02X}{:02X}", color.0, color.1, color.2)
}

fn rules(drawn: RGBColor, paper: RGBColor) -> String {
    let name = css(drawn);
    let mark = css(readable(drawn, paper, MARKS));
    let text = css(readable(drawn, paper, TEXT));
    format!(
        "svg [fill=\"{name}\"] {{ fill: {mark}; }}\nsvg [stroke=\"{name}\"] {{ stroke: {mark}; }}\n\
         svg text[fill=\"{name}\"] {{ fill: {text}; }}\n\
         .legend i[style=\"background:{name}\"] {{ background: {mark} !important; }}\n"
    )
}

/// The color nearest to one that has a contrast, on its way to black on a light page and to white on a dark one.
fn readable(drawn: RGBColor, paper: RGBColor, least: f64) -> RGBColor {
    let end = if luminance(paper) > 0.5 { 0.0 } else { 255.0 };
    let mixed = |share: f64| {
        // Between two bytes.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let channel = |c: u8| (f64::from(c) + share * (end - f64::from(c))).round() as u8;
        RGBColor(channel(drawn.0), channel(drawn.1), channel(drawn.2))
    };
    let steps = (0..=100).map(|percent| mixed(0.01 * f64::from(percent)));
    let mut steps = steps.filter(|c| contrast(*c, paper) >= least);
    steps.next().unwrap_or(mixed(1.0))
}

/// Contrast of two colors, from 1 to 21.
fn contrast(a: RGBColor, b: RGBColor) -> f64 {
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

/// Relative luminance of an sRGB color.
fn luminance(RGBColor(red, green, blue): RGBColor) -> f64 {
    let linear = |channel: u8| {
        let c = f64::from(channel) / 255.0;
        if c <= 0.04045 {
            c / 12.92
        } else {
            libm::pow((c + 0.055) / 1.055, 2.4)
        }
    };
    0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Colors of a page's style sheet on light paper and on dark: variables, and what plots are mapped to.
    struct Sheet {
        variables: BTreeMap<String, RGBColor>,
        /// Color by selector, such as `svg [fill="#000000"]`.
        mapped: BTreeMap<String, RGBColor>,
    }

    fn parsed(hex: &str) -> Option<RGBColor> {
        let digits = hex.trim().strip_prefix('#')?.get(..6)?;
        let byte = |at: usize| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok();
        Some(RGBColor(byte(0)?, byte(2)?, byte(4)?))
    }

    /// Reads a page's rules in order, those for dark pages only if they hold.
    fn sheet(html: &str, dark: bool) -> Sheet {
        let (_, style) = html.split_once("<style>").expect("a style");
        let (style, _) = style.split_once("</style>").expect("it ends");
        let mut found = Sheet {
            variables: BTreeMap::new(),
            mapped: BTreeMap::new(),
        };
        let mut inside = Vec::new();
        let mut words = String::new();
        for c in style.chars() {
            match c {
                '{' => {
                    // After a comment, if there is one.
                    inside.push(words.trim().lines().last().unwrap_or_default().to_owned());
                    words.clear();
                }
                '}' | ';' => {
                    let holds = inside.iter().all(|at| {
                        !at.starts_with("@media") || (dark && at.contains("prefers-color-scheme: dark"))
                    });
                    if holds
                        && let (Some(selector), Some((key, value))) = (inside.last(), words.split_once(':'))
                    {
                        let variable = value
                            .trim()
                            .strip_prefix("var(")
                            .and_then(|v| v.split(')').next());
                        let color = match variable {
                            Some(name) => found.variables.get(name).copied(),
                            None => parsed(value),
                        };
                        if let Some(color) = color {
                            let key = key.trim();
                            if key.starts_with("--") {
                                found.variables.insert(key.to_owned(), color);
                            }
                            found.mapped.insert(selector.to_owned(), color);
                        }
                    }
                    words.clear();
                    if c == '}' {
                        inside.pop();
                    }
                }
                c => words.push(c),
            }
        }
        found
    }

    /// Colors behind the data, which say nothing on their own: the grid, and frames.
    const BEHIND: [&str; 2] = ["#C8C8C8", "#FFFFFF"];

    /// Asserts that text and marks of a page have contrast, light and dark. Pictures that are shaded are left out.
    pub(crate) fn assert_contrast(html: &str) {
        for dark in [false, true] {
            let sheet = sheet(html, dark);
            let paper = sheet.variables["--paper"];
            assert_eq!(paper, PAPER[usize::from(dark)], "the style sheet's paper");
            for (name, least) in [
                ("--ink", TEXT),
                ("--quiet", TEXT),
                ("--pass", TEXT),
                ("--fail", TEXT),
                ("--blind", TEXT),
                ("--edge", MARKS),
            ] {
                let found = contrast(sheet.variables[name], paper);
                assert!(found >= least, "{name}: {found:.2}, dark: {dark}");
            }
            let mut checked = 0;
            for svg in html
                .split("<svg")
                .skip(1)
                .map(|s| s.split("</svg>").next().unwrap_or(""))
            {
                if svg.contains("<image") {
                    continue;
                }
                for tag in svg.split('<').skip(1) {
                    for (kind, rest) in ["fill", "stroke"]
                        .iter()
                        .filter_map(|kind| Some((*kind, tag.split_once(&format!(" {kind}=\"#"))?.1)))
                    {
                        let name = format!("#{}", &rest[..6]);
                        if BEHIND.contains(&name.as_str()) {
                            continue;
                        }
                        let is_text = tag.starts_with("text");
                        let of_text = format!("svg text[{kind}=\"{name}\"]");
                        let of_all = format!("svg [{kind}=\"{name}\"]");
                        let mapped = sheet
                            .mapped
                            .get(&of_text)
                            .filter(|_| is_text)
                            .or(sheet.mapped.get(&of_all));
                        let shown = mapped.copied().or(parsed(&name)).expect("a color");
                        let least = if is_text { TEXT } else { MARKS };
                        let found = contrast(shown, paper);
                        assert!(found >= least, "{tag}: {found:.2}, dark: {dark}");
                        checked += 1;
                    }
                    // Black is the color of text without one, unless the style sheet gives it ink.
                    if tag.starts_with("text") && !tag.contains(" fill=") {
                        assert!(sheet.mapped.contains_key("svg text:not([fill])"), "{tag}");
                    }
                }
            }
            for legend in html.split("<i style=\"background:").skip(1) {
                let name = &legend[..7];
                let rule = format!(".legend i[style=\"background:{name}\"]");
                let shown = sheet
                    .mapped
                    .get(&rule)
                    .copied()
                    .or(parsed(name))
                    .expect("a color");
                assert!(
                    BEHIND.contains(&name) || contrast(shown, paper) >= MARKS,
                    "legend {name}, dark: {dark}"
                );
            }
            assert!(checked > 20, "{checked}");
        }
    }

    #[test]
    fn contrasts_are_those_of_the_standard() {
        let (black, white) = (RGBColor(0, 0, 0), RGBColor(255, 255, 255));
        assert!((contrast(black, white) - 21.0).abs() < 1e-12);
        // The gray that WCAG's authors give as the lightest for text on white.
        assert!((contrast(RGBColor(0x76, 0x76, 0x76), white) - 4.54).abs() < 0.005);
    }

    #[test]
    fn colors_stay_apart_when_they_are_made_readable() {
        for paper in PAPER {
            for least in [MARKS, TEXT] {
                let shown: Vec<RGBColor> = colors()
                    .into_iter()
                    .take(FACETS)
                    .map(|c| readable(c, paper, least))
                    .collect();
                for (i, a) in shown.iter().enumerate() {
                    assert!(contrast(*a, paper) >= least);
                    for b in &shown[..i] {
                        let apart =
                            [(a.0, b.0), (a.1, b.1), (a.2, b.2)].map(|(x, y)| f64::from(x.abs_diff(y)));
                        assert!(apart.iter().sum::<f64>() >= 20.0, "{a:?} and {b:?} on {paper:?}");
                    }
                }
            }
        }
    }
}
