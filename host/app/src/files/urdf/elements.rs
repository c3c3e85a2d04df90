//! The links and joints of a URDF document, each checked where it stands.

use std::ops::Range;

use ballbar::{JointKind, Pose, Vector3};
use ballbar_calib::kinematics::from_link;
use nalgebra::{Quaternion, UnitQuaternion};
use roxmltree::{Document, Node};

use super::super::numbers::Range as Of;
use super::super::problem::{self, Problem};
use super::super::robot::MOST_NAME_BYTES;
use super::super::source::{InputError, Source};
use super::ENCODER_ELEMENT;
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
    /// From 0 to 0, which is what URDF takes for limits that are not given.
    Zero,
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
        let translation_m: Vector3<f64> = self.numbers(source, origin, "xyz", mm_from_m)?.unwrap_or_default().into();
        let rpy = self.numbers(source, origin, "rpy", f64::to_degrees)?;
        let Some(quaternion) = self.quaternion(source, origin)? else {
            let [roll, pitch, yaw] = rpy.unwrap_or_default();
            return Ok(from_link(translation_m, [yaw, pitch, roll]));
        };
        if rpy.is_some() {
            let (what, found) = (self.what("origin"), "both rpy and quat_xyzw".to_owned());
            return Err(refuse(source, origin, &what, found, "one of them"));
        }
        Ok(Pose { rotation: quaternion.to_rotation_matrix().into_inner(), translation_m })
    }

    /// The turn of URDF 1.1, which the readers of 1.0 pass over.
    fn quaternion(&self, source: &Source, origin: Node<'_, '_>) -> Result<Option<UnitQuaternion<f64>>, InputError> {
        const LEAST: f64 = 1e-6;
        let Some([x, y, z, w]) = self.numbers(source, origin, "quat_xyzw", |value| value)? else { return Ok(None) };
        let refused = || refuse(source, origin, &self.what("quat_xyzw"), "of no length".into(), "a unit quaternion");
        UnitQuaternion::try_new(Quaternion::new(w, x, y, z), LEAST).ok_or_else(refused).map(Some)
    }

    /// What a user should know of a joint that moves: what of it has no place in a robot file, and what looks like a mistake.
    pub(super) fn remarks(&self, source: &Source, motion: &Motion) -> Vec<String> {
        /// A turn more than any joint in radians is likely to make either way, and a hundredth.
        const MOST_RAD: f64 = 1.01 * std::f64::consts::TAU;
        let place = |element: Node<'_, '_>| format!("{}:{}", source.name(), source.line_of(element.range().start));
        let says = |element: Node<'_, '_>, what: String| format!("{}: joint `{}`: {what}", place(element), short(self.name));
        let mut remarks = Vec::new();
        if let Some(element) = self.child_element("calibration") {
            let what = "<calibration> is not read: where the encoder meets its reference is not known here, and the joint's zero stays \
                        where the origin has it";
            remarks.push(says(element, what.to_owned()));
        }
        let Motion::Moves { kind, limits, .. } = motion else { return remarks };
        let element = self.child_element("limit").unwrap_or(self.node);
        remarks.extend(match limits {
            Limits::None => Some(format!("joint `{}` has no limits: it was given a turn, -180 to 180 degrees", short(self.name))),
            Limits::Zero => Some(says(element, "a <limit> from 0 to 0 is none: it was given a turn, -180 to 180 degrees".to_owned())),
            &Limits::Between(lower, upper) if *kind == JointKind::Revolute && lower.abs().max(upper.abs()) > MOST_RAD => {
                let [lower_deg, upper_deg] = [lower, upper].map(f64::to_degrees);
                let what = format!(
                    "<limit> is {lower} to {upper} radians, {lower_deg:.0} to {upper_deg:.0} degrees: was it written in degrees? URDF has \
                     radians"
                );
                Some(says(element, what))
            }
            Limits::Between(..) => None,
        });
        remarks
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
        let axis = self.numbers(source, element, "xyz", mm_from_m)?.map_or_else(Vector3::x, Vector3::from);
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
        if (lower, upper) == (0.0, 0.0) && kind == JointKind::Revolute {
            return Ok(Limits::Zero);
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

    /// Three numbers, or the four of a quaternion, each plausible as a file of ours has it.
    fn numbers<const N: usize>(
        &self,
        source: &Source,
        node: Node<'_, '_>,
        name: &str,
        on_screen: fn(f64) -> f64,
    ) -> Result<Option<[f64; N]>, InputError> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        let words = text.split_ascii_whitespace().take(N + 1).map(str::parse::<f64>);
        let numbers: Option<Vec<f64>> = words.collect::<Result<_, _>>().ok();
        let numbers = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
        if let Some(numbers) = numbers.filter(|numbers| numbers.iter().all(|&value| Of::Plausible.contains(on_screen(value)))) {
            return Ok(Some(numbers));
        }
        let expected =
            if N == 4 { "four numbers, parted by spaces" } else { "three numbers, metres or radians, parted by spaces" };
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
