//! Simple arithmetic in scene files: `reach_mm + 5`, `(a_deg − b_deg) / 2`.
//!
//! ```text
//! sum     = product { ("+" | "−") product }
//! product = signed { ("*" | "/") signed }
//! signed  = { "−" | "+" } atom
//! atom    = number | name | [ "sin" | "cos" | "tan" | "sqrt" ] "(" sum ")"      sin, cos and tan of degrees
//! ```

use catoptric_model::place::nearest;

/// Maximum nesting depth of parentheses and signs.
const DEEPEST: usize = 64;

/// An error in an expression, with its position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Flaw {
    /// Byte offset in the expression.
    pub(super) at: usize,
    /// Length of the faulty part, in bytes.
    pub(super) length: usize,
    /// What was found and what is needed.
    pub(super) message: String,
    /// How to fix it.
    pub(super) help: Option<String>,
}

/// Why a name has no value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct NoValue {
    /// What is wrong with it.
    pub(super) message: String,
    /// How to fix it.
    pub(super) help: Option<String>,
}

/// Evaluates an expression; `look_up` is called for every name, in order.
pub(super) fn evaluate(
    text: &str,
    look_up: &mut dyn FnMut(&str) -> Result<f64, NoValue>,
) -> Result<f64, Flaw> {
    let mut reader = Reader {
        text,
        at: 0,
        depth: 0,
        look_up,
    };
    let value = reader.sum()?;
    reader.blanks();
    if reader.at < text.len() {
        return Err(reader.unexpected("an operator or the end"));
    }
    if !value.is_finite() {
        return Err(Flaw {
            at: 0,
            length: text.len(),
            message: format!("is {value}; a finite number is needed"),
            help: None,
        });
    }
    Ok(value)
}

/// Whether a string is a valid name: letters, digits and `_`, not starting with a digit.
pub(super) fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    look_up: &'a mut dyn FnMut(&str) -> Result<f64, NoValue>,
}

impl Reader<'_> {
    fn rest(&self) -> &str {
        &self.text[self.at..]
    }

    fn blanks(&mut self) {
        self.at += self.rest().len() - self.rest().trim_start().len();
    }

    /// One of several signs, if it is next.
    fn sign(&mut self, signs: &[char]) -> Option<char> {
        self.blanks();
        let next = self.rest().chars().next().filter(|c| signs.contains(c))?;
        self.at += next.len_utf8();
        Some(next)
    }

    fn sum(&mut self) -> Result<f64, Flaw> {
        let mut value = self.product()?;
        while let Some(sign) = self.sign(&['+', '-', '−']) {
            let next = self.product()?;
            value = if sign == '+' { value + next } else { value - next };
        }
        Ok(value)
    }

    fn product(&mut self) -> Result<f64, Flaw> {
        let mut value = self.signed()?;
        while let Some(sign) = self.sign(&['*', '×', '·', '/', '÷']) {
            self.blanks();
            let at = self.at;
            let next = self.signed()?;
            if !matches!(sign, '/' | '÷') {
                value *= next;
            } else if next == 0.0 {
                return Err(Flaw {
                    at,
                    length: self.at - at,
                    message: "divides by 0".to_owned(),
                    help: None,
                });
            } else {
                value /= next;
            }
        }
        Ok(value)
    }

    fn signed(&mut self) -> Result<f64, Flaw> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(Flaw {
                at: self.at,
                length: 1,
                message: format!("nests deeper than {DEEPEST}"),
                help: Some("make a parameter of a part of it".to_owned()),
            });
        }
        let value = match self.sign(&['-', '−', '+']) {
            Some('+') => self.signed()?,
            Some(_) => -self.signed()?,
            None => self.atom()?,
        };
        self.depth -= 1;
        Ok(value)
    }

    fn atom(&mut self) -> Result<f64, Flaw> {
        if self.sign(&['(']).is_some() {
            let open = self.at - 1;
            let value = self.sum()?;
            if self.sign(&[')']).is_none() {
                return Err(Flaw {
                    at: open,
                    length: 1,
                    message: "opens a parenthesis that is not closed".to_owned(),
                    help: None,
                });
            }
            return Ok(value);
        }
        let start = self.at;
        let of = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
        let word = self.rest().split(|c| !of(c)).next().unwrap_or_default();
        if word.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
            return self.number(start);
        }
        if !is_name(word) {
            return Err(self.unexpected("a number, a name or a parenthesis"));
        }
        let word = word.to_owned();
        self.at += word.len();
        if self.rest().trim_start().starts_with('(') {
            return self.function(&word, start);
        }
        (self.look_up)(&word).map_err(|none| Flaw {
            at: start,
            length: word.len(),
            message: none.message,
            help: none.help,
        })
    }

    fn function(&mut self, name: &str, start: usize) -> Result<f64, Flaw> {
        let function: fn(f64) -> f64 = match name {
            "sin" => |degrees| libm::sin(degrees.to_radians()),
            "cos" => |degrees| libm::cos(degrees.to_radians()),
            "tan" => |degrees| libm::tan(degrees.to_radians()),
            "sqrt" => f64::sqrt,
            _ => {
                let near = nearest(name, ["sin", "cos", "tan", "sqrt"]);
                return Err(Flaw {
                    at: start,
                    length: name.len(),
                    message: format!("asks for `{name}`, which is no function"),
                    help: Some(match near {
                        Some(near) => format!("did you mean `{near}`?"),
                        None => "there are sin, cos, tan (of degrees) and sqrt".to_owned(),
                    }),
                });
            }
        };
        let value = self.signed()?;
        Ok(function(value))
    }

    /// Digits, a decimal point, and an exponent with its sign.
    fn number(&mut self, start: usize) -> Result<f64, Flaw> {
        let mut last = ' ';
        let length = self.rest().find(|c: char| {
            let ends = !(c.is_ascii_alphanumeric()
                || c == '.'
                || c == '_'
                || ("+-".contains(c) && "eE".contains(last)));
            last = c;
            ends
        });
        let length = length.unwrap_or(self.rest().len());
        let word = &self.rest()[..length];
        let value = word.parse::<f64>().map_err(|_| Flaw {
            at: start,
            length,
            message: format!("holds {word:?}, which is no number"),
            help: Some("units are in the names: write 5, not 5mm".to_owned()),
        })?;
        self.at += length;
        Ok(value)
    }

    fn unexpected(&self, needed: &str) -> Flaw {
        let (length, found) = match self.rest().chars().next() {
            Some(c) => (c.len_utf8(), format!("has {c:?} where {needed} is needed")),
            None => (0, format!("ends where {needed} is needed")),
        };
        Flaw {
            at: self.at,
            length,
            message: found,
            help: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<f64, Flaw> {
        evaluate(text, &mut |name| match name {
            "reach_mm" => Ok(64.0),
            "half" => Ok(0.5),
            _ => Err(NoValue {
                message: format!("names `{name}`"),
                help: None,
            }),
        })
    }

    #[test]
    fn products_come_before_sums_and_signs_before_both() {
        for (text, wanted) in [
            ("reach_mm + 5", 69.0),
            ("1 + 2 * 3 - 4 / 2", 5.0),
            ("10 - 4 - 3", 3.0),
            ("24 / 4 / 2", 3.0),
            ("-(reach_mm − 4) × half", -30.0),
            ("2 * -3", -6.0),
            ("1.5e1 ÷ 3", 5.0),
            ("1e-1+1", 1.1),
            (" ( ( 7 ) ) ", 7.0),
            ("2·half", 1.0),
            ("sqrt(16) + 2 * cos(0)", 6.0),
            ("tan (45 - 45)", 0.0),
        ] {
            assert_eq!(value(text), Ok(wanted), "{text}");
        }
    }

    #[test]
    fn flaws_have_positions() {
        for (text, at, length, words) in [
            ("reach_mm + ", 11, 0, "ends where a number"),
            ("reach_mm 5", 9, 1, "'5' where an operator"),
            ("2 * (3 + 4", 4, 1, "not closed"),
            ("2 + 5mm", 4, 3, "\"5mm\", which is no number"),
            ("1 / (half - 0.5)", 4, 12, "divides by 0"),
            ("2 + rech", 4, 4, "names `rech`"),
            ("1 + csc(3)", 4, 3, "`csc`, which is no function"),
            ("sqrt(0 - 1)", 0, 11, "NaN"),
            ("2 ^ 3", 2, 1, "'^' where an operator"),
            ("1e308 * 10", 0, 10, "inf"),
            ("", 0, 0, "ends"),
        ] {
            let flaw = value(text).expect_err(text);
            assert_eq!((flaw.at, flaw.length), (at, length), "{text}: {flaw:?}");
            assert!(flaw.message.contains(words), "{text}: {flaw:?}");
        }
        let deep = format!("{}1{}", "(".repeat(100_000), ")".repeat(100_000));
        assert!(
            value(&deep)
                .expect_err("no stack is that deep")
                .message
                .contains("deeper than 64")
        );
    }
}
