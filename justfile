# The few commands one repeats: `just` lists them. Everything a change must pass is in .ci/run.

_list:
    @just --list --unsorted

# format, lints, words and spelling: a minute
check: words
    cargo fmt --all --check
    cargo clippy --workspace --all-targets --locked -- -D warnings

# all tests, or those whose name holds FILTER
test *FILTER:
    cargo test --workspace --locked {{ FILTER }}

# words against docs/phrases.txt, and spelling
words:
    tests/words
    typos

# every reader fed with mutated files, SECONDS each
fuzz SECONDS="280" *READERS:
    fuzz/run {{ SECONDS }} {{ READERS }}

# the whole story, and its report
demo:
    cargo run --release --locked -- demo
    @echo "open catoptric-demo/report.html"

# the library's documentation, guide included
doc:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked --features catoptric/testing

# how long each stage takes, compared with the baseline NAME that an earlier run saved
bench NAME="before":
    cargo bench --bench stages -- --baseline-lenient {{ NAME }}

# everything a change must pass
ci:
    .ci/run
