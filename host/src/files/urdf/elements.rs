//! The links and joints of a URDF document, each checked where it stands.

use std::ops::Range;

use ballbar::{JointKind, Pose, Vector3};
use roxmltree::{Document, Node};

use super::super::numbers::Range as Of;
use super::super::problem::{self, Problem};
use super::super::robot::MOST_NAME_BYTES;
use super::super::source::{InputError, Source};
use super::ENCODER_ELEMENT;
use crate::kinematics::from_link;
use crate::units::{ScreenUnit, mm_from_m};

/// Everything that the chain may need.
pub(super) struct UrdfRobot<'a> {
    pub(super) name: &'a str,
    pub(super) links: Vec<UrdfLink<'a>>,
    pub(super) joints: Vec<UrdfJoint<'a>>,
}

pub(super) struct UrdfLink<'a> {
    pub(super) name: &'a str,
    pub(super) span: Range<usize>,
}

pub(super) struct UrdfJoint<'a> {
    pub(super) name: &'a str,
    pub(super) parent: &'a str,
    pub(super) child: &'a str,
    pub(super) span: Range<usize>,
    pub(super) node: Node<'a, 'a>,
}

/// What a joint's `type` lets it do.
pub(super) enum Motion {
    Fixed,
    Moves { kind: JointKind, axis: Vector3<f64>, limits: Limits },
}

/// Limits of the URDF's joint value, radians or metres.
pub(super) enum Limits {
    Between(f64, f64),
    /// A continuous joint.
    None,
}

/// θ = offset + scale · q, radians or metres.
pub(super) struct EncoderModel {
    pub(super) offset: f64,
    pub(super) scale: f64,
}

/// A text cut to what a message can show.
pub(super) fn short(text: &str) -> String {
    const SHOWN: usize = 80;
    problem::short(text, SHOWN)
}

/// The names and ends of all links and joints; what else a joint holds is read when it is on the chain.
pub(super) fn read<'a>(source: &Source, document: &'a Document<'a>) -> Result<UrdfRobot<'a>, InputError> {
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        let found = format!("<{}>", short(root.tag_name().name()));
        return Err(refuse(source, root, "the outermost element", found, "<robot>"));
    }
    check_is_expanded(source, root)?;
    let name = attribute(source, root, "name", "robot")?;
    let children = |tag: &'static str| root.children().filter(move |node| node.has_tag_name(tag));
    let mut links = Vec::new();
    for node in children("link") {
        links.push(UrdfLink { name: attribute(source, node, "name", "link")?, span: node.range() });
    }
    let mut joints = Vec::new();
    for node in children("joint") {
        let name = attribute(source, node, "name", "joint")?;
        let end = |tag: &'static str| match node.children().find(|child| child.has_tag_name(tag)) {
            Some(child) => attribute(source, child, "link", tag),
            None => Err(refuse(source, node, &format!("<{tag}> of joint `{}`", short(name)), "missing".into(), "a link")),
        };
        joints.push(UrdfJoint { name, parent: end("parent")?, child: end("child")?, span: node.range(), node });
    }
    Ok(UrdfRobot { name, links, joints })
}

/// Refuses what is still a program: elements of xacro, or values with `${…}`.
fn check_is_expanded(source: &Source, root: Node<'_, '_>) -> Result<(), InputError> {
    let is_xacro = |node: &Node<'_, '_>| {
        let is_element = node.tag_name().namespace().is_some_and(|namespace| namespace.contains("xacro"));
        is_element || node.attributes().any(|attribute| attribute.value().contains("${"))
    };
    match root.descendants().find(is_xacro) {
        None => Ok(()),
        Some(node) => Err(InputError::at(source, opening(source, &node.range()), Problem::Xacro)),
    }
}

impl UrdfJoint<'_> {
    /// The child's frame in the parent's, the joint at zero.
    pub(super) fn parent_from_child(&self, source: &Source) -> Result<Pose<f64>, InputError> {
        let Some(origin) = self.child_element("origin") else { return Ok(from_link(Vector3::zeros(), [0.0; 3])) };
        let translation_m = self.vector(source, origin, "xyz", mm_from_m)?.unwrap_or_default();
        let [roll, pitch, yaw] = self.vector(source, origin, "rpy", f64::to_degrees)?.unwrap_or_default();
        Ok(from_link(translation_m.into(), [yaw, pitch, roll]))
    }

    pub(super) fn motion(&self, source: &Source) -> Result<Motion, InputError> {
        const TYPES: &str = "revolute, continuous, prismatic or fixed on the chain";
        let found = attribute(source, self.node, "type", "joint")?;
        let kind = match found {
            "fixed" => return Ok(Motion::Fixed),
            "revolute" | "continuous" => JointKind::Revolute,
            "prismatic" => JointKind::Prismatic,
            _ => return Err(refuse(source, self.node, &self.what("type"), format!("`{}`", short(found)), TYPES)),
        };
        if let Some(mimic) = self.child_element("mimic") {
            let (what, found) = (format!("joint `{}`", short(self.name)), "moved along by another joint".to_owned());
            return Err(refuse(source, mimic, &what, found, "one that moves by itself between --base and --tip"));
        }
        let limits = if found == "continuous" { Limits::None } else { self.limits(source, kind)? };
        Ok(Motion::Moves { kind, axis: self.axis(source)?, limits })
    }

    /// Our own element; `None` in the files of others.
    pub(super) fn encoder(&self, source: &Source, kind: JointKind) -> Result<Option<EncoderModel>, InputError> {
        let Some(element) = self.child_element(ENCODER_ELEMENT) else { return Ok(None) };
        let offset = self.value(source, element, "offset", kind)?.unwrap_or(0.0);
        let scale = self.number(source, element, "scale", |value| Of::Scale.contains(value), Of::Scale.words())?.unwrap_or(1.0);
        Ok(Some(EncoderModel { offset, scale }))
    }

    fn axis(&self, source: &Source) -> Result<Vector3<f64>, InputError> {
        const LEAST: f64 = 1e-6;
        let Some(element) = self.child_element("axis") else { return Ok(Vector3::x()) };
        let axis = self.vector(source, element, "xyz", mm_from_m)?.map_or_else(Vector3::x, Vector3::from);
        let refused = || refuse(source, element, &self.what("axis"), "of no length".into(), "a direction");
        axis.try_normalize(LEAST).ok_or_else(refused)
    }

    fn limits(&self, source: &Source, kind: JointKind) -> Result<Limits, InputError> {
        let Some(element) = self.child_element("limit") else {
            return Err(refuse(source, self.node, &self.what("<limit>"), "missing".into(), "one: this joint is not continuous"));
        };
        let lower = self.value(source, element, "lower", kind)?.unwrap_or(0.0);
        let upper = self.value(source, element, "upper", kind)?.unwrap_or(0.0);
        if lower < upper {
            return Ok(Limits::Between(lower, upper));
        }
        let found = format!("{lower} to {upper}");
        Err(refuse(source, element, &self.what("limit"), found, "a lower limit below the upper one"))
    }

    fn child_element(&self, tag: &str) -> Option<Node<'_, '_>> {
        self.node.children().find(|child| child.has_tag_name(tag))
    }

    fn what(&self, part: &str) -> String {
        format!("{part} of joint `{}`", short(self.name))
    }

    /// A value of a joint, radians or metres, as plausible as it would be in a file of ours.
    fn value(&self, source: &Source, node: Node<'_, '_>, name: &str, kind: JointKind) -> Result<Option<f64>, InputError> {
        let expected = match kind {
            JointKind::Revolute => "a number from -17453 to 17453, radians; a joint without limits is `continuous`",
            JointKind::Prismatic => "a number from -1000 to 1000, metres",
        };
        self.number(source, node, name, |value| Of::Plausible.contains(ScreenUnit::from(kind).from_si(value)), expected)
    }

    fn number(
        &self,
        source: &Source,
        node: Node<'_, '_>,
        name: &str,
        is_in_range: impl Fn(f64) -> bool,
        expected: &'static str,
    ) -> Result<Option<f64>, InputError> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        match text.trim().parse() {
            Ok(value) if is_in_range(value) => Ok(Some(value)),
            _ => Err(refuse(source, node, &self.what(name), format!("`{}`", short(text)), expected)),
        }
    }

    /// Three numbers, each plausible as a file of ours has it.
    fn vector(
        &self,
        source: &Source,
        node: Node<'_, '_>,
        name: &str,
        on_screen: fn(f64) -> f64,
    ) -> Result<Option<[f64; 3]>, InputError> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        let mut words = text.split_ascii_whitespace().map(str::parse::<f64>);
        let numbers = (words.next(), words.next(), words.next(), words.next());
        if let (Some(Ok(x)), Some(Ok(y)), Some(Ok(z)), None) = numbers
            && [x, y, z].into_iter().all(|value| Of::Plausible.contains(on_screen(value)))
        {
            return Ok(Some([x, y, z]));
        }
        let expected = "three numbers, metres or radians, parted by spaces";
        Err(refuse(source, node, &self.what(name), format!("`{}`", short(text)), expected))
    }
}

/// A name: there, not empty, not endless, without control characters.
fn attribute<'a>(source: &Source, node: Node<'a, 'a>, name: &str, tag: &str) -> Result<&'a str, InputError> {
    let what = format!("`{name}` of a <{tag}>");
    let Some(value) = node.attribute(name) else {
        return Err(refuse(source, node, &what, "missing".into(), "a name"));
    };
    if value.is_empty() || value.len() > MOST_NAME_BYTES || value.chars().any(char::is_control) {
        let found = format!("`{}`, {} bytes long", short(value), value.len());
        return Err(refuse(source, node, &what, found, "a name of 1 to 200 bytes without control characters"));
    }
    Ok(value)
}

fn refuse(source: &Source, node: Node<'_, '_>, what: &str, found: String, expected: &'static str) -> InputError {
    let problem = Problem::Urdf { what: what.to_owned(), found, expected };
    InputError::at(source, opening(source, &node.range()), problem)
}

/// The first line of an element: messages point at it, not at all that the element holds.
pub(super) fn opening(source: &Source, span: &Range<usize>) -> Range<usize> {
    let text = &source.text()[span.clone()];
    span.start..span.start + text.find('\n').unwrap_or(text.len())
}
