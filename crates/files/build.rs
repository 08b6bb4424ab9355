//! Passes the commit it is built from to the library, for the manifest of every dataset it writes.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=CATOPTRIC_GIT_HASH={}", commit());
}

/// The commit checked out, or "unknown" outside a checkout of this package.
fn commit() -> String {
    let root = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    // A package unpacked inside another repository must not report that repository's commit.
    let own = git(&["rev-parse", "--show-toplevel"]).is_some_and(|top| {
        Path::new(&top).join("crates/files").canonicalize().ok() == Path::new(&root).canonicalize().ok()
    });
    if !own {
        return "unknown".to_owned();
    }
    // HEAD changes with the branch, its log with every commit. Git locates them, because .git is a file in a worktree.
    for name in ["HEAD", "logs/HEAD"] {
        if let Some(path) = git(&["rev-parse", "--git-path", name]).filter(|p| Path::new(p).exists()) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    git(&["rev-parse", "HEAD"]).unwrap_or_else(|| "unknown".to_owned())
}

/// The output of git, or `None` if git is missing or fails.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (output.status.success() && !text.is_empty()).then_some(text)
}
