//! Tests of the whole page: its tags nest, its plots have tables, and its verdict agrees with the scores.

use super::*;
use catoptric_assess::apply::Lift;
use catoptric_assess::score::score;
use catoptric_fixtures::{noisy, sample, turned};
use catoptric_model::CloudFrame;

fn html(with_truth: bool) -> String {
    let s = sample();
    let truth = with_truth.then_some(&s.truth);
    let first = turned(noisy(&s.truth, 1e-3, 1), 2e-3);
    let second = noisy(&s.truth, 3e-3, 2);
    let lift = Lift::new(&s.dataset, &first, None, CloudFrame::Room).expect("there is a room");
    let cloud = CloudSketch::of(&lift, MAX_POINTS).expect("in memory");
    drop(lift);
    let results = [first, second].map(|c| {
        let score = score(&s.dataset, &c, truth).expect("in memory");
        (c, score)
    });
    report(&s.dataset, truth, &results, Some(&cloud))
}

/// Checks that tags nest; void elements of HTML and self-closing ones of SVG open nothing.
fn check_nesting(html: &str) {
    let mut open = Vec::new();
    let body = html.replace("<!DOCTYPE html>", "");
    for tag in body.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').expect("every tag ends");
        let name = tag
            .trim_start_matches('/')
            .split([' ', '\n'])
            .next()
            .unwrap_or("");
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "in <{tag}>");
        } else if !tag.ends_with('/') && !["meta", "br"].contains(&name) {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn every_plot_has_a_table_and_nothing_is_fetched() {
    for with_truth in [true, false] {
        let html = html(with_truth);
        assert!(!html.contains("http") && !html.contains("<script") && !html.contains("url("));
        let figures: Vec<&str> = html.split("<figure>").skip(1).collect();
        // Fans; errors or estimates, residuals and statuses of two methods; the cloud.
        assert_eq!(figures.len(), 8);
        for figure in figures {
            let (figure, _) = figure.split_once("</figure>").expect("it ends");
            assert!(
                figure.contains("<svg") && figure.contains("<tbody>\n<tr>"),
                "{figure}"
            );
        }
        check_nesting(&html);
        assert!(!html.contains("could not be drawn") && !html.contains("NaN"));
    }
}

#[test]
fn the_verdict_is_written_out() {
    let with = html(true);
    assert!(with.contains("PASS") && with.contains("The common mode dominates"));
    let blind = html(false);
    assert!(blind.contains("BLIND") && blind.contains("there is no truth"));
    assert!(!blind.contains("cos φ·δθ (°)"));
}

#[test]
fn text_and_marks_have_contrast_in_light_and_dark() {
    for with_truth in [true, false] {
        crate::contrast::tests::assert_contrast(&html(with_truth));
    }
}

#[test]
fn a_report_begins_with_all_methods_and_ends_with_what_to_do() {
    for with_truth in [true, false] {
        let html = html(with_truth);
        let place = |text: &str| html.find(text).unwrap_or_else(|| panic!("no {text}"));
        let opening = &html[..place("<h2>The verdicts</h2>")];
        assert_eq!(
            (
                opening.matches("<table>").count(),
                opening.matches("<svg").count()
            ),
            (1, 1)
        );
        assert_eq!(
            opening.matches("class=\"badge\"").count(),
            2,
            "one row for each method"
        );
        assert!(place("What to do next") > place("The room as seen through the mirrors"));
        assert!(!opening.contains("Missed") || with_truth);
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    assert_eq!(html(true), html(true));
}

#[test]
fn a_report_without_calibrations_is_a_page() {
    let s = sample();
    check_nesting(&report(&s.dataset, None, &[], None));
}
