//! The elements and attributes of an XSD as a table, and the check of a description against it, with positions.
//!
//! The tables themselves are [`super::schema2`] and [`super::schema3`].

use super::super::description::{parse_boolean, parse_integer, parse_real};
use super::super::xml::Element;
use super::date::is_date_time;
use super::finding::Findings;
use super::id;

/// Type of an attribute.
#[derive(Debug, Clone, Copy)]
pub(super) enum Type {
    /// `xs:string` or `xs:normalizedString`.
    Text,
    Bool,
    Int,
    Unsigned,
    Double,
    DateTime,
    Keyword(&'static [&'static str]),
    UnsignedList,
    KeywordList(&'static [&'static str]),
    /// An integer from one to another, both included.
    IntRange(i128, i128),
    /// `xs:unsignedLong`.
    UnsignedLong,
    /// Numbers, for the elements of an array.
    DoubleList,
    IntRangeList(i128, i128),
    BoolList,
    /// `xs:hexBinary`.
    Hex,
}

/// An attribute: name, type, whether it is required.
pub(super) type Attr = (&'static str, Type, bool);

/// How children follow each other.
#[derive(Debug, Clone, Copy)]
pub(super) enum Children {
    /// In this order: name, smallest number, largest number.
    Sequence(&'static [(&'static Node, usize, usize)]),
    /// As a sequence, and the element may have attributes of others.
    Open(&'static [(&'static Node, usize, usize)]),
    /// One or more of these, in any order.
    Mixed(&'static [&'static Node]),
    /// Anything.
    Any,
}

/// An element.
#[derive(Debug)]
pub(super) struct Node {
    pub name: &'static str,
    pub attributes: &'static [Attr],
    /// One of these must be the first child.
    pub choice: &'static [&'static Node],
    pub children: Children,
}

pub(super) const MANY: usize = usize::MAX;
use Type::{
    Bool, BoolList, DateTime, Double, DoubleList, Hex, Int, IntRange, IntRangeList, Keyword, KeywordList, Text,
    Unsigned, UnsignedList, UnsignedLong,
};

pub(super) const fn leaf(name: &'static str, attributes: &'static [Attr]) -> Node {
    Node { name, attributes, choice: &[], children: Children::Sequence(&[]) }
}

pub(super) const fn parent(
    name: &'static str,
    attributes: &'static [Attr],
    children: &'static [(&'static Node, usize, usize)],
) -> Node {
    Node { name, attributes, choice: &[], children: Children::Sequence(children) }
}

pub(super) static BASE_UNIT: Node = leaf(
    "BaseUnit",
    &[
        ("kg", Int, false),
        ("m", Int, false),
        ("s", Int, false),
        ("A", Int, false),
        ("K", Int, false),
        ("mol", Int, false),
        ("cd", Int, false),
        ("rad", Int, false),
        ("factor", Double, false),
        ("offset", Double, false),
    ],
);
pub(super) fn element(e: &Element, node: &Node, findings: &mut Findings) {
    if matches!(node.children, Children::Any) {
        // Required attributes still count; what else is there does not.
        required(e, node, findings);
        return;
    }
    attributes(e, node, findings);
    if e.has_text {
        findings.at(
            id::SCHEMA_ELEMENT,
            e.position,
            format!("the element {} holds text, which has no place there", e.name),
        );
    }
    let mut children = e.children.as_slice();
    if !node.choice.is_empty() {
        let names: Vec<&str> = node.choice.iter().map(|n| n.name).collect();
        let first = children.first().and_then(|c| Some((c, node.choice.iter().find(|n| n.name == c.name)?)));
        let Some((child, node)) = first else {
            let message = format!("the element {} must begin with one of {}", e.name, names.join(", "));
            findings.at(id::SCHEMA_ELEMENT, e.position, message);
            return;
        };
        element(child, node, findings);
        children = &children[1..];
    }
    sequence(e, children, node, findings);
}

/// That one of the interfaces is there.
pub(super) fn needs_interface(root: &Element, interfaces: &[&Node], findings: &mut Findings) {
    if !root.children.iter().any(|c| interfaces.iter().any(|node| node.name == c.name)) {
        let names: Vec<&str> = interfaces.iter().map(|node| node.name).collect();
        let message = format!("there is none of the elements {}", names.join(", "));
        findings.at(id::INTERFACE_MISSING, root.position, message);
    }
}

fn mixed(e: &Element, nodes: &[&Node], findings: &mut Findings) {
    for child in &e.children {
        match nodes.iter().find(|n| n.name == child.name) {
            Some(node) => element(child, node, findings),
            None => {
                findings.at(id::SCHEMA_ELEMENT, child.position, format!("{} has no place in {}", child.name, e.name));
            }
        }
    }
    if e.children.is_empty() {
        findings.at(id::SCHEMA_ELEMENT, e.position, format!("{} has no elements", e.name));
    }
}

pub(super) fn sequence(e: &Element, children: &[Element], node: &Node, findings: &mut Findings) {
    if let Children::Mixed(nodes) = node.children {
        return mixed(e, nodes, findings);
    }
    let (Children::Sequence(expected) | Children::Open(expected)) = node.children else { return };
    let mut counts = vec![0_usize; expected.len()];
    let mut current = 0;
    for child in children {
        let Some(index) = expected.iter().position(|(n, ..)| n.name == child.name) else {
            // The two interfaces are counted by the caller when they are out of place.
            findings.at(id::SCHEMA_ELEMENT, child.position, format!("{} has no place in {}", child.name, e.name));
            continue;
        };
        if index < current {
            let before = expected[current].0.name;
            findings.at(id::SCHEMA_ELEMENT, child.position, format!("{} must come before {before}", child.name));
        }
        current = current.max(index);
        counts[index] += 1;
        if counts[index] > expected[index].2 {
            findings.at(id::SCHEMA_ELEMENT, child.position, format!("a second {} element in {}", child.name, e.name));
        }
        element(child, expected[index].0, findings);
    }
    for ((node, least, _), count) in expected.iter().zip(counts) {
        if count < *least {
            findings.at(id::SCHEMA_ELEMENT, e.position, format!("{} has no {} element", e.name, node.name));
        }
    }
}

fn required(e: &Element, node: &Node, findings: &mut Findings) {
    for (name, _, required) in node.attributes {
        if *required && e.get(name).is_none() {
            findings.at(id::SCHEMA_REQUIRED, e.position, format!("{} has no {name} attribute", describe(e)));
        }
    }
}

/// The element with its name attribute, where it has one.
fn describe(e: &Element) -> String {
    match e.get("name") {
        Some(name) => format!("{} \"{name}\"", e.name),
        None => e.name.clone(),
    }
}

pub(super) fn attributes(e: &Element, node: &Node, findings: &mut Findings) {
    required(e, node, findings);
    for attribute in &e.attributes {
        let name = attribute.name.as_str();
        // Namespace declarations and attributes of other namespaces (xsi:schemaLocation) are XML's, not FMI's.
        if name == "xmlns" || name.contains(':') {
            continue;
        }
        let Some((_, kind, _)) = node.attributes.iter().find(|(n, ..)| *n == name) else {
            if matches!(node.children, Children::Open(_)) {
                continue;
            }
            findings.at(
                id::SCHEMA_ATTRIBUTE,
                attribute.position,
                format!("{} has an attribute {name}, which the schema does not define there", describe(e)),
            );
            continue;
        };
        if let Err(expected) = fits(&attribute.value, *kind) {
            let rule = if matches!(kind, DateTime) { id::DATE_TIME } else { id::SCHEMA_VALUE };
            let message = format!("{}: {name}=\"{}\" is not {expected}", describe(e), attribute.value);
            findings.at(rule, attribute.position, message);
        }
    }
}

fn fits(value: &str, kind: Type) -> Result<(), String> {
    let (good, expected) = match kind {
        Text => (true, String::new()),
        Bool => (parse_boolean(value).is_some(), "a boolean (true, false, 1 or 0)".into()),
        Int => (parse_integer::<i32>(value).is_some(), "a 32-bit integer".into()),
        Unsigned => (parse_integer::<u32>(value).is_some(), "an unsigned 32-bit integer".into()),
        Double => (parse_real(value).is_some(), "a number".into()),
        DateTime => (is_date_time(value), "a date and time such as 2009-12-08T14:33:22Z".into()),
        Keyword(keywords) => (keywords.contains(&value), format!("one of {}", keywords.join(", "))),
        UnsignedList => {
            (value.split_whitespace().all(|v| v.parse::<u32>().is_ok()), "a list of unsigned integers".into())
        }
        IntRange(low, high) => (is_integer(value, low, high), format!("a whole number from {low} to {high}")),
        UnsignedLong => (value.trim().parse::<u64>().is_ok(), "an unsigned 64-bit integer".into()),
        DoubleList => (value.split_whitespace().all(|v| parse_real(v).is_some()), "a list of numbers".into()),
        IntRangeList(low, high) => (
            value.split_whitespace().all(|v| is_integer(v, low, high)),
            format!("a list of whole numbers from {low} to {high}"),
        ),
        BoolList => (value.split_whitespace().all(|v| parse_boolean(v).is_some()), "a list of booleans".into()),
        Hex => (
            value.len().is_multiple_of(2) && value.bytes().all(|b| b.is_ascii_hexdigit()),
            "an even number of hexadecimal digits".into(),
        ),
        KeywordList(keywords) => {
            (value.split_whitespace().all(|v| keywords.contains(&v)), format!("a list of {}", keywords.join(", ")))
        }
    };
    if good { Ok(()) } else { Err(expected) }
}

fn is_integer(text: &str, low: i128, high: i128) -> bool {
    text.trim().parse::<i128>().is_ok_and(|value| (low..=high).contains(&value))
}
