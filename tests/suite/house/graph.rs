//! Arrows between files, folders or rooms, and circles of them.

use std::collections::{BTreeMap, BTreeSet};

/// Arrows, each with the names that the one takes from the other.
#[derive(Debug, Default)]
pub(super) struct Graph(BTreeMap<String, BTreeMap<String, BTreeSet<String>>>);

/// An arrow: who takes, from whom, what.
pub(super) type Arrow<'a> = (&'a str, &'a str, &'a BTreeSet<String>);

impl Graph {
    pub(super) fn add(&mut self, from: &str, onto: &str, name: &str) {
        let arrows = self.0.entry(from.to_owned()).or_default();
        arrows.entry(onto.to_owned()).or_default().insert(name.to_owned());
    }

    pub(super) fn arrows(&self) -> impl Iterator<Item = Arrow<'_>> {
        self.0.iter().flat_map(|(from, arrows)| {
            arrows
                .iter()
                .map(move |(onto, names)| (from.as_str(), onto.as_str(), names))
        })
    }

    /// The arrows of a circle, if there is one.
    pub(super) fn circle(&self) -> Option<Vec<Arrow<'_>>> {
        // What leads nowhere is on no circle, and then what leads only there.
        let mut left: BTreeSet<&str> = self.0.keys().map(String::as_str).collect();
        let onwards = |from: &str, left: &BTreeSet<&str>| {
            let mut arrows = self.0[from].iter();
            arrows.find(|(onto, _)| left.contains(onto.as_str()))
        };
        loop {
            let ends: Vec<&str> = left
                .iter()
                .copied()
                .filter(|f| onwards(f, &left).is_none())
                .collect();
            if ends.is_empty() {
                break;
            }
            left.retain(|file| !ends.contains(file));
        }
        let mut way: Vec<Arrow<'_>> = Vec::new();
        let mut at = *left.first()?;
        loop {
            if let Some(first) = way.iter().position(|(from, ..)| *from == at) {
                return Some(way.split_off(first));
            }
            let (onto, names) = onwards(at, &left)?;
            way.push((at, onto, names));
            at = onto;
        }
    }
}

#[test]
fn circles_are_found_whatever_hangs_on_them() {
    let graph = |arrows: &[(&str, &str)]| {
        let mut graph = Graph::default();
        for (from, onto) in arrows {
            graph.add(from, onto, "Name");
        }
        graph
    };
    assert_eq!(graph(&[]).circle(), None);
    assert_eq!(
        graph(&[("a", "b"), ("b", "c"), ("a", "c"), ("d", "a")]).circle(),
        None
    );
    let tied = graph(&[("a", "b"), ("b", "c"), ("c", "d"), ("d", "b"), ("d", "e")]);
    let circle = tied.circle().unwrap();
    let files: Vec<&str> = circle.iter().map(|(from, ..)| *from).collect();
    assert_eq!(files, ["b", "c", "d"]);
    assert_eq!(circle[2].1, "b");
    assert!(graph(&[("a", "a")]).circle().is_some());
}
