//! Places of values in a scene file's text, so that a check of the finished structs can name line and column.
//!
//! A second, lenient reader of RON that keeps places only. It runs on text that `ron` has already accepted, and only
//! when something is wrong.

use systems::describe::Step;

/// All values of a text, to find many.
pub struct Places<'a> {
    text: &'a str,
    root: Node<'a>,
}

impl<'a> Places<'a> {
    /// Reads the text.
    pub fn of(text: &'a str) -> Self {
        Self { text, root: Reader { text, at: 0 }.value() }
    }

    /// Line and column, both from 1, of the value that the steps lead to, or of the nearest value around it that is
    /// there.
    pub fn find(&self, steps: &[Step]) -> (usize, usize) {
        line_column(self.text, follow(&self.root, steps).at)
    }
}

/// [`Places::find`] for one value.
pub fn find(text: &str, steps: &[Step]) -> (usize, usize) {
    Places::of(text).find(steps)
}

/// The byte offset of that value.
pub fn find_offset(text: &str, steps: &[Step]) -> usize {
    follow(&Reader { text, at: 0 }.value(), steps).at
}

/// The byte offset of a field's name in the struct that the steps lead to, behind `earlier` fields of that name; of the
/// struct, if it is not there.
pub fn find_name(text: &str, steps: &[Step], name: &str, earlier: usize) -> usize {
    let root = Reader { text, at: 0 }.value();
    let node = follow(&root, steps);
    let Parts::Fields(fields) = &node.parts else { return node.at };
    fields.iter().filter(|field| field.name == name).nth(earlier).map_or(node.at, |field| field.at)
}

fn follow<'n, 'a>(mut node: &'n Node<'a>, steps: &[Step]) -> &'n Node<'a> {
    for step in steps {
        // `Some(value)`, and the one value of a newtype variant, are as good as the value itself.
        while let Parts::Items(items) = &node.parts {
            let is_wrapper = match step {
                Step::Field(_) => true,
                Step::Index(_) | Step::Entry(_) => node.is_named,
            };
            let ([only], true) = (items.as_slice(), is_wrapper) else { break };
            node = only;
        }
        let next = match (&node.parts, step) {
            (Parts::Fields(fields), Step::Field(name)) => {
                fields.iter().find(|field| field.name == *name).map(|field| &field.value)
            }
            (Parts::Items(items), Step::Index(i) | Step::Entry(i)) => items.get(*i),
            _ => None,
        };
        let Some(next) = next else { break };
        node = next;
    }
    node
}

/// The byte offset of a line and column, both from 1; the nearest there is.
pub fn offset(text: &str, (line, column): (usize, usize)) -> usize {
    let line_start = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum::<usize>();
    line_start + text[line_start..].chars().take(column.saturating_sub(1)).map(char::len_utf8).sum::<usize>()
}

/// The byte offset of the next thing that is neither blank nor comment: `ron` points before these.
pub fn token_after(text: &str, at: usize) -> usize {
    let mut reader = Reader { text, at };
    reader.skip_space();
    reader.at
}

/// Line and column of a byte offset, both from 1.
pub fn line_column(text: &str, at: usize) -> (usize, usize) {
    let before = &text[..at];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (1 + before.matches('\n').count(), 1 + before[line_start..].chars().count())
}

struct Node<'a> {
    /// Byte offset of its first character.
    at: usize,
    /// A word stands before its bracket, as that of a choice.
    is_named: bool,
    parts: Parts<'a>,
}

enum Parts<'a> {
    None,
    Fields(Vec<Field<'a>>),
    Items(Vec<Node<'a>>),
}

struct Field<'a> {
    name: &'a str,
    /// Byte offset of the name.
    at: usize,
    value: Node<'a>,
}

/// Reads words and blanks as RON has them.
pub struct Reader<'a> {
    pub text: &'a str,
    pub at: usize,
}

impl<'a> Reader<'a> {
    pub fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn take(&mut self, token: &str) -> bool {
        let found = self.rest().starts_with(token);
        if found {
            self.at += token.len();
        }
        found
    }

    /// Moves on past the next `end`, or to the end of the text.
    fn skip_past(&mut self, end: &str) {
        self.at += self.rest().find(end).map_or(self.rest().len(), |i| i + end.len());
    }

    /// Blanks, comments (block comments nest) and `#![enable(…)]`.
    pub fn skip_space(&mut self) {
        loop {
            let rest = self.rest();
            self.at += rest.len() - rest.trim_start().len();
            if self.take("//") {
                self.skip_past("\n");
            } else if self.take("/*") {
                let mut depth = 1;
                while depth > 0 && !self.rest().is_empty() {
                    match self.rest() {
                        rest if rest.starts_with("/*") => (depth, self.at) = (depth + 1, self.at + 2),
                        rest if rest.starts_with("*/") => (depth, self.at) = (depth - 1, self.at + 2),
                        rest => self.at += rest.chars().next().map_or(0, char::len_utf8),
                    }
                }
            } else if self.take("#!") {
                self.skip_past("]");
            } else {
                return;
            }
        }
    }

    pub fn word(&mut self) -> &'a str {
        let rest = self.rest();
        let end = rest.find(|c: char| !(c.is_alphanumeric() || "_.+-#".contains(c))).unwrap_or(rest.len());
        self.at += end;
        &rest[..end]
    }

    fn value(&mut self) -> Node<'a> {
        self.skip_space();
        let at = self.at;
        let word = self.word();
        if self.rest().starts_with('"') {
            self.string(word);
            return Node { at, is_named: false, parts: Parts::None };
        }
        if self.take("'") {
            self.take("\\");
            self.at += self.rest().chars().next().map_or(0, char::len_utf8);
            self.skip_past("'");
            return Node { at, is_named: false, parts: Parts::None };
        }
        let end_of_word = self.at;
        self.skip_space();
        let parts = if self.take("(") {
            self.list(')')
        } else if word.is_empty() && self.take("[") {
            self.list(']')
        } else if word.is_empty() && self.take("{") {
            self.list('}')
        } else {
            self.at = end_of_word;
            Parts::None
        };
        Node { at, is_named: !word.is_empty(), parts }
    }

    /// A string behind its prefix: `r#` and the like for raw ones, which have no escapes.
    pub fn string(&mut self, prefix: &str) {
        self.at += 1;
        if prefix.contains('r') {
            return self.skip_past(&format!("\"{}", "#".repeat(prefix.matches('#').count())));
        }
        while let Some(c) = self.rest().chars().next() {
            self.at += c.len_utf8();
            match c {
                '"' => return,
                '\\' => self.at += self.rest().chars().next().map_or(0, char::len_utf8),
                _ => {}
            }
        }
    }

    /// Reads the values between brackets. An entry of a map counts as its value; so does a field, with its name.
    fn list(&mut self, end: char) -> Parts<'a> {
        let (mut fields, mut items) = (Vec::new(), Vec::new());
        loop {
            self.skip_space();
            if self.rest().is_empty() || self.take(end.encode_utf8(&mut [0; 4])) {
                break;
            }
            let before = self.at;
            let node = self.value();
            let (at, name) = (node.at, self.text[node.at..self.at].trim_start_matches("r#"));
            self.skip_space();
            if self.take(":") {
                let value = self.value();
                if end == ')' {
                    fields.push(Field { name, at, value });
                } else {
                    items.push(value);
                }
                self.skip_space();
            } else {
                items.push(node);
            }
            // The text was accepted before; should the two readers ever disagree, this one still moves on.
            if !self.take(",") && self.at == before {
                self.at += self.rest().chars().next().map_or(0, char::len_utf8);
            }
        }
        if fields.is_empty() { Parts::Items(items) } else { Parts::Fields(fields) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Step::{Entry, Field, Index};

    #[test]
    fn values_are_found_past_comments_strings_and_wrappers() {
        let text = r##"#![enable(implicit_some)]
// a ( comment
Scene(
    a: "text with ) and \" in it", /* block /* nested */ ( */
    b: r#"raw " string"#, c: '"',
    list: [1, (x: -2.5e3, y: Some(spot(range: 7)))],
    map: { "é": (1), "two": kind (deep: [[], [5]]) },
)"##;
        let at = |steps: &[Step]| find(text, steps);
        assert_eq!(at(&[]), (3, 1));
        assert_eq!(at(&[Field("c")]), (5, 30));
        assert_eq!(at(&[Field("list"), Index(1), Field("x")]), (6, 19));
        assert_eq!(at(&[Field("list"), Index(1), Field("y"), Field("range")]), (6, 47));
        assert_eq!(at(&[Field("map"), Entry(1), Field("deep"), Index(1), Index(0)]), (7, 47));
        assert_eq!(at(&[Field("list"), Index(1), Field("absent"), Index(3)]), (6, 15));
        assert_eq!(find("(a: list([1, 2]), b: [(3, 4)])", &[Field("a"), Index(1)]), (1, 14));
        assert_eq!(find("(a: list([1, 2]), b: [(3, 4)])", &[Field("b"), Index(0)]), (1, 23));
    }

    #[test]
    fn unfinished_text_ends() {
        for text in ["(a: [", "\"abc", "/* x", "((((", "r#\"", "'", ")", "(a:::)", "{,,}"] {
            find(text, &[Field("a"), Index(0)]);
        }
    }
}
