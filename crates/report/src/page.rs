//! Building blocks of an HTML page: escaping, tables, figures, numbers, the style sheet.

use super::contrast::style;
use catoptric_assess::tables::fixed;

/// Escapes text for HTML.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Formats a number with the given decimals and a true minus sign; NaN becomes a dash.
pub(super) fn number(value: f64, decimals: usize) -> String {
    if value.is_finite() {
        let text = fixed(value, decimals);
        text.strip_prefix('-')
            .map_or(text.clone(), |rest| format!("−{rest}"))
    } else if value.is_nan() {
        "–".to_owned()
    } else {
        "∞".to_owned()
    }
}

/// Formats a count; `None` becomes a dash.
pub(super) fn count(value: Option<usize>) -> String {
    value.map_or_else(|| "–".to_owned(), |c| c.to_string())
}

/// Number of letters beyond which a cell needs the width of a line of text.
const SENTENCE: usize = 24;

/// Returns a table; columns of text are aligned left, columns of numbers right.
pub(super) fn table(headings: &[&str], rows: &[Vec<String>]) -> String {
    // A number may have a unit, or "of" between two: words have three letters.
    let word = |text: &str| text.chars().filter(|c| c.is_alphabetic()).count() >= 3;
    let is_word = |cell: &String| cell.starts_with(char::is_alphabetic) || cell.split(' ').any(word);
    let class = |column: usize| {
        let cells = || rows.iter().filter_map(|row| row.get(column));
        match cells().any(is_word) {
            true if column > 0 && cells().any(|c| c.chars().count() > SENTENCE) => {
                " class=\"words sentences\""
            }
            true => " class=\"words\"",
            false => "",
        }
    };
    let mut html = "<div class=\"scroll\"><table>\n<thead><tr>".to_owned();
    for (column, heading) in headings.iter().enumerate() {
        html += &format!("<th scope=\"col\"{}>{}</th>", class(column), escape(heading));
    }
    html += "</tr></thead>\n<tbody>\n";
    for row in rows {
        html += "<tr>";
        for (i, cell) in row.iter().enumerate() {
            let cell = escape(cell);
            html += &if i == 0 {
                format!("<th scope=\"row\"{}>{cell}</th>", class(0))
            } else {
                format!("<td{}>{cell}</td>", class(i))
            };
        }
        html += "</tr>\n";
    }
    html + "</tbody></table></div>\n"
}

/// Number of rows beyond which a table is collapsed.
const LONG_TABLE: usize = 12;

/// Returns a legend of colors and names; empty without entries.
pub(super) fn legend(entries: &[(String, String)]) -> String {
    if entries.is_empty() {
        return String::new();
    }
    let entry = |(color, name): &(String, String)| {
        format!(
            "<span><i style=\"background:{color}\"></i>{}</span> ",
            escape(name)
        )
    };
    format!(
        "<p class=\"legend\">{}</p>\n",
        entries.iter().map(entry).collect::<String>()
    )
}

/// Returns plots with their caption, legend and table of numbers.
pub(super) fn figure(
    plots: &str,
    caption: &str,
    legend: &[(String, String)],
    headings: &[&str],
    rows: &[Vec<String>],
) -> String {
    let mut html = format!("<figure>\n{plots}\n{}", self::legend(legend));
    html += &format!("<figcaption>{}</figcaption>\n", escape(caption));
    let table = table(headings, rows);
    if rows.len() > LONG_TABLE {
        html += &format!(
            "<details><summary>The numbers ({} rows)</summary>\n{table}</details>\n",
            rows.len()
        );
    } else {
        html += &table;
    }
    html + "</figure>\n"
}

/// Returns the whole page around its content.
pub(super) fn page(title: &str, content: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"generator\" content=\"catoptric\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n\
         <style>\n{STYLE}{}</style>\n</head>\n<body>\n<main>\n{content}</main>\n</body>\n</html>\n",
        escape(title),
        style()
    )
}

const STYLE: &str = include_str!("style.css");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_and_signed() {
        assert_eq!(number(-1.2345, 2), "−1.23");
        assert_eq!(number(-0.001, 2), "0.00");
        assert_eq!(number(f64::NAN, 2), "–");
        assert_eq!(number(f64::INFINITY, 2), "∞");
    }

    #[test]
    fn text_cannot_become_markup() {
        let html = table(&["<a>"], &[vec!["x & \"y\"".to_owned()]]);
        assert!(html.contains("&lt;a&gt;") && html.contains("x &amp; &quot;y&quot;"));
    }

    #[test]
    fn long_tables_are_collapsed() {
        let rows = |n: usize| vec![vec!["1".to_owned()]; n];
        assert!(!figure("", "", &[], &["a"], &rows(LONG_TABLE)).contains("<details>"));
        assert!(figure("", "", &[], &["a"], &rows(LONG_TABLE + 1)).contains("<details>"));
    }
}
