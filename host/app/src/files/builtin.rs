//! Files that are part of the program, so that `--robot puma560` works without any.

/// The built-in robots: name and file. Every number's source stands in the file.
pub const ROBOTS: [(&str, &str); 6] = [
    ("puma560", include_str!("../../robots/puma560.toml")),
    ("puma560-optimised", include_str!("../../robots/puma560-optimised.toml")),
    ("irb120", include_str!("../../robots/irb120.toml")),
    ("ur5e", include_str!("../../robots/ur5e.toml")),
    ("stanford", include_str!("../../robots/stanford.toml")),
    ("scara", include_str!("../../robots/scara.toml")),
];

/// The built-in rigs: name and file.
pub const RIGS: [(&str, &str); 1] = [("triangles", include_str!("../../rigs/triangles.toml"))];
