//! Why a URDF cannot be read, and in which line: its reader says neither where nor what would do.

use roxmltree::{Document, Node};

/// The first thing in a URDF that cannot be.
#[derive(Debug, Clone, PartialEq)]
pub struct Misread {
    /// Counted from 1.
    pub line: u32,
    /// With the element, the value and what is allowed.
    pub what: String,
}

/// What an attribute may hold.
#[derive(Clone, Copy)]
enum Holds {
    Text,
    Numbers(usize),
    OneOf(&'static [&'static str]),
}

/// An attribute, what it may hold, and whether it has to be there.
type Attribute = (&'static str, Holds, bool);

/// What an element has to have: attributes, and children of which each of these names one.
struct Rule {
    attributes: &'static [Attribute],
    needs: &'static [&'static str],
    may_have: &'static [&'static str],
}

const NUMBER: Holds = Holds::Numbers(1);
const JOINTS: &[&str] = &["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"];
const SHAPES: &[&str] = &["box", "cylinder", "sphere", "capsule", "mesh"];

/// What the format says of an element, as far as it is read [<https://wiki.ros.org/urdf/XML>]; `None` of what is passed over.
fn rule(tag: &str) -> Option<Rule> {
    let of = |attributes, needs, may_have| Some(Rule { attributes, needs, may_have });
    match tag {
        "robot" => of(&[], &[], &["link", "joint", "material"]),
        "link" => of(&[("name", Holds::Text, true)], &[], &["inertial", "visual", "collision"]),
        "inertial" => of(&[], &["mass", "inertia"], &["origin"]),
        "mass" => of(&[("value", NUMBER, true)], &[], &[]),
        "inertia" => of(
            &[
                ("ixx", NUMBER, true),
                ("ixy", NUMBER, true),
                ("ixz", NUMBER, true),
                ("iyy", NUMBER, true),
                ("iyz", NUMBER, true),
                ("izz", NUMBER, true),
            ],
            &[],
            &[],
        ),
        "origin" => of(&[("xyz", Holds::Numbers(3), false), ("rpy", Holds::Numbers(3), false)], &[], &[]),
        "visual" => of(&[], &["geometry"], &["origin", "material"]),
        "collision" => of(&[], &["geometry"], &["origin"]),
        "geometry" => of(&[], &[], SHAPES),
        "box" => of(&[("size", Holds::Numbers(3), true)], &[], &[]),
        "cylinder" | "capsule" => of(&[("radius", NUMBER, true), ("length", NUMBER, true)], &[], &[]),
        "sphere" => of(&[("radius", NUMBER, true)], &[], &[]),
        "mesh" => of(&[("filename", Holds::Text, true), ("scale", Holds::Numbers(3), false)], &[], &[]),
        "material" => of(&[("name", Holds::Text, true)], &[], &["color", "texture"]),
        "color" => of(&[("rgba", Holds::Numbers(4), true)], &[], &[]),
        "texture" => of(&[("filename", Holds::Text, true)], &[], &[]),
        "joint" => of(
            &[("name", Holds::Text, true), ("type", Holds::OneOf(JOINTS), true)],
            &["parent", "child"],
            &["origin", "axis", "limit", "dynamics", "mimic", "safety_controller", "calibration"],
        ),
        "parent" | "child" => of(&[("link", Holds::Text, true)], &[], &[]),
        "axis" => of(&[("xyz", Holds::Numbers(3), true)], &[], &[]),
        "limit" => of(
            &[
                ("lower", NUMBER, false),
                ("upper", NUMBER, false),
                ("effort", NUMBER, false),
                ("velocity", NUMBER, true),
            ],
            &[],
            &[],
        ),
        "dynamics" => of(&[("damping", NUMBER, false), ("friction", NUMBER, false)], &[], &[]),
        "mimic" => {
            of(&[("joint", Holds::Text, true), ("multiplier", NUMBER, false), ("offset", NUMBER, false)], &[], &[])
        }
        "safety_controller" => of(
            &[
                ("soft_lower_limit", NUMBER, false),
                ("soft_upper_limit", NUMBER, false),
                ("k_position", NUMBER, false),
                ("k_velocity", NUMBER, true),
            ],
            &[],
            &[],
        ),
        "calibration" => of(&[("rising", NUMBER, false), ("falling", NUMBER, false)], &[], &[]),
        _ => None,
    }
}

impl Misread {
    /// What is wrong with `text`, if it is one of the things that are looked for.
    pub(super) fn of(text: &str) -> Option<Misread> {
        let document = match Document::parse(text) {
            Ok(document) => document,
            Err(error) => return Some(Misread { line: error.pos().row, what: format!("no XML: {error}") }),
        };
        let root = document.root_element();
        if root.tag_name().name() != "robot" {
            let what = format!("the outermost element is <{}>; a URDF's is <robot>", root.tag_name().name());
            return Some(Misread { line: line_of(root), what });
        }
        in_element(root)
    }
}

/// What is wrong with an element, or within it.
fn in_element(node: Node<'_, '_>) -> Option<Misread> {
    let tag = node.tag_name().name();
    let rule = rule(tag)?;
    let wrong = |line: u32, what: &str| Some(Misread { line, what: format!("<{tag}>{} {what}", whose(node)) });
    for &(name, holds, is_needed) in rule.attributes {
        match node.attribute_node(name) {
            Some(attribute) if !holds.may_be(attribute.value()) => {
                let line = node.document().text_pos_at(attribute.range().start).row;
                return wrong(line, &format!("has {name}=\"{}\"; it must be {}", attribute.value(), holds.words()));
            }
            None if is_needed => {
                return wrong(line_of(node), &format!("has no `{name}`; it must be {}", holds.words()));
            }
            _ => {}
        }
    }
    let children = || node.children().filter(Node::is_element);
    let has = |name: &str| children().any(|child| child.has_tag_name(name));
    if let Some(missing) = rule.needs.iter().find(|name| !has(name)) {
        return wrong(line_of(node), &format!("has no <{missing}>"));
    }
    if tag == "geometry" && !SHAPES.iter().any(|shape| has(shape)) {
        return wrong(line_of(node), &format!("holds no shape; it must be one of: {}", SHAPES.join(", ")));
    }
    let is_read = |child: &Node<'_, '_>| {
        let name = child.tag_name().name();
        rule.needs.contains(&name) || rule.may_have.contains(&name)
    };
    children().filter(is_read).find_map(in_element)
}

/// The link or joint that an element is, or is of.
fn whose(node: Node<'_, '_>) -> String {
    let owner = node.ancestors().find(|it| it.has_tag_name("link") || it.has_tag_name("joint"));
    let named = owner.and_then(|owner| Some((owner, owner.attribute("name")?)));
    match named {
        None => String::new(),
        Some((owner, name)) if owner == node => format!(" `{name}`"),
        Some((owner, name)) => format!(" of {} `{name}`", owner.tag_name().name()),
    }
}

fn line_of(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

impl Holds {
    fn may_be(self, value: &str) -> bool {
        match self {
            Holds::Text => true,
            Holds::Numbers(count) => {
                let numbers = value.split_whitespace().map(str::parse::<f64>);
                numbers.clone().count() == count && numbers.flatten().count() == count
            }
            Holds::OneOf(allowed) => allowed.contains(&value),
        }
    }

    fn words(self) -> String {
        match self {
            Holds::Text => "a name".to_owned(),
            Holds::Numbers(1) => "a number".to_owned(),
            Holds::Numbers(count) => format!("{count} numbers"),
            Holds::OneOf(allowed) => format!("one of: {}", allowed.join(", ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing is wrong with what can be read.
    #[test]
    fn shipped_robots_are_blamed_for_nothing() {
        let mut robots = 0;
        for file in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/robots")).expect("they are shipped") {
            let path = file.expect("a file").path();
            if path.extension().is_some_and(|extension| extension == "urdf") {
                assert_eq!(Misread::of(&std::fs::read_to_string(&path).expect("text")), None, "{}", path.display());
                robots += 1;
            }
        }
        assert!(robots > 5, "{robots}");
    }
}
