//! What `host-cal plan` writes, says and refuses.

use std::fs;
use std::sync::Mutex;

use ballbar_calib::plan::{Cell, PlanOptions, Progress, Stage, check, plan};
use ballbar_tests::plans::{options, planned};
use ballbar_tests::workbench::{self, Workbench};
use host_cal::files::{open_rig, open_robot};

const PLAN: [&str; 7] = ["plan", "--robot", "puma560", "--rig", "triangles", "--bar", "460"];
/// Tells all parameters.
const ENOUGH: [&str; 4] = ["--per-pair", "15", "--pairings", "A:1,B:2,C:3"];

#[test]
fn a_plan_is_written_checked_and_told_as_json() {
    let bench = Workbench::new();
    let run = bench.run(&[&PLAN[..], &ENOUGH, &["--out", "plan.csv"]].concat());
    assert_eq!(run.code, 0, "{}", run.transcript());
    let written = fs::read_to_string(bench.path("plan.csv")).unwrap();

    let json = bench.run(&[&PLAN[..], &ENOUGH, &["--json"]].concat());
    let rows = json.json()["rows"].as_array().unwrap().clone();
    assert_eq!((json.code, rows.len()), (0, written.lines().count() - 1));
    for (row, line) in rows.iter().zip(written.lines().skip(1)) {
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!((row["kind"].as_str(), row["chuck"].as_str()), (Some(fields[0]), Some(fields[1])));
        assert!((row["q"][5].as_f64().unwrap() - fields[9].parse::<f64>().unwrap()).abs() < 1e-8);
    }
    let summary = bench.run(&[&PLAN[..], &ENOUGH, &["--out", "plan.csv", "--json"]].concat()).json();
    assert!(summary.get("rows").is_none() && summary["out"] == "plan.csv" && summary["poses"] == 45);

    let check = ["plan", "--robot", "puma560", "--rig", "triangles", "--check"];
    let whole = bench.run(&[&check[..], &["plan.csv", "--json"]].concat());
    assert_eq!((whole.code, whole.json()["is_kept"].as_bool()), (0, Some(true)), "{}", whole.transcript());
    let measured: String = written.lines().filter(|line| !line.starts_with("via")).map(|line| line.to_owned() + "\n").collect();
    bench.put("measured.csv", measured);
    let without_vias = bench.run(&[&check[..], &["measured.csv", "--json"]].concat());
    assert_eq!((without_vias.code, without_vias.json()["is_kept"].as_bool()), (1, Some(false)));
}

#[test]
fn a_d_optimal_plan_is_shown_beside_the_grid() {
    let bench = Workbench::new();
    let more = ["--bar", "460", "--per-pair", "12", "--pairings", "A:1,B:2,C:3,A:3,B:1,C:2", "--optimal", "50", "--json"];
    let found = bench.run(&[&PLAN[..5], &more].concat()).json();
    let optimal = &found["optimal"];
    let of = |set: &str, what: &str| optimal[set][what].as_f64().unwrap();
    assert_eq!((found["poses"].as_u64(), optimal["chosen"]["poses"].as_u64()), (Some(50), Some(50)));
    assert!(of("chosen", "log10_determinant") > of("grid_of_same_size", "log10_determinant") + 1.0, "{optimal}");
    for what in ["condition", "smallest_singular_mm", "noise_amplification_index_mm", "amplification"] {
        assert!(of("chosen", what) > 0.0 && of("grid_of_same_size", what) > 0.0);
    }
}

#[test]
fn a_plan_that_no_fit_could_use_says_so() {
    let bench = Workbench::new();
    let plan = |more: &[&str]| bench.run(&[&PLAN[..], more, &["--out", "plan.csv", "--json"]].concat());
    let cases: [(&[&str], &str); 4] = [
        (&["--pairings", "A:1,B:2,C:3", "--per-pair", "13", "--latitudes-deg", "30,60"], "noise of the lengths reaches the tool"),
        (&["--per-pair", "3", "--latitudes-deg", "45"], "27 poses for 36 parameters"),
        (&["--per-pair", "4", "--latitudes-deg", "30,60"], "36 poses for 36 parameters"),
        (&["--pairings", "A:1,A:2", "--per-pair", "20"], "identify 32 of 36 parameters"),
    ];
    for (more, why) in cases {
        let run = plan(more);
        assert_eq!(run.code, 1, "{}", run.transcript());
        assert!(run.stderr.contains(why), "{}", run.stderr);
        assert!(run.json()["warnings"][0].as_str().is_some_and(|said| said.contains(why)), "{}", run.transcript());
        assert!(bench.path("plan.csv").exists());
        if why.contains("identify") {
            // A figure that leaves the errors of some parameters out is none.
            assert!(run.json()["quality"]["amplification"].is_null() && run.stderr.contains("one chuck"), "{}", run.transcript());
        }
    }
}

#[test]
fn what_cannot_be_planned_is_refused() {
    const PUMA: [&str; 6] = ["plan", "--robot", "puma560", "--out", "old.toml", "--force"];
    let bench = Workbench::new();
    let rig = workbench::RIG;
    bench.put("solids.toml", format!("{rig}\n[solids]\nlink_radius_mm = -3.0\n"));
    bench.put("misspelt.toml", format!("{rig}\n[solids]\nlink_diameter_mm = 90.0\n"));
    bench.put("chucks.toml", rig.replace("[392.0, 100.0, 0.0]", "[560.0, 20.0, 0.0]"));
    bench.put("foot.toml", rig.replace("[392.0, 100.0, 0.0]", "[60.0, 20.0, 0.0]"));
    bench.put("no-bar.toml", rig.split_once("[bar]").unwrap().0);
    let cases: [(&str, &str, &[&str]); 15] = [
        ("plan_with_solids_below_zero", "solids.toml", &[]),
        ("plan_with_solids_misspelt", "misspelt.toml", &[]),
        ("plan_with_chucks_in_one_another", "chucks.toml", &[]),
        ("plan_with_a_chuck_in_the_foot", "foot.toml", &[]),
        ("plan_without_travel", "no-bar.toml", &["--bar", "460"]),
        ("plan_beyond_reach", "rig.toml", &["--pairings", "A:1", "--bar", "2500", "--per-pair", "6"]),
        ("plan_bar_twice", "rig.toml", &["--bar", "460,610,460"]),
        ("plan_bar_of_zero", "rig.toml", &["--bar", "0"]),
        ("plan_latitude_below_the_table", "rig.toml", &["--latitudes-deg=-10,20"]),
        ("plan_margin_beyond_travel", "rig.toml", &["--travel-margin-mm", "37.5"]),
        ("plan_speed_of_zero", "rig.toml", &["--speed-deg-s", "0"]),
        ("plan_of_an_unknown_pairing", "rig.toml", &["--pairings", "A:7"]),
        ("plan_optimal_of_nothing", "rig.toml", &["--optimal", "0"]),
        ("plan_optimal_of_too_many", "rig.toml", &["--pairings", "A:1", "--bar", "460", "--per-pair", "4", "--optimal", "900"]),
        ("plan_optimal_of_too_few", "rig.toml", &["--pairings", "A:1", "--bar", "460", "--per-pair", "6", "--optimal", "4"]),
    ];
    for (name, rig, more) in cases {
        bench.refuses(name, &[&PUMA[..], &["--rig", rig], more].concat());
    }
    let said = bench.fails(3, &[&PUMA[..4], &["missing/plan.csv", "--rig", "rig.toml"]].concat());
    workbench::snapshot("write_a_plan_to_a_missing_folder", &["plan", "--out", "missing/plan.csv"], &said);
}

#[test]
fn a_plan_that_is_not_of_this_robot_or_is_damaged_is_refused() {
    let bench = Workbench::new();
    // Too few poses for a fit, but a plan.
    let run = bench.run(&[&PLAN[..], &["--per-pair", "5", "--pairings", "A:1", "--out", "plan.csv"]].concat());
    assert_eq!(run.code, 1, "{}", run.transcript());
    let text = fs::read_to_string(bench.path("plan.csv")).unwrap();
    bench.put("kind.csv", text.replacen("\nvia,", "\npass,", 1));
    bench.put("chuck.csv", text.replacen("\nmeasure,A,", "\nmeasure,Q,", 1));
    bench.put("header.csv", text.replacen("kind,", "sort,", 1));
    bench.put("empty.csv", "");
    let cases = [
        ("check_a_plan_of_another_robot", "irb120", "plan.csv"),
        ("check_a_plan_of_other_joints", "scara", "plan.csv"),
        ("check_a_plan_of_an_unknown_kind", "puma560", "kind.csv"),
        ("check_a_plan_with_an_unknown_chuck", "puma560", "chuck.csv"),
        ("check_a_plan_without_kind", "puma560", "header.csv"),
        ("check_an_empty_plan", "puma560", "empty.csv"),
        ("check_a_missing_plan", "puma560", "missing.csv"),
    ];
    for (name, robot, file) in cases {
        bench.refuses(name, &["plan", "--robot", robot, "--rig", "triangles", "--check", file]);
    }
}

#[test]
fn a_refusal_points_to_its_cause() {
    let bench = Workbench::new();
    let said = |solids: &str, chucks: [&str; 2], more: &[&str], spheres: [&str; 2]| {
        let text = workbench::RIG
            .replace("[565.0, 0.0, 0.0]", chucks[0])
            .replace("[392.0, 100.0, 0.0]", chucks[1])
            .replace("[57.0, 0.0, 50.0]", spheres[0])
            .replace("[-28.0, 50.0, 50.0]", spheres[1]);
        bench.put(
            "cause.toml",
            format!(
                "{text}\n[[spheres]]\nname = \"3\"\nposition_mm = {}\n[solids]\n{solids}\n",
                spheres[1].replace("50.0,", "-50.0,")
            ),
        );
        let args = ["plan", "--robot", "puma560", "--rig", "cause.toml", "--pairings", "A:1", "--per-pair", "6"];
        bench.fails(2, &[&args[..], more].concat()).replace('│', "").split_whitespace().collect::<Vec<_>>().join(" ")
    };
    const FRONT: [&str; 2] = ["[565.0, 0.0, 0.0]", "[392.0, 100.0, 0.0]"];
    const HIGH: [&str; 2] = ["[500.0, 0.0, 800.0]", "[327.0, 100.0, 800.0]"];
    const AHEAD: [&str; 2] = ["[57.0, 0.0, 80.0]", "[-28.0, 50.0, 80.0]"];
    /// Turned by 90° about the tool's y.
    const ACROSS: [&str; 2] = ["[80.0, 0.0, -57.0]", "[80.0, 50.0, 28.0]"];
    let table = said("link_radius_mm = 90.0", HIGH, &["--bar", "300"], AHEAD);
    assert!(table.contains("table_below_chucks_mm"), "{table}");
    let travel = said("", FRONT, &["--bar", "460", "--travel-margin-mm", "34"], AHEAD);
    assert!(travel.contains("--travel-margin-mm"), "{travel}");
    let far = said("", FRONT, &["--bar", "2500"], AHEAD);
    assert!(far.contains("another bar length with --bar"), "{far}");
    let across = said("", FRONT, &["--bar", "460"], ACROSS);
    assert!(across.contains("turn the spheres' positions"), "{across}");
}

#[test]
fn links_too_thick_for_their_joint_are_not_looked_at_beside_one_another() {
    // A PUMA's third link passes its first 149 mm off, in every posture.
    let bench = Workbench::new();
    bench.put("thick.toml", format!("{}\n[solids]\nlink_radius_mm = 70.0\n", workbench::RIG));
    let (robot, rig) = (open_robot("puma560").unwrap(), open_rig(bench.path("thick.toml").to_str().unwrap()).unwrap());
    let plan = planned(&robot, &rig, &options(&rig, &[("A", "1")], &[0.46], 6));
    assert_eq!(plan.shells[0].measured, 6, "{:?}", plan.shells[0].hindrances);
}

#[test]
fn the_same_seed_gives_the_same_plan_and_another_gives_another() {
    let (robot, rig) = (open_robot("stanford").unwrap(), open_rig("triangles").unwrap());
    let mut options = options(&rig, &[("A", "1"), ("B", "2")], &[0.46], 6);
    let rows = |options: &PlanOptions| planned(&robot, &rig, options).rows;
    let first = rows(&options);
    assert_eq!(first, rows(&options));
    options.seed = 1;
    assert_ne!(first, rows(&options));
}

#[test]
fn progress_names_its_stage_and_grows_to_the_end_of_each() {
    let (robot, rig) = (open_robot("puma560").unwrap(), open_rig("triangles").unwrap());
    let pairings = [("A", "1"), ("B", "2"), ("C", "3")];
    for optimal in [None, Some(38)] {
        let told = Mutex::new(Vec::<Progress>::new());
        let tell = |now| told.lock().unwrap().push(now);
        let options = PlanOptions { optimal, ..options(&rig, &pairings, &[0.46], 14) };
        let rows = plan(&robot, &rig, &options, &tell).unwrap().rows;
        let cell = Cell::new(&robot, &rig, options.travel_m, options.margins, options.pace).unwrap();
        check(&cell, &rows, 0.1, 10, 0, &tell);
        let told = told.into_inner().unwrap();
        let stages: Vec<&[Progress]> = told.chunk_by(|a, b| a.stage == b.stage).collect();
        assert_eq!(stages.iter().map(|stage| stage[0].stage).collect::<Vec<_>>(), Stage::ALL);
        for stage in stages {
            let (first, last) = (stage[0], stage[stage.len() - 1]);
            assert_eq!((first.done, last.done), (0, first.total), "{first:?} {last:?}");
            assert!(stage.windows(2).all(|pair| pair[1].total == first.total && pair[1].done >= pair[0].done), "{stage:?}");
        }
    }
}
