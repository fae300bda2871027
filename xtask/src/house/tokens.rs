//! Words and marks of Rust text, without comments, literals and what is built for tests only.

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Token {
    Word(String),
    Mark(char),
}

impl Token {
    pub(crate) fn is_word(&self, word: &str) -> bool {
        matches!(self, Token::Word(own) if own == word)
    }
}

/// Tokens of a file, without items under `#[cfg(test)]`.
pub(crate) fn tokens(text: &str) -> Vec<Token> {
    without_tests(&split(text))
}

fn split(text: &str) -> Vec<Token> {
    let text: Vec<char> = text.chars().collect();
    let at = |place: usize| text.get(place).copied().unwrap_or('\0');
    let (mut tokens, mut place) = (Vec::new(), 0);
    while place < text.len() {
        let mark = at(place);
        if mark == '/' && at(place + 1) == '/' {
            while place < text.len() && at(place) != '\n' {
                place += 1;
            }
        } else if mark == '/' && at(place + 1) == '*' {
            place = comment_end(&text, place);
        } else if mark == '"' {
            place = string_end(&text, place, true, 0);
        } else if mark == '\'' {
            // 'a' and '\n' are characters, 'a without a mark behind it is a lifetime.
            if at(place + 1) == '\\' {
                place += 3;
                while place < text.len() && at(place) != '\'' {
                    place += 1;
                }
                place += 1;
            } else {
                place += if at(place + 2) == '\'' { 3 } else { 1 };
            }
        } else if mark.is_alphanumeric() || mark == '_' {
            let start = place;
            while at(place).is_alphanumeric() || at(place) == '_' {
                place += 1;
            }
            let word: String = text[start..place].iter().collect();
            let hashes = text[place..].iter().take_while(|mark| **mark == '#').count();
            if matches!(word.as_str(), "r" | "br" | "b" | "c" | "cr") && at(place + hashes) == '"' {
                place = string_end(&text, place + hashes, !word.contains('r'), hashes);
            } else if !mark.is_ascii_digit() {
                tokens.push(Token::Word(word));
            }
        } else {
            if !mark.is_whitespace() {
                tokens.push(Token::Mark(mark));
            }
            place += 1;
        }
    }
    tokens
}

fn comment_end(text: &[char], start: usize) -> usize {
    let (mut depth, mut place) = (0, start);
    while place < text.len() {
        match (text[place], text.get(place + 1)) {
            ('/', Some('*')) => depth += 1,
            ('*', Some('/')) => depth -= 1,
            _ => {
                place += 1;
                continue;
            }
        }
        place += 2;
        if depth == 0 {
            break;
        }
    }
    place
}

/// Behind the string whose first quotation mark is at `start`.
fn string_end(text: &[char], start: usize, escapes: bool, hashes: usize) -> usize {
    let mut place = start + 1;
    while place < text.len() {
        if escapes && text[place] == '\\' {
            place += 2;
        } else if text[place] == '"'
            && text[place + 1..].iter().take(hashes).filter(|mark| **mark == '#').count() == hashes
        {
            return place + 1 + hashes;
        } else {
            place += 1;
        }
    }
    place
}

fn without_tests(tokens: &[Token]) -> Vec<Token> {
    let (mut kept, mut place) = (Vec::new(), 0);
    while place < tokens.len() {
        let attribute = tokens[place] == Token::Mark('#') && tokens.get(place + 1) == Some(&Token::Mark('['));
        let end = if attribute { group_end(tokens, place + 1) } else { place };
        let has = |word: &str| tokens[place..end].iter().any(|token| token.is_word(word));
        if attribute && has("cfg") && has("test") && !has("not") {
            place = item_end(tokens, end);
        } else if attribute {
            place = end;
        } else {
            kept.push(tokens[place].clone());
            place += 1;
        }
    }
    kept
}

/// Behind the bracket that closes the one at `start`.
pub(crate) fn group_end(tokens: &[Token], start: usize) -> usize {
    let mut depth = 0;
    for (place, token) in tokens.iter().enumerate().skip(start) {
        match token {
            Token::Mark('(' | '[' | '{') => depth += 1,
            Token::Mark(')' | ']' | '}') => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return place + 1;
        }
    }
    tokens.len()
}

/// Behind the item that begins at `start`, with further attributes: at its `;` or its closing brace.
fn item_end(tokens: &[Token], start: usize) -> usize {
    let mut place = start;
    let mut import = false;
    while place < tokens.len() {
        match &tokens[place] {
            Token::Mark(';') => return place + 1,
            Token::Mark('{') if !import => return group_end(tokens, place),
            Token::Mark('(' | '[' | '{') => place = group_end(tokens, place),
            token => {
                import |= token.is_word("use");
                place += 1;
            }
        }
    }
    place
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> String {
        let words = tokens(text).into_iter().filter_map(|token| match token {
            Token::Word(word) => Some(word),
            Token::Mark(_) => None,
        });
        words.collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn literals_and_comments_are_no_words() {
        let text = "a /* x /* y */ z */ b // c\n \"d \\\" e\" f r#\"g \" h\"# i 'j' k '\\n' l::<'m> 12u8 b\"n\" o";
        assert_eq!(words(text), "a b f i k l m o");
    }

    #[test]
    fn what_is_built_for_tests_only_is_left_out() {
        let text = "use a; #[cfg(test)] mod tests { use b; } #[derive(C)] struct D; #[cfg(test)] #[allow(e)] use f::{g, h};\n\
                    #[cfg(test)] fn i(j: [u8; 3]) -> k { l } #[cfg(not(test))] use m; #[cfg(test)] mod n; o";
        assert_eq!(words(text), "use a struct D use m o");
    }
}
