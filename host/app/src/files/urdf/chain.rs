//! From URDF joints to a Sheth-Uicker chain, written as `robot.toml` and read back as one.

use std::f64::consts::PI;

use ballbar::{JointKind, MAX_JOINTS, Pose, Vector3};
use ballbar_calib::kinematics::{compose, from_link, link_angles};

use super::super::problem::Problem;
use super::super::robot::parse_robot;
use super::super::source::{InputError, Source};
use super::Imported;
use super::elements::{EncoderModel, Limits, Motion, UrdfRobot};
use super::tree::Path;
use crate::text::one_line;
use crate::units::{ScreenUnit, mm_from_m, without_noise};

/// What is known of a joint once it turns about z.
struct ZJoint<'a> {
    name: &'a str,
    kind: JointKind,
    encoder: EncoderModel,
    /// Of the encoder output, radians or metres.
    min: f64,
    max: f64,
}

/// The robot of a path. A joint about another axis than z becomes one about z between two turns, of which the first goes into its
/// link and the second into the next; fixed joints go into the link that follows.
pub(super) fn imported(source: &Source, urdf: &UrdfRobot<'_>, path: &Path<'_>) -> Result<Imported, InputError> {
    let mut links: Vec<Pose<f64>> = Vec::new();
    let mut joints: Vec<ZJoint<'_>> = Vec::new();
    let mut remarks = Vec::new();
    let mut pending = from_link(Vector3::zeros(), [0.0; 3]);
    for joint in &path.joints {
        pending = compose(&pending, &joint.parent_from_child(source)?);
        let motion = joint.motion(source)?;
        remarks.extend(joint.remarks(source, &motion));
        let Motion::Moves { kind, axis, limits } = motion else { continue };
        let turn = z_to(&axis);
        links.push(compose(&pending, &turn));
        pending = Pose { rotation: turn.rotation.transpose(), translation_m: Vector3::zeros() };
        let encoder = joint.encoder(source, kind)?.unwrap_or(EncoderModel { offset: 0.0, scale: 1.0 });
        let (a, b) = match limits {
            Limits::Between(lower, upper) => ((lower - encoder.offset) / encoder.scale, (upper - encoder.offset) / encoder.scale),
            Limits::None | Limits::Zero => (-PI / encoder.scale.abs(), PI / encoder.scale.abs()),
        };
        joints.push(ZJoint { name: joint.name, kind, encoder, min: a.min(b), max: a.max(b) });
    }
    links.push(pending);
    if !(1..=MAX_JOINTS).contains(&joints.len()) {
        return Err(InputError::of_file(source.name(), Problem::JointCount { found: joints.len() }));
    }
    let toml = toml(urdf.name, path, &links, &joints);
    let robot = parse_robot(&Source::new(&format!("{} as a robot file", source.name()), &toml))?;
    Ok(Imported {
        robot,
        toml,
        base: path.base.to_owned(),
        tip: path.tip.to_owned(),
        joints: joints.iter().map(|joint| joint.name.to_owned()).collect(),
        remarks,
    })
}

/// A turn that takes z to `axis`: none where it is z already, so that nothing is lost there.
fn z_to(axis: &Vector3<f64>) -> Pose<f64> {
    from_link(Vector3::zeros(), [axis.y.atan2(axis.x), axis.x.hypot(axis.y).atan2(axis.z), 0.0])
}

fn toml(name: &str, path: &Path<'_>, links: &[Pose<f64>], joints: &[ZJoint<'_>]) -> String {
    let ends = format!("link `{}` to link `{}`", path.base, path.tip);
    let mut text = format!("# From a URDF, {}.\nname = {}\n", one_line(&ends), toml_edit::Value::from(name));
    for (i, link) in links.iter().enumerate() {
        let [x, y, z] = link.translation_m.map(|m| without_noise(mm_from_m(m))).into();
        let [alpha, beta, gamma] = link_angles(&link.rotation).map(|angle| without_noise(angle.to_degrees()));
        text +=
            &format!("\n[[links]]\ntranslation_mm = [{x:?}, {y:?}, {z:?}]\nrotation_deg = [{alpha:?}, {beta:?}, {gamma:?}]\n");
        let Some(joint) = joints.get(i) else { continue };
        let unit = ScreenUnit::from(joint.kind);
        let [offset, min, max] = [joint.encoder.offset, joint.min, joint.max].map(|value| without_noise(unit.from_si(value)));
        let (unit, scale) = (unit.name(), joint.encoder.scale);
        let kind = match joint.kind {
            JointKind::Revolute => "revolute",
            JointKind::Prismatic => "prismatic",
        };
        text += &format!(
            "\n# {}\n[[joints]]\ntype = \"{kind}\"\noffset_{unit} = {offset:?}\nscale = {scale:?}\n",
            one_line(joint.name)
        );
        text += &format!("min_{unit} = {min:?}\nmax_{unit} = {max:?}\n");
    }
    text
}
