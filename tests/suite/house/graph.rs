//! Directed graphs of dependencies between files, folders or rooms, and cycles in them.

use std::collections::{BTreeMap, BTreeSet};

/// Edges, each with the names that one takes from the other.
#[derive(Debug, Default)]
pub(super) struct Graph(BTreeMap<String, BTreeMap<String, BTreeSet<String>>>);

/// An edge: importer, imported, names.
pub(super) type Edge<'a> = (&'a str, &'a str, &'a BTreeSet<String>);

impl Graph {
    pub(super) fn add(&mut self, from: &str, onto: &str, name: &str) {
        let edges = self.0.entry(from.to_owned()).or_default();
        edges.entry(onto.to_owned()).or_default().insert(name.to_owned());
    }

    pub(super) fn edges(&self) -> impl Iterator<Item = Edge<'_>> {
        self.0.iter().flat_map(|(from, edges)| {
            edges
                .iter()
                .map(move |(onto, names)| (from.as_str(), onto.as_str(), names))
        })
    }

    /// Returns the edges of a cycle, if there is one.
    pub(super) fn cycle(&self) -> Option<Vec<Edge<'_>>> {
        // Nodes without outgoing edges are on no cycle; remove them repeatedly.
        let mut left: BTreeSet<&str> = self.0.keys().map(String::as_str).collect();
        let onwards = |from: &str, left: &BTreeSet<&str>| {
            let mut edges = self.0[from].iter();
            edges.find(|(onto, _)| left.contains(onto.as_str()))
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
        let mut way: Vec<Edge<'_>> = Vec::new();
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
fn cycles_are_found_whatever_depends_on_them() {
    let graph = |edges: &[(&str, &str)]| {
        let mut graph = Graph::default();
        for (from, onto) in edges {
            graph.add(from, onto, "Name");
        }
        graph
    };
    assert_eq!(graph(&[]).cycle(), None);
    assert_eq!(
        graph(&[("a", "b"), ("b", "c"), ("a", "c"), ("d", "a")]).cycle(),
        None
    );
    let tied = graph(&[("a", "b"), ("b", "c"), ("c", "d"), ("d", "b"), ("d", "e")]);
    let cycle = tied.cycle().unwrap();
    let files: Vec<&str> = cycle.iter().map(|(from, ..)| *from).collect();
    assert_eq!(files, ["b", "c", "d"]);
    assert_eq!(cycle[2].1, "b");
    assert!(graph(&[("a", "a")]).cycle().is_some());
}
