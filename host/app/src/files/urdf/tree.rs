//! Proof that links and joints are a tree, and the way from its base to its tool.

use std::collections::HashMap;

use super::super::problem::Problem;
use super::super::source::{InputError, Source};
use super::UrdfEnds;
use super::elements::{UrdfJoint, UrdfRobot, opening, short};

/// The joints between two links, from the base.
pub(super) struct Path<'a> {
    pub(super) base: &'a str,
    pub(super) tip: &'a str,
    pub(super) joints: Vec<&'a UrdfJoint<'a>>,
}

/// The way from base to tip.
pub(super) fn path<'a>(source: &Source, robot: &'a UrdfRobot<'a>, ends: UrdfEnds<'_>) -> Result<Path<'a>, InputError> {
    let above = joints_above(source, robot)?;
    let root = check_is_tree(source, robot, &above)?;
    let base = match ends.base {
        Some(name) => named(source, robot, "--base", name)?,
        None => root,
    };
    let tip = match ends.tip {
        Some(name) => named(source, robot, "--tip", name)?,
        None => only_end(source, robot)?,
    };
    let mut joints = Vec::new();
    let mut link = tip;
    // Ends, since the tree was proved to be one.
    while link != base {
        let Some(joint) = above.get(link) else {
            let text = format!("no joints lead from the base, link `{}`, to the tip, link `{}`", short(base), short(tip));
            return Err(InputError::of_file(source.name(), Problem::UrdfTree(text)));
        };
        joints.push(*joint);
        link = joint.parent;
    }
    joints.reverse();
    Ok(Path { base, tip, joints })
}

/// The one joint above each link.
fn joints_above<'a>(source: &Source, robot: &'a UrdfRobot<'a>) -> Result<HashMap<&'a str, &'a UrdfJoint<'a>>, InputError> {
    let mut links = HashMap::new();
    for link in &robot.links {
        if links.insert(link.name, ()).is_some() {
            let problem = Problem::Duplicate { what: "link", name: short(link.name) };
            return Err(InputError::at(source, opening(source, &link.span), problem));
        }
    }
    let mut names = HashMap::new();
    let mut above = HashMap::new();
    for joint in &robot.joints {
        let refuse = |problem| Err(InputError::at(source, opening(source, &joint.span), problem));
        for (end, name) in [("parent", joint.parent), ("child", joint.child)] {
            if !links.contains_key(name) {
                let text = format!("the {end} of joint `{}` is link `{}`, which is not there", short(joint.name), short(name));
                return refuse(Problem::UrdfTree(text));
            }
        }
        if names.insert(joint.name, ()).is_some() {
            return refuse(Problem::Duplicate { what: "joint", name: short(joint.name) });
        }
        if let Some(other) = above.insert(joint.child, joint) {
            let (child, one, two) = (short(joint.child), short(other.name), short(joint.name));
            return refuse(Problem::UrdfTree(format!("link `{child}` is the child of two joints, `{one}` and `{two}`")));
        }
    }
    Ok(above)
}

/// The root; refuses circles and several roots. Every link is walked over once.
fn check_is_tree<'a>(
    source: &Source,
    robot: &'a UrdfRobot<'a>,
    above: &HashMap<&'a str, &'a UrdfJoint<'a>>,
) -> Result<&'a str, InputError> {
    let mut seen_from = HashMap::new();
    for (i, link) in robot.links.iter().enumerate() {
        let mut name = link.name;
        while seen_from.insert(name, i).is_none() {
            let Some(joint) = above.get(name) else { break };
            name = joint.parent;
            if seen_from.get(name) == Some(&i) {
                let text = format!("the joints run in a circle, through joint `{}`", short(joint.name));
                return Err(InputError::at(source, opening(source, &joint.span), Problem::UrdfTree(text)));
            }
        }
    }
    let roots: Vec<&str> = robot.links.iter().map(|link| link.name).filter(|name| !above.contains_key(name)).collect();
    match roots[..] {
        [root] => Ok(root),
        _ => {
            let text = format!("{} links have no joint above them: {}", roots.len(), list(&roots));
            Err(InputError::of_file(source.name(), Problem::UrdfTree(text)))
        }
    }
}

fn named<'a>(source: &Source, robot: &'a UrdfRobot<'a>, what: &'static str, name: &str) -> Result<&'a str, InputError> {
    let found = robot.links.iter().find(|link| link.name == name).map(|link| link.name);
    found.ok_or_else(|| {
        let names: Vec<&str> = robot.links.iter().map(|link| link.name).collect();
        InputError::of_file(source.name(), Problem::UrdfLink { what, found: short(name), known: list(&names) })
    })
}

fn only_end<'a>(source: &Source, robot: &'a UrdfRobot<'a>) -> Result<&'a str, InputError> {
    let parents: HashMap<&str, ()> = robot.joints.iter().map(|joint| (joint.parent, ())).collect();
    let ends: Vec<&str> = robot.links.iter().map(|link| link.name).filter(|name| !parents.contains_key(name)).collect();
    match ends[..] {
        [end] => Ok(end),
        _ => Err(InputError::of_file(source.name(), Problem::UrdfEnds { known: list(&ends) })),
    }
}

/// The first names of a list.
fn list(names: &[&str]) -> String {
    const SHOWN: usize = 12;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| short(name)).collect();
    let more = if names.len() > SHOWN { format!(" and {} more", names.len() - SHOWN) } else { String::new() };
    shown.join(", ") + &more
}
