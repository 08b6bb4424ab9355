//! Checks of mishaps: each is exactly one thing that can happen. Whether its pose is recorded with a board is checked
//! by the setup.

use crate::build::board::board_markers;
use crate::findings::{Findings, suggestion};
use crate::scene::{Mishap, Scene};
use catoptric_model::place::Path;

pub(super) fn check(scene: &Scene, found: &mut Findings) {
    let mishaps = &scene.experiment.mishap;
    let mut known: Vec<String> = scene
        .board
        .iter()
        .flat_map(|b| board_markers(b).into_iter().map(|m| m.name))
        .collect();
    known.sort();
    known.dedup();
    for (i, mishap) in mishaps.iter().enumerate() {
        let path = Path::of("experiment").key("mishap").index(i);
        if mishaps[..i].iter().any(|m| m.pose == mishap.pose) {
            found.add(
                &path.key("pose"),
                format_args!("is {}, as in an earlier mishap", mishap.pose),
                "a pose has at most one mishap".to_owned(),
            );
        }
        check_kind(mishap, &path, found);
        let swapped = mishap.swapped_markers.iter().flatten();
        let swapped = swapped.map(|name| (path.key("swapped_markers"), name));
        let astray = mishap.mislabelled.iter();
        let astray = astray.map(|m| (path.key("mislabelled").key("marker"), &m.marker));
        for (path, name) in swapped.chain(astray) {
            if !known.contains(name) {
                let names = known.iter().map(String::as_str);
                let help = suggestion(name, "board with markers", names);
                found.add(&path, format_args!("names {name:?}, which no board has"), help);
            }
        }
        if let Some([a, b]) = &mishap.swapped_markers
            && a == b
        {
            let what = format_args!("names {a:?} twice");
            found.add(&path.key("swapped_markers"), what, "name two markers".to_owned());
        }
    }
}

/// Checks that a mishap is exactly one of an exchange, a wrong label or a movement.
fn check_kind(mishap: &Mishap, path: &Path, found: &mut Findings) {
    let kinds = [
        mishap.swapped_markers.is_some(),
        mishap.mislabelled.is_some(),
        mishap.moves(),
    ];
    let count = kinds.iter().filter(|k| **k).count();
    if count != 1 {
        found.add(
            path,
            format_args!("describes {count} things that happen; a mishap is exactly one"),
            "set `swapped_markers`, or `mislabelled`, or `moved_mm` and `moved_deg`".to_owned(),
        );
    }
    let still = |by: Option<[f64; 3]>| by.is_none_or(|by| by == [0.0; 3]);
    if mishap.moves() && still(mishap.moved_mm) && still(mishap.moved_deg) {
        found.add(path, "moves the board by zero", "set how far it moves".to_owned());
    }
}
