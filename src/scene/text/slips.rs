//! Messages for syntax errors of RON that name the field and say what to write.
//!
//! A parser says what it wanted next, which is far from what is wrong with `exposure: 1,5`. Here the text around the
//! place where it gave up is read once more, for the slips that are common: numbers, quotes, brackets, and what other
//! formats have.

use super::faults;
use super::places::{self, Reader};

/// Syntax error of a text.
#[derive(Debug, PartialEq, Eq)]
pub struct Slip {
    /// Line and column, both from 1.
    pub line_column: (usize, usize),
    /// The field, as `entities[3].light.range`; empty where the message names it, or it is not known.
    pub place: String,
    /// Fault, and the expected text.
    pub message: String,
}

/// Explains why RON's parser refuses a text.
pub fn explain(text: &str, error: &ron::error::SpannedError) -> Slip {
    // In a comment that nothing follows, the parser gives up within it.
    let has_nothing = places::token_after(text, 0) == text.len();
    let gave_up =
        if has_nothing { text.len() } else { places::offset(text, (error.span.start.line, error.span.start.col)) };
    explain_at(text, gave_up, &error.code)
}

/// Explains the fault of a text that a parser gave up at a byte offset.
pub fn explain_at(text: &str, gave_up: usize, error: &ron::Error) -> Slip {
    let at = places::token_after(text, gave_up);
    let around = Around { text, at, levels: levels(text, at) };
    let odd_blank = text[gave_up..at].chars().find(|&c| c.is_whitespace() && !is_blank_of_ron(c));
    let (at, levels, message) = if let Some(blank) = odd_blank {
        let message = format!("expected an ordinary space, found the space U+{:04X}", u32::from(blank));
        (gave_up, around.levels.clone(), message)
    } else {
        around.explain(error).unwrap_or_else(|| {
            // A value of one of our own types; names that are not known name their place themselves.
            let is_of_value = matches!(error, ron::Error::Message(wanted) if wanted.starts_with("expected"));
            (at, if is_of_value { around.levels.clone() } else { Vec::new() }, describe(error))
        })
    };
    Slip { line_column: places::line_column(text, at), place: place(&levels), message }
}

/// Tests for `ws_single` in RON's grammar.
fn is_blank_of_ron(c: char) -> bool {
    matches!(
        c,
        '\t' | '\n' | '\u{b}' | '\u{c}' | '\r' | ' ' | '\u{85}' | '\u{200e}' | '\u{200f}' | '\u{2028}' | '\u{2029}'
    )
}

/// `ron`'s message; where a name is unknown, ours with the nearest known one.
fn describe(error: &ron::Error) -> String {
    let unknown = |kind: &str, found: &str, known: &[&str]| {
        format!("unknown {kind} {found:?}{}", faults::suggestion(found, known))
    };
    match error {
        ron::Error::NoSuchStructField { expected, found, .. } => unknown("field", found, expected),
        ron::Error::NoSuchEnumVariant { expected, found, .. } => unknown("variant", found, expected),
        ron::Error::MissingStructField { field, .. } => format!("missing field {field:?}"),
        ron::Error::DuplicateStructField { field, .. } => format!("duplicate field {field:?}"),
        ron::Error::ExceededRecursionLimit => "nested too deeply".into(),
        _ => {
            let text = error.to_string();
            let mut letters = text.chars();
            letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
        }
    }
}

/// A bracket that is open, and which of the values in it is being read.
#[derive(Clone, Debug)]
struct Level<'a> {
    bracket: char,
    /// Byte offset.
    at: usize,
    /// The name before the colon.
    field: Option<&'a str>,
    /// Name of the value before the last comma.
    before: Option<&'a str>,
    /// Commas before.
    index: usize,
}

impl Level<'_> {
    fn closing(&self) -> char {
        match self.bracket {
            '(' => ')',
            '[' => ']',
            _ => '}',
        }
    }
}

/// The brackets that are open at a byte offset, from the outermost. Without recursion: the text may be anything.
fn levels(text: &str, end: usize) -> Vec<Level<'_>> {
    let mut reader = Reader { text: &text[..end], at: 0 };
    let (mut levels, mut last): (Vec<Level>, _) = (Vec::new(), None);
    loop {
        reader.skip_space();
        let at = reader.at;
        let Some(c) = reader.rest().chars().next() else { return levels };
        match c {
            '(' | '[' | '{' => levels.push(Level { bracket: c, at, field: None, before: None, index: 0 }),
            ')' | ']' | '}' => _ = levels.pop(),
            ':' => {
                if let Some(level) = levels.last_mut() {
                    level.field = last.take();
                }
            }
            ',' => {
                if let Some(level) = levels.last_mut() {
                    (level.before, level.field, level.index) = (level.field, None, level.index + 1);
                }
            }
            _ => {
                let word = reader.word();
                if reader.rest().starts_with('"') {
                    reader.string(word);
                } else if word.is_empty() {
                    reader.at += c.len_utf8();
                }
                last = Some(reader.text[at..reader.at].trim_matches('"').trim_start_matches("r#"));
                continue;
            }
        }
        (reader.at, last) = (at + c.len_utf8(), None);
    }
}

/// The place for people.
fn place(levels: &[Level]) -> String {
    let mut place = String::new();
    for level in levels {
        match (level.bracket, level.field) {
            ('{', Some(name)) => place.push_str(&format!("[{name:?}]")),
            (_, Some(name)) if place.is_empty() => place.push_str(name),
            (_, Some(name)) => place.push_str(&format!(".{name}")),
            ('[', None) => place.push_str(&format!("[{}]", level.index)),
            // Values without names are a tuple's.
            ('(', None) if level.index > 0 && level.before.is_none() => place.push_str(&format!("[{}]", level.index)),
            _ => {}
        }
    }
    place
}

/// Tests for letters of words: numbers, names and units.
fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || "_.+-#°%−".contains(c)
}

/// The word at the end of a text, and where it begins.
fn last_word(text: &str) -> (usize, &str) {
    let start = text.char_indices().rev().take_while(|&(_, c)| is_of_word(c)).last().map_or(text.len(), |(at, _)| at);
    (start, &text[start..])
}

/// Letters of a value that a message shows.
const MOST_SHOWN: usize = 30;

/// The text around the place where the parser gave up.
struct Around<'a> {
    text: &'a str,
    at: usize,
    levels: Vec<Level<'a>>,
}

/// Byte offset, open brackets and message.
type Explained<'a> = Option<(usize, Vec<Level<'a>>, String)>;

impl<'a> Around<'a> {
    fn explain(&self, error: &ron::Error) -> Explained<'a> {
        use ron::Error::*;
        let here = |message: String| Some((self.at, self.levels.clone(), message));
        let expected = |what: &str| here(format!("expected {what}, found {}", self.found()) + &self.hint());
        match error {
            SuggestRawIdentifier(_) | InvalidIdentifier(_) | ExpectedIdentifier => self.name(),
            ExpectedComma => self.after_value(),
            ExpectedFloat => expected("a number"),
            UnexpectedChar(_) | ExpectedChar => self.division().or_else(|| expected("a value")),
            InvalidIntegerDigit { .. } | ExpectedInteger => self.whole_number(),
            IntegerOutOfBounds => self.out_of_bounds(),
            ExpectedBoolean => expected("true or false"),
            ExpectedString => expected("a string in quotes"),
            ExpectedArray => expected("a list in brackets, [ … ]"),
            ExpectedMap => expected("named entries in braces, { \"name\": … }"),
            ExpectedStructLike => expected("( … )"),
            ExpectedNamedStructLike(_) | ExpectedDifferentStructName { .. } if self.levels.is_empty() => {
                expected("( … ) around all fields of the file")
            }
            ExpectedNamedStructLike(_) | ExpectedDifferentStructName { .. } => expected("fields in parentheses, ( … )"),
            ExpectedStructLikeEnd => self.too_many(),
            ExpectedDifferentLength { expected, found } => {
                let wanted: String = expected.chars().filter(char::is_ascii_digit).collect();
                let levels = self.levels[..self.levels.len().saturating_sub(1)].to_vec();
                let message = format!("expected {wanted} values, found {found}");
                (!wanted.is_empty()).then_some((self.at, levels, message))
            }
            ExpectedMapColon => expected(&format!("a colon after {}", self.before().1)),
            TrailingCharacters => expected("the end of the file"),
            ExpectedStringEnd => here("unterminated string: missing closing quote".into()),
            InvalidEscape(_) => {
                here(r"expected \\ for a backslash in a string; separate directories in a path by /".into())
            }
            UnclosedBlockComment => {
                let begins = self.text[..self.at].rfind("/*").unwrap_or(self.at);
                Some((begins, Vec::new(), "unterminated comment: missing */".into()))
            }
            _ if self.rest().is_empty() && self.levels.is_empty() => expected("( … ) around all fields of the file"),
            Eof => self.unclosed(),
            Message(wanted) => self.numbers(wanted),
            _ => None,
        }
    }

    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    /// Tells if a name is expected at this place, and not a value.
    fn wants_name(&self) -> bool {
        self.levels.last().is_none_or(|level| level.field.is_none())
    }

    /// The word, text or letter at the place.
    fn token(&self) -> &'a str {
        let rest = self.rest();
        let Some(first) = rest.chars().next() else { return "" };
        let end = match first {
            '"' => rest[1..].find('"').map_or(rest.len(), |end| end + 2),
            c if is_of_word(c) => rest.find(|c| !is_of_word(c)).unwrap_or(rest.len()),
            c => c.len_utf8(),
        };
        &rest[..end]
    }

    /// Describes the token that is there.
    fn found(&self) -> String {
        let token = self.token();
        match token.chars().next() {
            None => "the end of the file".into(),
            Some(c) if token.len() == c.len_utf8() && (c.is_control() || !c.is_ascii() && !c.is_alphanumeric()) => {
                format!("`{}` (U+{:04X})", c.escape_debug(), u32::from(c))
            }
            Some(_) if token.chars().count() > MOST_SHOWN => {
                format!("`{}…`", token.chars().take(MOST_SHOWN).collect::<String>())
            }
            Some(_) => format!("`{token}`"),
        }
    }

    /// Suggests text in place of the token, where that is clear.
    fn hint(&self) -> String {
        let token = self.token();
        let inside = token.trim_matches('"');
        let is_text = token.starts_with('"');
        match token {
            _ if is_text && inside.parse::<f64>().is_ok() => format!("; write numbers without quotes: {inside}"),
            _ if is_text && matches!(inside, "true" | "false") => format!("; write it without quotes: {inside}"),
            "null" | "nil" | "none" | "None" => "; leave out the field instead".into(),
            "True" | "TRUE" | "yes" | "on" | "1" | "False" | "FALSE" | "no" | "off" | "0" => String::new(),
            "-" | "+" => "; write the sign directly before the number".into(),
            "=" => "; write a colon after a field name".into(),
            "{" | "[" | "(" => String::new(),
            "“" | "”" | "„" | "‘" | "’" | "«" => "; use straight quotes: \"".into(),
            _ if token.starts_with('−') => "; use - for minus".into(),
            _ if token.starts_with('\'') => "; use double quotes".into(),
            _ => String::new(),
        }
    }

    /// The word that ends before the place, blanks aside, and where it begins; empty where there is none.
    fn before(&self) -> (usize, &'a str) {
        last_word(self.text[..self.at].trim_end())
    }

    /// The word that ends before the comma before the place: the first half of `1,5`.
    fn before_comma(&self) -> Option<(usize, &'a str)> {
        Some(last_word(self.text[..self.at].trim_end().strip_suffix(',')?))
    }

    /// Explains a fault where the name of a field, or of a choice, was expected.
    fn name(&self) -> Explained<'a> {
        let token = self.token();
        let here = |message: String| Some((self.at, self.levels.clone(), message));
        let fraction = token.chars().take_while(char::is_ascii_digit).count();
        if let Some((start, whole)) = self.before_comma().filter(|(_, whole)| whole.parse::<f64>().is_ok())
            && fraction > 0
            && self.wants_name()
        {
            let mut levels = self.levels.clone();
            if let Some(level) = levels.last_mut() {
                level.field = level.before;
            }
            let digits: String = whole.chars().filter(|c| *c != '.').collect();
            let remedy = match fraction {
                // A comma may part thousands, too.
                3 => format!("{digits}.{token} or {digits}{token}"),
                _ => format!("{digits}.{token}"),
            };
            let message = format!("found `{whole},{token}`; use a decimal point, not a comma: {remedy}");
            return Some((start, levels, message));
        }
        match (token.chars().next(), self.wants_name()) {
            (Some('"'), true) => here(format!("write field names without quotes: {}", token.trim_matches('"'))),
            (Some('"'), false) => here(format!("write variants without quotes: {}", token.trim_matches('"'))),
            (Some(','), true) => here("expected a field name, found a second comma".into()),
            (Some('#'), _) => here("expected a field name, found `#`; comments begin with //".into()),
            (Some('-'), _) if token == "--" => here("expected a field name, found `--`; comments begin with //".into()),
            (None, _) => self.unclosed(),
            (_, true) => here(format!("expected a field name, found {}", self.found())),
            (_, false) => here(format!("expected a variant, found {}", self.found())),
        }
    }

    /// At the stroke of a fraction.
    fn division(&self) -> Explained<'a> {
        let below = self.rest().strip_prefix('/')?.trim_start();
        let below = &below[..below.find(|c| !is_of_word(c)).unwrap_or(below.len())];
        let (start, above) = self.before();
        let value = above.parse::<f64>().ok()? / below.parse::<f64>().ok()?;
        let message = format!("expected a number, found the fraction `{above}/{below}`; write {value}");
        value.is_finite().then(|| (start, self.levels.clone(), message))
    }

    fn whole_number(&self) -> Explained<'a> {
        let remedy = match self.token().parse::<f64>() {
            Ok(number) if number.fract() == 0.0 && number.abs() < 1e15 => format!("; write {number}"),
            _ => self.hint(),
        };
        Some((self.at, self.levels.clone(), format!("expected a whole number, found {}{remedy}", self.found())))
    }

    /// At a whole number that its field cannot hold, or behind its sign.
    fn out_of_bounds(&self) -> Explained<'a> {
        let (start, sign) = self.before();
        let start = if !sign.is_empty() && self.text[..self.at].ends_with(sign) { start } else { self.at };
        let number = &self.text[start..self.at + self.token().len()];
        let expected = if number.starts_with('-') { "a whole number of 0 or more" } else { "a smaller whole number" };
        Some((start, self.levels.clone(), format!("expected {expected}, found `{number}`")))
    }

    /// Behind a value, where a comma or the end was expected.
    fn after_value(&self) -> Explained<'a> {
        let here = |message: String| Some((self.at, self.levels.clone(), message));
        let before = &self.text[..self.at];
        let start =
            before.char_indices().rev().take_while(|&(_, c)| is_of_word(c)).last().map_or(self.at, |(at, _)| at);
        let (number, token) = (&before[start..], self.token());
        let whole = &self.text[start..self.at + token.len()];
        let at_number = |message: String| Some((start, self.levels.clone(), message));
        if number == "0"
            && let Some(value) = other_base(whole)
        {
            return at_number(format!("expected a decimal number, found `{whole}`; write {value}"));
        }
        if number.parse::<f64>().is_ok() && !token.is_empty() {
            if token.starts_with('.') && whole.parse::<f64>().is_ok() {
                return at_number(format!("expected a whole number, found `{whole}`"));
            }
            if token.starts_with(is_of_word) {
                return at_number(format!("expected a number without a suffix, found `{whole}`; write {number}"));
            }
            if token == "'" {
                return at_number(format!("expected a number without separators, found `{whole}…`"));
            }
        }
        let level = self.levels.last()?;
        let closing = level.closing();
        match token.chars().next() {
            None => self.unclosed(),
            // The value is whole; what follows its bracket is not expected.
            Some(c) if c == closing => {
                let at = places::token_after(self.text, self.at + 1);
                let levels = self.levels[..self.levels.len() - 1].to_vec();
                Self { text: self.text, at, levels }.after_value()
            }
            Some(')' | ']' | '}') => {
                let (line, column) = places::line_column(self.text, level.at);
                let (bracket, found) = (level.bracket, self.found());
                here(format!("expected `{closing}`, which closes the `{bracket}` of {line}:{column}, found {found}"))
            }
            Some(_) => here(format!("expected a comma or `{closing}`, found {}{}", self.found(), self.hint())),
        }
    }

    /// At the end of the file, or where a bracket is not closed.
    fn unclosed(&self) -> Explained<'a> {
        let level = self.levels.last()?;
        let (line, column) = places::line_column(self.text, level.at);
        let (bracket, closing) = (level.bracket, level.closing());
        let outside = self.levels[..self.levels.len() - 1].to_vec();
        let message =
            format!("expected `{closing}`, which closes the `{bracket}` of {line}:{column}, found {}", self.found());
        Some((self.at, outside, message))
    }

    /// More values than a tuple has.
    fn too_many(&self) -> Explained<'a> {
        let level =
            self.levels.last().filter(|level| level.index > 0 && level.before.is_none() && level.field.is_none());
        let Some(level) = level else { return self.unclosed() };
        let outside = self.levels[..self.levels.len() - 1].to_vec();
        let count = level.index;
        let message = format!("expected {count} values, found more; use a decimal point, not a comma: 0.5");
        Some((level.at, outside, message))
    }

    /// Behind numbers in parentheses that are another count than what was wanted, as a colour's.
    fn numbers(&self, wanted: &str) -> Explained<'a> {
        const COMMA: &str = "; use a decimal point, not a comma: 0.5";
        if !wanted.starts_with("expected") {
            return None;
        }
        // The parser stops behind them, or at the bracket that closes them.
        let before = self.text[..self.at].trim_end();
        let inside = before.strip_suffix(')').or_else(|| self.rest().starts_with(')').then_some(before))?;
        let (before, inside) = inside.rsplit_once('(')?;
        // What a word stands before is a choice, and not the numbers themselves.
        if before.ends_with(|c: char| c.is_alphanumeric() || c == '_') {
            return None;
        }
        let words: Vec<&str> = inside.trim().trim_end_matches(',').split(',').map(str::trim).collect();
        if words.iter().any(|word| word.parse::<f64>().is_err()) {
            return None;
        }
        // Three are as many as there should be, and wrong in another way.
        let hint = match words.len() {
            3 => return None,
            4.. if words.iter().all(|word| !word.contains('.')) => COMMA,
            _ => "",
        };
        let count = words.len();
        let numbers = if count == 1 { "number" } else { "numbers" };
        let message = format!("{wanted}, found {count} {numbers}{hint}");
        Some((before.len(), levels(self.text, before.len()), message))
    }
}

/// The value of a number that begins with 0x, 0b or 0o.
fn other_base(text: &str) -> Option<u64> {
    let digits = text.strip_prefix('0')?;
    let (base, digits) = [('x', 16), ('X', 16), ('b', 2), ('o', 8)]
        .into_iter()
        .find_map(|(letter, base)| Some((base, digits.strip_prefix(letter)?)))?;
    u64::from_str_radix(&digits.replace('_', ""), base).ok()
}
