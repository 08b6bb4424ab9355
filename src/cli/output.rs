//! Standard output: data and results; a closed pipe ends the program quietly.

use super::error::CliError;
use catoptric::files::names::printable;
pub(crate) use catoptric::files::paths::quoted;
use std::io::{ErrorKind, Write};

/// Writes text to stdout; nothing in it moves the cursor or changes colors of a terminal, whatever names it contains.
pub(crate) fn print(text: &str) -> Result<(), CliError> {
    let text = printable(text);
    let mut stdout = std::io::stdout().lock();
    let written = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
    written.map_err(|e| match e.kind() {
        ErrorKind::BrokenPipe => CliError::ClosedPipe,
        _ => CliError::Output(e),
    })
}

/// Writes a result to stdout as one line of JSON.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<(), CliError> {
    let json = serde_json::to_string(value).map_err(|e| CliError::Output(e.into()))?;
    print(&format!("{json}\n"))
}

/// Formats a number with its digits in groups of three.
pub(crate) fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}

/// "1 board", "2 boards".
pub(crate) fn counted(number: usize, what: &str) -> String {
    format!("{} {what}{}", grouped(number), if number == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_grouped_in_threes() {
        assert_eq!(grouped(0), "0");
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(1000), "1 000");
        assert_eq!(grouped(1_234_567), "1 234 567");
    }
}
