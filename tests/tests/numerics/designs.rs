//! The designs that the library has in numbers are those of the built-in files.

use ballbar_calib::designs;
use host_cal::files::{open_rig, open_robot};

#[test]
fn the_puma_is_the_files_to_the_bit() {
    let (design, file) = (designs::puma560(), open_robot("puma560").unwrap());
    assert_eq!(design.name, file.name);
    assert_eq!(design.limits, file.limits);
    assert_eq!(design.chain.joint_kinds(), file.chain.joint_kinds());
    let bits = |parameters: &[f64]| parameters.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(design.chain.parameters()), bits(file.chain.parameters()));
}

#[test]
fn the_triangles_are_the_files() {
    assert_eq!(designs::triangles(), open_rig("triangles").unwrap());
}
