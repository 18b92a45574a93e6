//! The grammar of the structured naming convention (FMI 2.0.4, section 2.2.9), and C identifiers.

/// Whether a text is an identifier of C.
pub(super) fn is_c_identifier(text: &str) -> bool {
    let start = |b: u8| b.is_ascii_alphabetic() || b == b'_';
    text.bytes().next().is_some_and(start) && text.bytes().all(|b| start(b) || b.is_ascii_digit())
}

/// Whether a name follows the structured convention:
///
/// ```text
/// name       = identifier | "der(" identifier ["," unsigned] ")"
/// identifier = B-name [indices] { "." B-name [indices] }
/// B-name     = nondigit { digit | nondigit } | Q-name
/// Q-name     = "'" ( Q-char | escape ) { Q-char | escape } "'"
/// indices    = "[" unsigned { "," unsigned } "]"
/// ```
///
/// Tools write spaces after commas, and letters beyond ASCII inside quotes; both are let pass.
pub(super) fn is_structured(name: &str) -> bool {
    let mut rest = name;
    if let Some(inner) = name.strip_prefix("der(") {
        rest = inner;
        if !identifier(&mut rest) {
            return false;
        }
        if let Some(order) = rest.strip_prefix(',') {
            rest = order.trim_start();
            if !unsigned(&mut rest) {
                return false;
            }
        }
        return rest == ")";
    }
    identifier(&mut rest) && rest.is_empty()
}

fn identifier(rest: &mut &str) -> bool {
    loop {
        if !b_name(rest) {
            return false;
        }
        if let Some(indices) = rest.strip_prefix('[') {
            *rest = indices;
            loop {
                *rest = rest.trim_start();
                if !unsigned(rest) {
                    return false;
                }
                match rest.strip_prefix(',') {
                    Some(next) => *rest = next,
                    None => break,
                }
            }
            match rest.strip_prefix(']') {
                Some(next) => *rest = next,
                None => return false,
            }
        }
        match rest.strip_prefix('.') {
            Some(next) => *rest = next,
            None => return true,
        }
    }
}

fn b_name(rest: &mut &str) -> bool {
    if let Some(quoted) = rest.strip_prefix('\'') {
        let mut escaped = false;
        for (at, c) in quoted.char_indices() {
            if escaped {
                if !"'\"?\\abfnrtv".contains(c) {
                    return false;
                }
                escaped = false;
            } else if c == '\\' {
                escaped = true;
            } else if c == '\'' {
                *rest = &quoted[at + 1..];
                return at > 0;
            }
        }
        return false;
    }
    let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
    let good = end > 0 && !rest.as_bytes()[0].is_ascii_digit();
    *rest = &rest[end..];
    good
}

fn unsigned(rest: &mut &str) -> bool {
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    *rest = &rest[end..];
    end > 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn structured_names_follow_the_grammar() {
        for good in [
            "a",
            "_a1.b",
            "a[1].b[2,3]",
            "der(x)",
            "der(a.b[1],2)",
            "'#123'",
            "a.b.mod[3,4].'#123'.c",
            "'it\\'s'",
            "robot.axis.'motor #234'",
            "der('x y')",
        ] {
            assert!(is_structured(good), "{good}");
        }
        for bad in
            ["", "1a", "a b", "a.", ".a", "a[", "a[]", "a[x]", "der(x", "der()", "''", "'a", "a-b", "der(x,)", "'\\q'"]
        {
            assert!(!is_structured(bad), "{bad}");
        }
    }
}
