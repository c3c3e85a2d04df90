//! What the library stores comes back, and what is no robot, rig or dataset does not.

use ballbar_calib::Parameter;
use ballbar_calib::assess::{Assessment, Evidence};
use ballbar_calib::designs;
use ballbar_calib::identify::{Fit, FitOptions, fit};
use ballbar_calib::model::{Dataset, PairingId, Rig, Robot};
use ballbar_calib::plan::{Plan, PlanOptions, PlanRow, RowKind, plan};
use ballbar_tests::experiment::Puma;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

/// JSON of a value, and JSON of what is read of that.
fn to_and_fro<T: Serialize + DeserializeOwned>(value: &T) -> (Value, T) {
    let written = serde_json::to_value(value).unwrap();
    let read: T = serde_json::from_value(written.clone()).unwrap();
    assert_eq!(serde_json::to_value(&read).unwrap(), written);
    (written, read)
}

#[test]
fn a_fit_and_its_assessment_come_back() {
    let puma = Puma::default();
    let mut dataset = puma.shells(0.46, 15, 84e-6, 1);
    let result = fit(&puma.design, &dataset, &FitOptions::default()).unwrap();
    let assessment = Assessment::new(&Evidence::new(&puma.design, &puma.rig, &dataset, &result));

    let (written, read): (_, Fit) = to_and_fro(&result);
    assert_eq!(read.solution.chain, result.solution.chain);
    assert_eq!(read.uncertainty.covariance, result.uncertainty.covariance);
    assert_eq!(written["parameters"][0]["name"], "x1");
    assert_eq!(written["parameters"][6]["held"], json!({ "finding": { "redundant": { "with": ["alpha1"] } } }));
    assert_eq!(written["identifiability"]["findings"][0], "identified");
    assert_eq!(written["solution"]["chain"]["parameters"].as_array().unwrap().len(), 54);
    let (written, read): (_, Assessment) = to_and_fro(&assessment);
    assert_eq!((written["answer"].as_str(), read.answer), (Some(assessment.answer.name()), assessment.answer));
    assert_eq!((read.reasons, read.proofs.len()), (assessment.reasons, assessment.proofs.len()));

    // A refusal with a suspicion: what would be put right comes back too.
    for row in &mut dataset.rows {
        row.measurement.length_m *= 1e-3;
    }
    let result = fit(&puma.design, &dataset, &FitOptions::default()).unwrap();
    let assessment = Assessment::new(&Evidence::new(&puma.design, &puma.rig, &dataset, &result));
    let (_, read): (_, Assessment) = to_and_fro(&assessment);
    assert!(assessment.suspicion.is_some());
    assert_eq!((read.suspicion, read.refusals), (assessment.suspicion, assessment.refusals));
}

#[test]
fn a_plan_comes_back_with_its_infinite_margins() {
    let (robot, rig) = (designs::puma560(), designs::triangles());
    let pairings = vec![PairingId { chuck: 0, sphere: 0 }];
    let options = PlanOptions { bars_m: vec![0.46], ..PlanOptions::new(pairings, rig.bar.as_ref().unwrap(), 10) };
    let made = plan(&robot, &rig, &options, &|_| ()).unwrap();
    let (written, read): (_, Plan) = to_and_fro(&made);
    assert_eq!(read.rows, made.rows);
    let margins = read.rows[0].margins.as_ref().unwrap();
    assert!(margins.limit_m.is_infinite() && written["rows"][0]["margins"]["limit_m"].is_null());
    let (_, read): (_, PlanOptions) = to_and_fro(&options);
    assert_eq!(read.pairings, options.pairings);
    // The same row from numbers.
    let measured = made.rows.iter().find(|row| row.kind == RowKind::Measure).unwrap();
    let row = PlanRow::with_bar(&robot, &rig, RowKind::Measure, measured.pairing, measured.bar_m, measured.q).unwrap();
    let (at, planned) = (row.bar.unwrap(), measured.bar.unwrap());
    assert!((at.length_m - planned.length_m).abs() < 1e-12 && (at.longitude_rad - planned.longitude_rad).abs() < 1e-9);
    assert!((at.latitude_rad - planned.latitude_rad).abs() < 1e-9);
}

#[test]
fn a_robot_a_rig_and_poses_are_written_as_they_are_called() {
    let puma = Puma::default();
    let (robot, read): (_, Robot) = to_and_fro(&puma.design);
    assert_eq!((&read.chain, &read.limits, &read.encoders), (&puma.design.chain, &puma.design.limits, &puma.design.encoders));
    assert_eq!(robot["chain"]["kinds"], json!(["Revolute", "Revolute", "Revolute", "Revolute", "Revolute", "Revolute"]));
    assert_eq!(robot["limits"][4], json!({ "min": -100.0_f64.to_radians(), "max": 100.0_f64.to_radians() }));

    let (rig, read): (_, Rig) = to_and_fro(&puma.rig);
    assert_eq!(read, puma.rig);
    assert_eq!(rig["chucks"][1], json!({ "name": "B", "position_m": [0.392264973, 0.1, 0.0] }));

    let (poses, read): (_, Dataset) = to_and_fro(&puma.shells(0.46, 2, 0.0, 1));
    assert_eq!(read.measurements().len(), 18);
    assert_eq!(poses["rows"][0]["pairing"], json!({ "chuck": 0, "sphere": 0 }));
}

#[test]
fn what_is_none_is_not_read_as_one() {
    fn refused<T: DeserializeOwned>(value: &Value) -> String {
        serde_json::from_value::<T>(value.clone()).err().expect("this is none").to_string()
    }
    let puma = Puma::default();
    let mut robot = serde_json::to_value(&puma.design).unwrap();
    robot["limits"][0]["min"] = json!(7.0);
    assert!(refused::<Robot>(&robot).starts_with("joint 1 cannot be limited to 7 …"));
    robot["chain"]["parameters"].as_array_mut().unwrap().pop();
    assert_eq!(refused::<Robot>(&robot), "53 parameters, expected 54");
    assert!(refused::<Parameter>(&json!("gamma99")).contains("gamma99"));
    let mut rig = serde_json::to_value(&puma.rig).unwrap();
    rig["spheres"][2]["name"] = json!("1");
    assert_eq!(refused::<Rig>(&rig), "two spheres are called `1`");
    let mut poses = serde_json::to_value(puma.shells(0.46, 1, 0.0, 1)).unwrap();
    poses["rows"][3]["file"] = json!(1);
    assert!(refused::<Dataset>(&poses).contains("which the dataset does not name"));
}
