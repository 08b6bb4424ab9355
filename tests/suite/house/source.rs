//! Modules, what they import, and which file defines a name.

use super::graph::Graph;
use super::tokens::tokens;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A path of names; if absolute, the first one is a crate.
type Names = Vec<String>;

/// A module: a file, or part of one.
#[derive(Debug, Default)]
struct Module {
    file: String,
    imports: Vec<Import>,
    /// Paths in its code, as written.
    paths: Vec<Names>,
    /// First words of paths in its code, except imports.
    words: BTreeSet<String>,
}

/// A name that a module imports.
#[derive(Debug, Clone)]
struct Import {
    path: Names,
    alias: String,
    /// Whether the name is re-exported.
    public: bool,
}

/// The modules of some crates.
#[derive(Debug, Default)]
pub(super) struct Sources(BTreeMap<Names, Module>);

impl Sources {
    /// Reads a crate, starting from its root file.
    pub(super) fn add_crate(&mut self, name: &str, file: &Path) {
        self.add_file(vec![name.to_owned()], file);
    }

    fn add_file(&mut self, name: Names, file: &Path) {
        let text = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let parent = file.parent().expect("a file is in a folder");
        let stem = file
            .file_stem()
            .and_then(|s| s.to_str())
            .expect("a name of letters");
        let folder = match stem {
            "lib" | "main" | "mod" => parent.to_owned(),
            _ => parent.join(stem),
        };
        for child in self.add_text(&name, file.to_str().expect("a path of letters"), &text) {
            let beside = folder.join(format!("{child}.rs"));
            let inside = folder.join(&child).join("mod.rs");
            let mut name = name.clone();
            name.push(child);
            self.add_file(name, if beside.exists() { &beside } else { &inside });
        }
    }

    /// Reads a module and those inside its file; returns the children that have their own files.
    fn add_text(&mut self, name: &Names, file: &str, text: &str) -> Vec<String> {
        let all = tokens(text);
        let mut children = Vec::new();
        // The modules enclosing the current position, with the brace depth at which each ends.
        let mut open = vec![(name.clone(), 0)];
        let (mut at, mut depth) = (0, 0);
        let mut public = false;
        self.module(name, file);
        while at < all.len() {
            let (inner, ends) = open.last().expect("the file's own is never closed").clone();
            match all[at].as_str() {
                "mod" if all[at + 2] == ";" => {
                    children.push(all[at + 1].clone());
                    at += 2;
                }
                "mod" if all[at + 2] == "{" => {
                    let mut name = inner;
                    name.push(all[at + 1].clone());
                    self.module(&name, file);
                    open.push((name, depth));
                    depth += 1;
                    at += 2;
                }
                // Not the captures of an `impl`.
                "use" if all[at + 1] != "<" => {
                    let length = all[at..].iter().position(|t| t == ";").expect("it ends");
                    let tree = &all[at + 1..at + length];
                    expand(tree, &[], public, &mut self.module(&inner, file).imports);
                    at += length;
                }
                "{" => depth += 1,
                "}" => {
                    depth -= 1;
                    if open.len() > 1 && depth == ends {
                        open.pop();
                    }
                }
                word if is_name(word) => {
                    let mut path = vec![word.to_owned()];
                    while all.get(at + 1).is_some_and(|t| t == "::")
                        && all.get(at + 2).is_some_and(|t| is_name(t))
                    {
                        path.push(all[at + 2].clone());
                        at += 2;
                    }
                    let module = self.module(&inner, file);
                    module.words.insert(path[0].clone());
                    module.paths.push(path);
                }
                _ => {}
            }
            public = match all[at].as_str() {
                "pub" => true,
                // For pub(crate) and the like.
                "(" | ")" | "crate" | "super" | "in" | "self" => public,
                _ => false,
            };
            at += 1;
        }
        children
    }

    fn module(&mut self, name: &Names, file: &str) -> &mut Module {
        let module = self.0.entry(name.clone()).or_default();
        file.clone_into(&mut module.file);
        module
    }

    /// A path as written in a module, made absolute; `None` if it begins with an external name.
    fn absolute(&self, module: &[String], path: &[String]) -> Option<Names> {
        let from = |base: &[String], rest: &[String]| Some([base, rest].concat());
        match path[0].as_str() {
            "crate" => from(&module[..1], &path[1..]),
            "self" => from(module, &path[1..]),
            "super" => {
                let up = path.iter().take_while(|name| *name == "super").count();
                from(module.get(..module.len() - up)?, &path[up..])
            }
            first => {
                let child = from(module, &path[..1])?;
                if self.0.contains_key(&child) {
                    from(module, path)
                } else {
                    self.0
                        .contains_key([first.to_owned()].as_slice())
                        .then(|| path.to_owned())
                }
            }
        }
    }

    /// The file that defines the target of an absolute path, and the name there; `None` for a module itself.
    fn definition(&self, path: &[String], steps: usize) -> Option<(&str, String)> {
        let mut deepest = (1..=path.len())
            .rev()
            .find(|n| self.0.contains_key(&path[..*n]))?;
        if deepest == path.len() {
            // A module itself, unless its parent re-exports a function of its name.
            deepest -= 1;
            let parent = self.0.get(&path[..deepest])?;
            parent
                .imports
                .iter()
                .find(|import| import.alias == path[deepest])?;
        }
        let module = &self.0[&path[..deepest]];
        let name = &path[deepest];
        // A re-exported name is defined where it comes from.
        let handed = module.imports.iter().find(|import| import.alias == *name);
        if let Some(import) = handed
            && steps > 0
            && let Some(mut origin) = self.absolute(&path[..deepest], &import.path)
        {
            origin.extend_from_slice(&path[deepest + 1..]);
            return self.definition(&origin, steps - 1);
        }
        Some((&module.file, name.clone()))
    }

    /// Returns which file takes what from which.
    pub(super) fn graph(&self) -> Graph {
        /// More than the longest chain of re-exports.
        const STEPS: usize = 8;
        let mut graph = Graph::default();
        for (name, module) in &self.0 {
            let mut add = |path: &Names| {
                if let Some((file, name)) = self.definition(path, STEPS)
                    && file != module.file
                {
                    graph.add(&module.file, file, &name);
                }
            };
            for import in &module.imports {
                let used = !import.public || module.words.contains(&import.alias);
                if used && let Some(path) = self.absolute(name, &import.path) {
                    add(&path);
                }
            }
            for path in module.paths.iter().filter(|path| path.len() > 1) {
                let imported = module.imports.iter().find(|import| import.alias == path[0]);
                let whole = match imported {
                    Some(import) => [&import.path[..], &path[1..]].concat(),
                    None => path.clone(),
                };
                if let Some(path) = self.absolute(name, &whole) {
                    add(&path);
                }
            }
        }
        graph
    }
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Collects the names that a tree of imports brings in.
fn expand(tree: &[String], before: &[String], public: bool, imports: &mut Vec<Import>) {
    let mut path = before.to_vec();
    let mut at = 0;
    while at < tree.len() {
        match tree[at].as_str() {
            "::" => at += 1,
            "{" => {
                let (mut depth, mut from) = (0, at + 1);
                for (to, token) in tree.iter().enumerate().skip(at) {
                    match token.as_str() {
                        "{" => depth += 1,
                        "}" => depth -= 1,
                        _ => {}
                    }
                    if (depth == 1 && token == ",") || depth == 0 {
                        if from < to {
                            expand(&tree[from..to], &path, public, imports);
                        }
                        from = to + 1;
                    }
                }
                return;
            }
            "as" => {
                let alias = tree[at + 1].clone();
                imports.push(Import { path, alias, public });
                return;
            }
            // A module itself, among names of it.
            "self" if !path.is_empty() => at += 1,
            name => {
                path.push(name.to_owned());
                at += 1;
            }
        }
    }
    let alias = path.last().expect("it names something").clone();
    imports.push(Import { path, alias, public });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The edges of a crate `house` whose files have these texts.
    fn edges(files: &[(&str, &str)]) -> Vec<String> {
        let mut sources = Sources::default();
        for (name, text) in files {
            let module: Names = std::iter::once("house")
                .chain(name.split("::"))
                .map(str::to_owned)
                .collect();
            let module = if name.is_empty() {
                vec!["house".to_owned()]
            } else {
                module
            };
            sources.add_text(&module, if name.is_empty() { "lib" } else { name }, text);
        }
        let graph = sources.graph();
        let told = graph.edges().map(|(from, onto, names)| {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            format!("{from} > {onto}: {}", names.join(" "))
        });
        told.collect()
    }

    #[test]
    fn imports_and_paths_are_edges() {
        let found = edges(&[
            ("", "mod a; mod b; mod c;"),
            (
                "a",
                "use super::b::{Board, self, inner::Deep as Other}; fn f() { crate::c::run(); b::walk() }",
            ),
            (
                "b",
                "pub struct Board; pub mod inner { pub struct Deep; use super::Board; }",
            ),
            (
                "c",
                "use std::fmt; pub(crate) fn run() -> impl Sized + use<> { crate::a::f() }",
            ),
        ]);
        assert_eq!(found, ["a > b: Board Deep walk", "a > c: run", "c > a: f"]);
    }

    #[test]
    fn a_name_counts_for_the_file_that_defines_it() {
        let found = edges(&[
            ("", "mod parent; pub use parent::Child;"),
            (
                "parent",
                "mod child; mod other; pub use child::Child; pub use other::Used; fn f(_: Used) {}",
            ),
            ("parent::child", "use super::Used; use crate::Child as Own;"),
            ("parent::other", "pub struct Used;"),
        ]);
        // Re-exporting a name is not a dependency; using it is.
        assert_eq!(
            found,
            [
                "parent > parent::other: Used",
                "parent::child > parent::other: Used"
            ]
        );
    }

    #[test]
    fn a_function_may_have_the_name_of_its_module() {
        let found = edges(&[
            ("", "mod a; mod b; pub use b::b;"),
            ("a", "use crate::b; fn f() { crate::b(); }"),
            ("b", "pub fn b() {}"),
        ]);
        assert_eq!(found, ["a > b: b"]);
    }

    #[test]
    fn a_parent_and_its_child_can_form_a_cycle() {
        let mut sources = Sources::default();
        let name = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Names>();
        sources.add_text(
            &name(&["house"]),
            "lib",
            "mod child; use child::Child; pub struct Shared;",
        );
        sources.add_text(
            &name(&["house", "child"]),
            "child",
            "use super::Shared; pub struct Child;",
        );
        assert_eq!(sources.graph().cycle().expect("they import each other").len(), 2);
    }
}
