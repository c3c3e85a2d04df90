//! What differs between operating systems. Everything else in this crate is written once for Linux, macOS and Windows, but for the
//! virtual board and the demonstration: their serial port is a pseudo-terminal, so that they are built on Unix alone.

/// Temporary files are private by default; a file renamed into place should have the mode that a plain write gives, which is
/// what the process's umask leaves of this.
#[cfg(unix)]
pub(crate) fn with_usual_permissions(builder: &mut tempfile::Builder<'_, '_>) {
    use std::os::unix::fs::PermissionsExt;
    builder.permissions(std::fs::Permissions::from_mode(0o666));
}

/// Elsewhere a file has the permissions of its folder.
#[cfg(not(unix))]
pub(crate) fn with_usual_permissions(_: &mut tempfile::Builder<'_, '_>) {}
