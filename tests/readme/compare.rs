//! Output against what is shown of it: words as they stand, numbers within their printed digits, `...` for lines that are left out.

/// Below this both numbers are the rounding of the machine (as the standard error of a record without noise): of them only the size of
/// the field is compared, not the digits.
const ROUNDING: f64 = 1e-9;

/// A piece of a line.
#[derive(Debug, PartialEq)]
enum Piece {
    Word(String),
    /// Value, and one unit of its last printed digit.
    Number(f64, f64),
}

/// The lines in order, `...` for any.
pub fn same(shown: &[String], said: &str) -> Result<(), String> {
    if shown.is_empty() {
        return Ok(());
    }
    let said: Vec<&str> = said.trim_end().lines().collect();
    let mut at = 0;
    let mut floating = false;
    for part in shown.split(|l| l == "...") {
        if part.is_empty() {
            floating = true;
            continue;
        }
        let fits = |k: usize| said.len() >= k + part.len() && part.iter().zip(&said[k..]).all(|(a, b)| alike(a, b));
        let found = if floating { (at..said.len()).find(|k| fits(*k)) } else { fits(at).then_some(at) };
        let Some(found) = found else {
            // The place that agrees longest, to say which line differs.
            let agrees =
                |k: usize| part.iter().zip(&said[k.min(said.len())..]).take_while(|(a, b)| alike(a, b)).count();
            let best = (at..said.len().max(at + 1)).max_by_key(|k| agrees(*k)).filter(|_| floating).unwrap_or(at);
            let line = agrees(best);
            return Err(format!(
                "shown is\n  {:?}\nand printed\n  {:?}\nof\n{}",
                part.get(line).map_or("", String::as_str),
                said.get(best + line).unwrap_or(&""),
                said.join("\n")
            ));
        };
        at = found + part.len();
        floating = true;
    }
    let open = shown.last().is_some_and(|l| l == "...");
    if !open && at != said.len() {
        return Err(format!("more is printed than shown: {:?}", said[at]));
    }
    Ok(())
}

fn alike(shown: &str, said: &str) -> bool {
    let (shown, said) = (pieces(shown), pieces(said));
    let number = |a: f64, unit: f64, b: f64| (a - b).abs() <= 1.001 * unit || a.abs().max(b.abs()) < ROUNDING;
    shown.len() == said.len()
        && shown.iter().zip(&said).all(|(a, b)| match (a, b) {
            (Piece::Number(a, unit), Piece::Number(b, _)) => number(*a, *unit, *b),
            (a, b) => a == b,
        })
}

/// Words and numbers; how many blanks stand between them is not kept.
fn pieces(line: &str) -> Vec<Piece> {
    let chars: Vec<char> = line.chars().collect();
    let mut all = Vec::new();
    let mut word = String::new();
    let mut k = 0;
    while k < chars.len() {
        let inside_word = word.chars().last().is_some_and(|c| c.is_alphanumeric() || c == '_');
        if !inside_word && let Some((value, unit, length)) = number(&chars[k..]) {
            if !word.is_empty() {
                all.push(Piece::Word(std::mem::take(&mut word)));
            }
            all.push(Piece::Number(value, unit));
            k += length;
            continue;
        }
        if chars[k].is_whitespace() {
            if !word.is_empty() {
                all.push(Piece::Word(std::mem::take(&mut word)));
            }
        } else {
            word.push(chars[k]);
        }
        k += 1;
    }
    if !word.is_empty() {
        all.push(Piece::Word(word));
    }
    all
}

/// The number at the start, with the unit of its last digit and its length.
fn number(chars: &[char]) -> Option<(f64, f64, usize)> {
    let mut end = usize::from(chars.first() == Some(&'-'));
    let digits = |from: usize| chars[from.min(chars.len())..].iter().take_while(|c| c.is_ascii_digit()).count();
    let whole = digits(end);
    if whole == 0 {
        return None;
    }
    end += whole;
    let mut decimals = 0;
    if chars.get(end) == Some(&'.') && digits(end + 1) > 0 {
        decimals = digits(end + 1);
        end += 1 + decimals;
    }
    let mut exponent = 0;
    if chars.get(end) == Some(&'e') {
        let sign = usize::from(chars.get(end + 1) == Some(&'-'));
        let length = digits(end + 1 + sign);
        if length > 0 {
            let text: String = chars[end + 1..end + 1 + sign + length].iter().collect();
            exponent = text.parse().ok()?;
            end += 1 + sign + length;
        }
    }
    let value: f64 = chars[..end].iter().collect::<String>().parse().ok()?;
    Some((value, 10f64.powi(exponent - i32::try_from(decimals).ok()?), end))
}

#[test]
fn numbers_are_alike_within_their_digits_and_words_as_they_stand() {
    assert!(alike("I1   4.803e-3 ± 1.9e-5 kg.m2", "I1 4.804e-3 ± 1.8e-5  kg.m2"));
    assert!(!alike("I1 4.803e-3 kg.m2", "I1 4.805e-3 kg.m2"));
    assert!(!alike("theta1 >99.99 %", "theta2 >99.99 %"));
    assert!(alike("1.2e-12 %", "8.1e-13 %") && !alike("12 %", "14 %") && !alike("a 1", "a b"));
    let shown = |lines: &[&str]| lines.iter().map(|l| (*l).to_owned()).collect::<Vec<_>>();
    assert!(same(&shown(&["a", "...", "c 1"]), "a\nb\nc 1\n").is_ok());
    assert!(same(&shown(&["a", "c 1"]), "a\nb\nc 1\n").is_err());
    assert!(same(&shown(&["a"]), "a\nb\n").is_err() && same(&shown(&["a", "..."]), "a\nb\n").is_ok());
    assert!(same(&shown(&["...", "b"]), "a\nb\nc").is_err());
}
