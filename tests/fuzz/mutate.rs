//! Files with some of them changed: text by its words, numbers and brackets, anything else by its bytes.

use fastrand::Rng;

/// Numbers at and beyond the limits of what reads them.
const NUMBERS: [&str; 24] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "0.5",
    "1e-45",
    "1e-38",
    "1e-7",
    "1e38",
    "-1e38",
    "3.5e38",
    "1e308",
    "1e999",
    "inf",
    "NaN",
    "255",
    "65535",
    "65536",
    "2147483647",
    "-2147483648",
    "4294967295",
    "4294967296",
    "18446744073709551615",
];

/// Changes a text at one to four places, or its bytes.
pub fn text(text: &mut Vec<u8>, random: &mut Rng) {
    for _ in 0..=random.usize(..4) {
        let tokens = tokens(text);
        if tokens.is_empty() || random.u8(..8) == 0 {
            binary(text, random);
            continue;
        }
        let token = tokens[random.usize(..tokens.len())].clone();
        let other = text[tokens[random.usize(..tokens.len())].clone()].to_vec();
        let kind = text[token.start];
        let replacement = match (kind, random.u8(..6)) {
            (b'0'..=b'9' | b'-' | b'.', 0..=3) => NUMBERS[random.usize(..NUMBERS.len())].as_bytes().to_vec(),
            (b'(' | b'[' | b'{', choice) => {
                group(text, token.start, choice, random);
                continue;
            }
            (_, 0..=1) => Vec::new(),
            (_, 2) => [&text[token.clone()], b" ", &text[token.clone()]].concat(),
            // Another word of the text, where words stand.
            _ => other,
        };
        text.splice(token, replacement);
    }
}

/// Deletes what is in brackets, has it twice or a thousand times, puts another in its place, or nests it.
fn group(text: &mut Vec<u8>, open: usize, choice: u8, random: &mut Rng) {
    let range = open..closing(text, open);
    let whole = text[range.clone()].to_vec();
    let replacement = match choice {
        0 => Vec::new(),
        1 => vec![text[open], closer(text[open])],
        2 => [&whole[..], b", ", &whole].concat(),
        3 if whole.len() < 64 => [&whole[..], b", "].concat().repeat(1 << random.u8(..9)),
        4 => {
            let depth = 1 << random.u8(..10);
            [vec![text[open]; depth], whole, vec![closer(text[open]); depth]].concat()
        }
        _ => {
            let starts: Vec<usize> = (0..text.len()).filter(|&i| text[i] == text[open]).collect();
            let start = starts[random.usize(..starts.len())];
            text[start..closing(text, start)].to_vec()
        }
    };
    text.splice(range, replacement);
}

fn closer(open: u8) -> u8 {
    match open {
        b'(' => b')',
        b'[' => b']',
        _ => b'}',
    }
}

/// Behind the bracket that closes the one at `open`, or the end.
fn closing(text: &[u8], open: usize) -> usize {
    let mut depth = 0;
    for (i, byte) in text.iter().enumerate().skip(open) {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' if depth == 1 => return i + 1,
            b')' | b']' | b'}' => depth -= 1,
            _ => {}
        }
    }
    text.len()
}

/// Words, numbers, strings, and single signs.
fn tokens(text: &[u8]) -> Vec<std::ops::Range<usize>> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while at < text.len() {
        let start = at;
        at += 1;
        let is_word = |b: u8| b.is_ascii_alphanumeric() || b"_.+-".contains(&b);
        match text[start] {
            b if b.is_ascii_whitespace() => continue,
            b'"' => {
                at += text[at..].iter().position(|&b| b == b'"').map_or(text.len() - at, |end| end + 1);
            }
            b if is_word(b) => at += text[at..].iter().position(|&b| !is_word(b)).unwrap_or(text.len() - at),
            _ => {}
        }
        tokens.push(start..at);
    }
    tokens
}

/// Changes bytes at one to eight places: a bit, a byte, a number at its limits, a part left out, doubled or cut off.
pub fn binary(bytes: &mut Vec<u8>, random: &mut Rng) {
    for _ in 0..=random.usize(..8) {
        if bytes.is_empty() {
            bytes.push(random.u8(..));
        }
        // Headers decide more than what follows.
        let near = if random.bool() { bytes.len().min(64) } else { bytes.len() };
        let at = random.usize(..near);
        let end = (at + 1 + random.usize(..32)).min(bytes.len());
        match random.u8(..8) {
            0 => bytes[at] ^= 1 << random.u8(..8),
            1 => bytes[at] = random.u8(..),
            2 => {
                let number = [0, 1, 0x7f, 0x80, 0xff, 0x7fff, 0xffff, 1 << 16, i32::MAX as u32, u32::MAX];
                let number = number[random.usize(..number.len())];
                let word = if random.bool() { number.to_le_bytes() } else { number.to_be_bytes() };
                let end = (at + 4).min(bytes.len());
                bytes[at..end].copy_from_slice(&word[..end - at]);
            }
            3 => _ = bytes.drain(at..end),
            4 => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            5 => {
                let part = bytes[at..end].to_vec();
                let to = random.usize(..=bytes.len() - part.len());
                bytes[to..to + part.len()].copy_from_slice(&part);
            }
            6 if random.u8(..4) == 0 => bytes.truncate(at),
            _ => bytes.insert(at, random.u8(..)),
        }
    }
}
