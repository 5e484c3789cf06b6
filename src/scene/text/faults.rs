//! Suggestions for unknown names.

/// `unknown material "brik"; did you mean "brick"?`, or the names there are where none is near.
pub fn unknown<'n>(kind: &str, name: &str, known: impl Iterator<Item = &'n str>) -> String {
    let known: Vec<&str> = known.collect();
    format!("unknown {kind} {name:?}{}", suggestion(name, &known))
}

/// The end of a message about an unknown name.
pub fn suggestion(name: &str, known: &[&str]) -> String {
    // Comparing costs the product of the lengths; no name of a thousand letters is meant.
    let comparable: Vec<&str> = known.iter().copied().filter(|k| k.len() + name.len() < 200).collect();
    if let Some(near) = crate::name::nearest(&comparable, name) {
        return format!("; did you mean {near:?}?");
    }
    if known.is_empty() {
        return "; none are defined".into();
    }
    let shown: Vec<String> = known.iter().take(12).map(|k| format!("{k:?}")).collect();
    let more = if known.len() > shown.len() { ", …" } else { "" };
    format!("; expected one of {}{more}", shown.join(", "))
}
