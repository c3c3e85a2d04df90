//! Robots in the formats of others and back, held against the chain by 4×4 products.

use std::f64::consts::PI;
use std::fs;

use ballbar::JointKind;
use ballbar_calib::kinematics::{Convention, DhTable};
use ballbar_calib::model::Robot;
use ballbar_tests::exports::{HOSTILE_NAME, joint_vectors, pose_by_products as pose};
use host_cal::export::{Format, JointZero, export};
use host_cal::files::{Imported, ROBOTS, Source, UrdfEnds, open_robot, parse_robot, read_urdf};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use proptest::prelude::*;
use tempfile::TempDir;

/// Metres and radians: what the round trip may lose.
const ROUNDING: f64 = 1e-12;

fn imported(text: &str, ends: UrdfEnds<'_>) -> Result<Imported, String> {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().join("robot.urdf");
    fs::write(&path, text).expect("a file");
    read_urdf(&path, ends).map_err(|error| error.to_string().replace(&path.display().to_string(), "robot.urdf"))
}

/// A robot of 1 to 8 joints of either kind, nothing aligned, as the text of its file.
fn robots() -> impl Strategy<Value = Robot> {
    let scale = prop_oneof![0.5..1.5, -1.5..-0.5];
    let joint = (any::<bool>(), -180.0..180.0, scale, -170.0..-10.0, 10.0..170.0);
    let link = (prop::array::uniform3(-900.0..900.0), prop::array::uniform3(-180.0..180.0));
    (prop::collection::vec((link.clone(), joint), 1..=8), link).prop_map(|(pairs, last)| {
        let mut text = format!("name = {}\n", serde_json::to_string(HOSTILE_NAME).unwrap());
        let mut link = |(xyz, angles): ([f64; 3], [f64; 3])| {
            text += &format!("[[links]]\ntranslation_mm = {xyz:?}\nrotation_deg = {angles:?}\n");
        };
        pairs.iter().for_each(|(each, _)| link(*each));
        link(last);
        for (_, (slides, offset, scale, min, max)) in &pairs {
            let (kind, unit) = if *slides { ("prismatic", "mm") } else { ("revolute", "deg") };
            text += &format!("[[joints]]\ntype = \"{kind}\"\noffset_{unit} = {offset:?}\nscale = {scale:?}\n");
            text += &format!("min_{unit} = {min:?}\nmax_{unit} = {max:?}\n");
        }
        parse_robot(&Source::new("any", &text)).unwrap()
    })
}

fn survives_urdf(robot: &Robot) {
    for zero in [JointZero::Model, JointZero::Encoder] {
        survives_a_urdf_with(robot, zero);
    }
}

fn survives_a_urdf_with(robot: &Robot, zero: JointZero) {
    let text = export(robot, Format::Urdf, zero).unwrap().text;
    let again = imported(&text, UrdfEnds::default()).unwrap_or_else(|error| panic!("{error}\n{text}")).robot;
    // xacro, and so our own reader, takes `$` for the beginning of something to compute.
    assert_eq!(again.name, robot.name.replace('$', "_"));
    for (before, after) in robot.limits.iter().zip(&again.limits) {
        assert!((before.min - after.min).abs() < ROUNDING && (before.max - after.max).abs() < ROUNDING, "{before:?} {after:?}");
    }
    for q in joint_vectors(robot, 20) {
        let off = (pose(robot, &q) - pose(&again, &q)).amax();
        assert!(off < ROUNDING, "{off:e} at {q:?}");
    }
}

proptest! {
    #[test]
    fn any_robot_survives_a_urdf(robot in robots()) {
        survives_urdf(&robot);
    }

    #[test]
    fn any_robot_has_both_tables(robot in robots()) {
        for convention in [Convention::Standard, Convention::Modified] {
            let table = DhTable::new(&robot.chain, convention);
            // Two axes taken at random are nearly parallel once in thousands.
            prop_assume!(table.nearly_parallel.is_empty());
            for q in joint_vectors(&robot, 20) {
                let theirs = table.base_from_tool(&q);
                let ours = pose(&robot, &q);
                let off_m = (ours.fixed_view::<3, 1>(0, 3) - theirs.translation_m).amax();
                let turned = (ours.fixed_view::<3, 3>(0, 0) - theirs.rotation).amax();
                prop_assert!(off_m < 1e-9 && turned < 1e-9, "{convention:?}: {off_m:e} m, {turned:e}");
            }
        }
    }
}

#[test]
fn the_built_in_robots_survive_a_urdf_and_both_tables() {
    for (name, _) in ROBOTS {
        let robot = open_robot(name).unwrap();
        survives_urdf(&robot);
        for convention in [Convention::Standard, Convention::Modified] {
            let (off_m, turned_rad) = DhTable::new(&robot.chain, convention).largest_difference(&robot.chain, &robot.limits);
            assert!(off_m < 1e-9 && turned_rad < 1e-9, "{name} {convention:?}: {off_m:e} m, {turned_rad:e} rad");
        }
    }
}

#[test]
fn the_table_of_the_ur5e_is_the_one_that_its_maker_publishes() {
    let robot = open_robot("ur5e").unwrap();
    let table = DhTable::new(&robot.chain, Convention::Standard);
    // Universal Robots, "DH Parameters for calculations of kinematics and dynamics": metres, theta zero.
    let (a, d) = ([0.0, -0.425, -0.3922, 0.0, 0.0, 0.0], [0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996]);
    let alpha = [PI / 2.0, 0.0, 0.0, PI / 2.0, -PI / 2.0, 0.0];
    for (i, row) in table.rows.iter().enumerate() {
        let off = [row.a_m - a[i], row.d_m - d[i], row.alpha_rad - alpha[i], row.theta_rad];
        assert!(off.iter().all(|off| off.abs() < 1e-12), "row {}: {row:?}", i + 1);
    }
    let nothing = |pose: &ballbar::Pose<f64>| pose.translation_m.amax() + (pose.rotation - ballbar::Matrix3::identity()).amax();
    assert!(nothing(&table.base_from_first) < 1e-12 && nothing(&table.last_from_tool) < 1e-12, "{table:?}");
    assert!(table.nearly_parallel.is_empty(), "exactly parallel axes are no trouble");
}

#[test]
fn nearly_parallel_axes_are_explained() {
    let optimised = export(&open_robot("puma560-optimised").unwrap(), Format::Dh, JointZero::Model).unwrap();
    assert!(
        optimised.remarks.iter().any(|remark| remark.contains("axes 2 and 3") && remark.contains("no fault")),
        "{optimised:?}"
    );
    assert!(export(&open_robot("puma560").unwrap(), Format::Dh, JointZero::Model).unwrap().remarks.is_empty());
}

#[test]
fn a_name_that_no_reader_takes_is_cut_between_letters_and_that_is_said() {
    let mut robot = open_robot("ur5e").unwrap();
    robot.name = "a".to_owned() + &"é".repeat(150);
    let exported = export(&robot, Format::Urdf, JointZero::Model).unwrap();
    assert!(exported.remarks.iter().any(|remark| remark.contains("longer than the 200 bytes")), "{:?}", exported.remarks);
    let name = imported(&exported.text, UrdfEnds::default()).unwrap().robot.name;
    assert_eq!(name, "a".to_owned() + &"é".repeat(99));
}

/// A file's robot of joints a hundredth of a degree from parallel, a link a joint and one for the tool.
fn nearly_parallel(kinds: &str) -> Robot {
    let link = "[[links]]\ntranslation_mm = [100.0, 50.0, 200.0]\nrotation_deg = [20.0, 0.01, 0.01]\n";
    let joint = |kind| match kind {
        'P' => "[[joints]]\ntype = \"prismatic\"\noffset_mm = 10.0\nscale = 1.0\nmin_mm = 0.0\nmax_mm = 400.0\n",
        _ => "[[joints]]\ntype = \"revolute\"\noffset_deg = 5.0\nscale = 1.0\nmin_deg = -170.0\nmax_deg = 170.0\n",
    };
    let joints: String = kinds.chars().map(joint).collect();
    parse_robot(&Source::new(kinds, &(link.repeat(kinds.len() + 1) + &joints))).unwrap()
}

#[test]
fn a_slide_nearly_parallel_to_its_neighbour_has_an_ordinary_table() {
    // How many pairs stay far from one another: those of two revolute joints, and one beside a slide that was laid for its other side.
    for (kinds, far) in [("RP", 0), ("PR", 0), ("PPR", 1), ("RPR", 1), ("RPPR", 1), ("RR", 1), ("PRRP", 1)] {
        let robot = nearly_parallel(kinds);
        for convention in [Convention::Standard, Convention::Modified] {
            let table = DhTable::new(&robot.chain, convention);
            let (off_m, turned_rad) = table.largest_difference(&robot.chain, &robot.limits);
            assert!(off_m < 1e-9 && turned_rad < 1e-9, "{kinds} {convention:?}: {off_m:e} m, {turned_rad:e} rad");
            assert_eq!(table.nearly_parallel.len(), far, "{kinds}: {table:?}");
            let largest_m = table.rows.iter().map(|row| row.d_m.abs().max(row.a_m.abs())).fold(0.0, f64::max);
            assert_eq!(largest_m > 10.0, far > 0, "{kinds}: {table:?}");
        }
    }
}

#[test]
fn parameters_as_csv_are_the_numbers_of_the_robot_file() {
    for (name, text) in ROBOTS {
        let words = text.split(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)));
        let numbers: Vec<f64> = words.filter_map(|word| word.parse().ok()).collect();
        let csv = export(&open_robot(name).unwrap(), Format::Csv, JointZero::Model).unwrap().text;
        for line in csv.lines().skip_while(|line| *line != "parameter,unit,value").skip(1) {
            let value: f64 = line.rsplit(',').next().unwrap().parse().unwrap();
            assert!(numbers.contains(&value), "{name}: {line}");
        }
    }
}

const ODD_AXES: &str = r#"<robot name="odd">
  <link name="world"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="tool"/><link name="camera"/>
  <joint name="stand" type="fixed"><parent link="world"/><child link="a"/><origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/></joint>
  <joint name="j1" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.5"/><axis xyz="0 -2 0"/>
    <limit lower="-1" upper="2" effort="0" velocity="0"/></joint>
  <joint name="j2" type="prismatic"><parent link="b"/><child link="c"/><origin rpy="0 1.5707963267948966 0"/><axis xyz="1 1 0"/>
    <limit lower="0" upper="0.4" effort="0" velocity="0"/></joint>
  <joint name="j3" type="continuous"><parent link="c"/><child link="d"/><origin xyz="0.2 0 0" rpy="1 2 3"/><axis xyz="0 0 -1"/></joint>
  <joint name="flange" type="fixed"><parent link="d"/><child link="tool"/><origin xyz="0 0 0.1" rpy="0 0 0.7"/></joint>
  <joint name="mount" type="floating"><parent link="d"/><child link="camera"/></joint>
</robot>"#;

#[test]
fn joints_about_any_axis_become_joints_about_z() {
    let robot = imported(ODD_AXES, UrdfEnds { base: None, tip: Some("tool") }).unwrap();
    assert_eq!((robot.base.as_str(), robot.joints.join(" ").as_str()), ("world", "j1 j2 j3"));
    assert!(robot.remarks.iter().any(|remark| remark.contains("`j3`")), "{:?}", robot.remarks);
    let kinds = [JointKind::Revolute, JointKind::Prismatic, JointKind::Revolute];
    assert_eq!(robot.robot.chain.joint_kinds(), kinds);
    let origin = |xyz: [f64; 3], [roll, pitch, yaw]: [f64; 3]| {
        Isometry3::from_parts(Translation3::from(Vector3::from(xyz)), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
    };
    let about = |axis: [f64; 3], angle| {
        Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis.into()), angle))
    };
    for q in [[0.0; 3], [0.3, 0.1, -2.0], [-0.9, 0.39, 3.0], [2.0, 0.2, PI / 2.0]] {
        let slide = Translation3::from(Vector3::new(1.0, 1.0, 0.0).normalize() * q[1]);
        let expected = origin([0.1, -0.2, 0.3], [0.4, -0.5, 0.6])
            * origin([0.0, 0.0, 0.5], [0.0; 3])
            * about([0.0, -1.0, 0.0], q[0])
            * origin([0.0; 3], [0.0, PI / 2.0, 0.0])
            * slide
            * origin([0.2, 0.0, 0.0], [1.0, 2.0, 3.0])
            * about([0.0, 0.0, -1.0], q[2])
            * origin([0.0, 0.0, 0.1], [0.0, 0.0, 0.7]);
        assert!((expected.to_homogeneous() - pose(&robot.robot, &q)).amax() < ROUNDING, "{q:?}");
    }
}

fn refusal(text: &str) -> String {
    imported(text, UrdfEnds::default()).expect_err("is refused")
}

#[test]
fn hostile_files_are_refused_clearly() {
    let joint = |name: &str, parent: &str, child: &str| {
        format!(
            r#"<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/></joint>"#
        )
    };
    let robot = |links: &[&str], joints: &[String]| {
        let links: String = links.iter().map(|name| format!("<link name=\"{name}\"/>\n")).collect();
        format!("<robot name=\"r\">\n{links}{}\n</robot>", joints.join("\n"))
    };
    let two = robot(&["a", "b"], &[joint("j", "a", "b")]);
    assert!(imported(&two, UrdfEnds::default()).is_ok());

    let comment = two.replacen("<link", &format!("<!-- {} > \" --> don't <link", "don't xmlns ".repeat(500)), 1);
    assert!(imported(&comment, UrdfEnds::default()).is_ok(), "a comment has no attributes");
    let attributes: String = (0..201).map(|i| format!(" a{i}='>'")).collect();
    let refused = refusal(&two.replacen("<link", &format!("<link{attributes}"), 1));
    assert!(refused.starts_with("robot.urdf:2: ") && refused.contains("more than 200 attributes"), "{refused}");

    let bomb = format!("<!DOCTYPE r [<!ENTITY a \"{}\"><!ENTITY b \"&a;&a;&a;&a;\">]>\n{two}", "ha".repeat(1000));
    assert!(refusal(&bomb).contains("not XML that can be read"), "{}", refusal(&bomb));
    let long = robot(&["a", "b"], &[joint(&"n".repeat(100_000_000), "a", "b")]);
    assert!(refusal(&long).contains("longer than 8388608 bytes"));
    let long = refusal(&robot(&["a", "b"], &[joint(&"n".repeat(1_000_000), "a", "b")]));
    assert!(long.contains("1000000 bytes long") && long.len() < 400, "{long}");

    let circle = robot(&["r", "a", "b", "c"], &[joint("1", "a", "b"), joint("2", "b", "c"), joint("3", "c", "a")]);
    assert!(refusal(&circle).contains("run in a circle"), "{}", refusal(&circle));
    let itself = robot(&["a", "b"], &[joint("1", "b", "b")]);
    assert!(refusal(&itself).contains("run in a circle"), "{}", refusal(&itself));
    let orphan = robot(&["a", "b"], &[joint("j", "nowhere", "b")]);
    assert!(refusal(&orphan).contains("`nowhere`, which is not there"), "{}", refusal(&orphan));
    let two_parents = robot(&["a", "b", "c"], &[joint("1", "a", "c"), joint("2", "b", "c")]);
    assert!(refusal(&two_parents).contains("child of two joints"));
    assert!(refusal(&robot(&["a", "b"], &[])).contains("2 links have no joint above them: a, b"));
    let fork = robot(&["a", "b", "c"], &[joint("1", "a", "b"), joint("2", "a", "c")]);
    assert!(refusal(&fork).contains("several ends"));
    for (base, tip, says) in
        [("b", "c", "no joints lead from the base"), ("a", "d", "--tip `d` is no link"), ("d", "b", "--base `d`")]
    {
        let refusal = imported(&fork, UrdfEnds { base: Some(base), tip: Some(tip) }).unwrap_err();
        assert!(refusal.contains(says), "{refusal}");
    }
    assert!(refusal(&robot(&["a"], &[])).contains("0 joints, expected 1 to 8"));
    let names: Vec<String> = (0..10).map(|i| format!("l{i}")).collect();
    let nine: Vec<String> = (0..9).map(|i| joint(&format!("j{i}"), &names[i], &names[i + 1])).collect();
    let links: Vec<&str> = names.iter().map(String::as_str).collect();
    assert!(refusal(&robot(&links, &nine)).contains("9 joints, expected 1 to 8"));

    for (found, broken, says) in [
        ("xyz=\"0 0 1\"", "xyz=\"0 0 0\"", "axis of joint `j` is of no length"),
        ("xyz=\"0 0 1\"", "xyz=\"0 0\"", "xyz of joint `j` is `0 0`"),
        ("xyz=\"0 0 1\"", "xyz=\"0 nan 1\"", "`0 nan 1`"),
        ("xyz=\"0 0 1\"", "xyz=\"0 1e99 1\"", "`0 1e99 1`"),
        ("\"continuous\"><", "\"revolute\"><limit lower=\"-1e9\" upper=\"1e9\"/><", "a joint without limits is `continuous`"),
        (
            "\"continuous\"><",
            "\"prismatic\"><limit lower=\"-1001\" upper=\"1\"/><",
            "expected a number from -1000 to 1000, metres",
        ),
        ("\"continuous\"", "\"planar\"", "type of joint `j` is `planar`"),
        ("\"continuous\"", "\"revolute\"", "<limit> of joint `j` is missing"),
        ("<axis", "<mimic joint=\"k\"/><axis", "joint `j` is moved along by another"),
        ("\"0 0 1\"", "\"0 0 ${pi}\"", "this is xacro"),
        ("<link", "<x:macro xmlns:x=\"http://www.ros.org/wiki/xacro\"/><link", "this is xacro"),
        ("<robot", "<sdf", "not XML"),
    ] {
        let refusal = refusal(&two.replacen(found, broken, 1));
        assert!(refusal.starts_with("robot.urdf:") && refusal.contains(says), "{refusal}");
    }
}

#[test]
fn large_files_take_no_long_time() {
    let begun = std::time::Instant::now();
    let deep = "<a>".repeat(150_000) + &"</a>".repeat(150_000);
    let attributes: String = (0..100_000).map(|i| format!(" a{i}=\"\"")).collect();
    // What is no element may hold one quote.
    let hidden = format!("<!-- ' --><?x ' ?><robot name=\"r\">'<![CDATA['<a ']]><a{attributes}/></robot>");
    let many_nodes = format!("<robot name=\"r\">{}</robot>", "<link name=\"a\"/>".repeat(300_000));
    let spaces: String = (0..60_000).map(|i| format!("<a xmlns:n{i}=\"u{i}\">")).collect();
    for text in
        [format!("<robot name=\"r\">{deep}</robot>"), format!("<robot name=\"r\"{attributes}/>"), hidden, many_nodes, spaces]
    {
        let refusal = refusal(&text);
        assert!(refusal.len() < 600, "{refusal}");
    }
    assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
}
