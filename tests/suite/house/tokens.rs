//! Source code as words and signs: without comments, literals, and code compiled for tests only.

/// Splits a Rust file into tokens.
pub(super) fn tokens(source: &str) -> Vec<String> {
    let mut all = Vec::new();
    let mut rest = source;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if let Some(length) = text(rest) {
            length
        } else if first.is_alphanumeric() || first == '_' {
            let is_word = |c: char| c.is_alphanumeric() || c == '_';
            let length = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
            all.push(rest[..length].to_owned());
            length
        } else {
            let length = if rest.starts_with("::") {
                2
            } else {
                first.len_utf8()
            };
            if !first.is_whitespace() {
                all.push(rest[..length].to_owned());
            }
            length
        };
        rest = &rest[length..];
    }
    without_tests(&all)
}

/// Length of the string or character that begins here.
fn text(rest: &str) -> Option<usize> {
    let plain = rest.strip_prefix('b').unwrap_or(rest);
    let prefix = rest.len() - plain.len();
    if let Some(raw) = plain.strip_prefix('r') {
        let hashes = raw.len() - raw.trim_start_matches('#').len();
        let inner = raw[hashes..].strip_prefix('"')?;
        let end = format!("\"{}", "#".repeat(hashes));
        return Some(prefix + 2 + hashes + inner.find(&end)? + end.len());
    }
    let quote = plain.chars().next().filter(|c| ['"', '\''].contains(c))?;
    let mut inner = plain.char_indices().skip(1);
    let (_, first) = inner.clone().next()?;
    // A lifetime has no closing quote.
    if quote == '\'' && first != '\\' && inner.clone().nth(1)?.1 != '\'' {
        return None;
    }
    while let Some((at, c)) = inner.next() {
        if c == '\\' {
            inner.next();
        } else if c == quote {
            return Some(prefix + at + 1);
        }
    }
    None
}

/// Everything except what follows `#[cfg(test)]`.
fn without_tests(all: &[String]) -> Vec<String> {
    const MARK: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut kept = Vec::new();
    let mut at = 0;
    while at < all.len() {
        if all[at..].iter().zip(MARK).filter(|(a, b)| *a == b).count() == MARK.len() {
            at += MARK.len();
            at += item(&all[at..]);
        } else {
            kept.push(all[at].clone());
            at += 1;
        }
    }
    kept
}

/// Length of an item: up to its semicolon, or to the end of its braces.
fn item(all: &[String]) -> usize {
    let mut depth = 0;
    for (at, token) in all.iter().enumerate() {
        match token.as_str() {
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" => depth -= 1,
            _ => {}
        }
        if depth == 0 && ["}", ";"].contains(&token.as_str()) {
            return at + 1;
        }
    }
    all.len()
}

#[test]
fn comments_literals_and_tests_are_omitted() {
    let source = r##"
        //! crate::a
        use b::{c as d}; /* crate::e */
        const F: &str = "crate::g \" { "; const H: &str = r#"crate::i "quoted" {"#;
        fn j<'k>(l: &'k str) -> char { '{' }
        const M: char = '\'';
        #[cfg(test)]
        #[allow(n)]
        mod tests { use crate::o; fn p() {} }
        #[cfg(test)]
        mod q;
        use r::s;
    "##;
    let found = tokens(source).join(" ");
    assert_eq!(
        found,
        "use b :: { c as d } ; const F : & str = ; const H : & str = ; \
         fn j < ' k > ( l : & ' k str ) -> char { } const M : char = ; use r :: s ;"
            .replace("->", "- >")
    );
}
