//! Formulas in one variable, n: numbers, + − * / ^, parentheses.

use std::{fmt, iter::Peekable, str::Chars};

/// Characters of a formula, at most: what is nested is as deep as that.
const LONGEST: usize = 200;

/// A formula in the order n: "2.4 / n^1.5".
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    text: String,
    term: Term,
}

#[derive(Debug, Clone, PartialEq)]
enum Term {
    Number(f64),
    Order,
    Negative(Box<Term>),
    /// +, -, *, / or ^ of two.
    Two(char, Box<Term>, Box<Term>),
}

impl Formula {
    /// Reads a formula.
    ///
    /// # Errors
    /// What was expected, and what stands there instead.
    pub fn parse(text: &str) -> Result<Self, String> {
        let refuse = |said: String| format!("expected a formula in n, as \"2.4 / n^1.5\": {said}");
        if text.chars().count() > LONGEST {
            return Err(refuse(format!("it is longer than {LONGEST} characters")));
        }
        let mut reader = Reader { rest: text.chars().peekable() };
        let term = reader.sum().map_err(refuse)?;
        match reader.next() {
            Some(character) => Err(refuse(format!("found `{character}` behind its end"))),
            None => Ok(Self { text: text.trim().to_owned(), term }),
        }
    }

    /// Its value at n.
    #[must_use]
    pub fn at(&self, n: f64) -> f64 {
        self.term.at(n)
    }
}

impl fmt::Display for Formula {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Term {
    fn at(&self, n: f64) -> f64 {
        match self {
            Self::Number(number) => *number,
            Self::Order => n,
            Self::Negative(term) => -term.at(n),
            Self::Two(sign, left, right) => {
                let (left, right) = (left.at(n), right.at(n));
                match sign {
                    '+' => left + right,
                    '-' => left - right,
                    '*' => left * right,
                    '/' => left / right,
                    _ => left.powf(right),
                }
            }
        }
    }
}

/// What is left of a text, term by term.
struct Reader<'a> {
    rest: Peekable<Chars<'a>>,
}

impl Reader<'_> {
    fn peek(&mut self) -> Option<char> {
        while self.rest.next_if(|character| character.is_whitespace()).is_some() {}
        self.rest.peek().copied()
    }

    fn next(&mut self) -> Option<char> {
        self.peek();
        self.rest.next()
    }

    fn sum(&mut self) -> Result<Term, String> {
        self.chain(&['+', '-'], Self::product)
    }

    fn product(&mut self) -> Result<Term, String> {
        self.chain(&['*', '/'], Self::signed)
    }

    /// Terms between these signs, from the left.
    fn chain(&mut self, signs: &[char], term: fn(&mut Self) -> Result<Term, String>) -> Result<Term, String> {
        let mut all = term(self)?;
        while let Some(sign) = self.peek().filter(|sign| signs.contains(sign)) {
            self.next();
            all = Term::Two(sign, Box::new(all), Box::new(term(self)?));
        }
        Ok(all)
    }

    fn signed(&mut self) -> Result<Term, String> {
        if self.peek() == Some('-') {
            self.next();
            return Ok(Term::Negative(Box::new(self.signed()?)));
        }
        let base = self.single()?;
        if self.peek() != Some('^') {
            return Ok(base);
        }
        self.next();
        // Powers are taken from the right: an exponent may have a sign and a power of its own.
        Ok(Term::Two('^', Box::new(base), Box::new(self.signed()?)))
    }

    fn single(&mut self) -> Result<Term, String> {
        match self.peek() {
            Some('n') => {
                self.next();
                Ok(Term::Order)
            }
            Some('(') => {
                self.next();
                let inner = self.sum()?;
                match self.next() {
                    Some(')') => Ok(inner),
                    _ => Err("a parenthesis is not closed".into()),
                }
            }
            Some(character) if character.is_ascii_digit() || character == '.' => self.number(),
            Some(character) => Err(format!("found `{character}`, which is no number, n or parenthesis")),
            None => Err("a number, n or parenthesis is missing at its end".into()),
        }
    }

    fn number(&mut self) -> Result<Term, String> {
        let mut digits = String::new();
        loop {
            let after_exponent = digits.ends_with(['e', 'E']);
            let is_part = |character: &char| {
                character.is_ascii_digit()
                    || matches!(character, '.' | 'e' | 'E')
                    || after_exponent && matches!(character, '+' | '-')
            };
            match self.rest.next_if(is_part) {
                Some(character) => digits.push(character),
                None => break,
            }
        }
        digits.parse().map(Term::Number).map_err(|_| format!("`{digits}` is no number"))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::Formula;

    #[test]
    fn signs_bind_as_in_school() {
        for (text, at_3) in [
            ("2.4 / n^1.5", 2.4 / 27.0_f64.sqrt()),
            ("2^n^2", 512.0),
            ("-n^2", -9.0),
            ("1 - 2 - 3", -4.0),
            ("12 / 2 / n", 2.0),
            ("n^-1", 1.0 / 3.0),
            ("1e-2*(n + 1)", 0.04),
            (".5+n", 3.5),
        ] {
            let found = Formula::parse(text).unwrap().at(3.0);
            assert!((found - at_3).abs() < 1e-12, "{text}: {found}");
        }
    }

    #[test]
    fn what_is_no_formula_says_why() {
        for (text, said) in [
            ("", "missing"),
            ("2 +", "missing"),
            ("(n", "not closed"),
            ("2 n", "behind its end"),
            ("sqrt(n)", "found `s`"),
            ("1.2.3", "no number"),
            ("1e", "no number"),
        ] {
            let refused = Formula::parse(text).unwrap_err();
            assert!(refused.contains(said), "{text}: {refused}");
        }
        assert!(Formula::parse(&"(".repeat(201)).unwrap_err().contains("200"));
    }
}
