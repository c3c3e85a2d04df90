//! `docs/wire.md` says what the types say, hellos of other versions are understood, and a change of the wire is a diff to look at.

use std::path::PathBuf;

use ballbar::wire::{BoardHello, HostHello, PROTOCOL, ProtocolVersion, ResetReason, ToBoard, ToHost, hello_version};
use ballbar_tests::wire_schema::wire_types_as_markdown;
use serde::Serialize;

const OPENS: &str = "<!-- schema -->\n";
const CLOSES: &str = "<!-- /schema -->";

/// When this fails, a message changed: look at the difference in the document, and raise `PROTOCOL.number` when a message's meaning
/// changed and not only its shape. The hash alone keeps ends of different shapes apart.
#[test]
fn a_change_of_the_messages_shows_as_a_change_of_number_and_hash() {
    let hash: String = PROTOCOL.schema.iter().map(|byte| format!("{byte:02x}")).collect();
    insta::assert_snapshot!(format!("protocol {}, schema {hash}", PROTOCOL.number), @"protocol 3, schema 020df7739d814a54");
}

/// `UPDATE_DOCS=1 cargo test -p ballbar-tests --test board wire_document` writes the block anew.
#[test]
fn the_document_lists_the_messages_as_they_are() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/wire.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once(OPENS).expect("no mark where the schema begins");
    let (listed, after) = rest.split_once(CLOSES).expect("no mark where the schema ends");
    let schema = format!("\n{}", wire_types_as_markdown());
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, format!("{before}{OPENS}{schema}{CLOSES}{after}")).unwrap();
    } else {
        assert!(
            listed == schema,
            "docs/wire.md is behind the types: run this test with UPDATE_DOCS=1 and look at the difference"
        );
    }
}

/// A hello as some other version may have it: the same beginning, and then anything.
#[derive(Serialize)]
enum OtherToBoard {
    Hello { version: ProtocolVersion, name: &'static str, numbers: Vec<u64> },
}

#[derive(Serialize)]
enum OtherToHost {
    Hello { version: ProtocolVersion, uptime_s: f64 },
}

const OTHER: ProtocolVersion = ProtocolVersion { number: 60_000, schema: [0, 255, 1, 2, 3, 4, 5, 6] };

#[test]
fn a_hello_of_another_version_tells_its_version_in_both_directions() {
    let to_board = OtherToBoard::Hello { version: OTHER, name: "host of another time", numbers: vec![u64::MAX; 9] };
    let to_host = OtherToHost::Hello { version: OTHER, uptime_s: 1.5 };
    assert_eq!(hello_version(&postcard::to_stdvec(&to_board).unwrap()), Some(OTHER));
    assert_eq!(hello_version(&postcard::to_stdvec(&to_host).unwrap()), Some(OTHER));
}

#[test]
fn a_hello_of_this_version_tells_its_version_in_both_directions() {
    let to_host = ToHost::Hello(BoardHello {
        version: PROTOCOL,
        firmware: "0.1.0".try_into().unwrap(),
        board: "board".try_into().unwrap(),
        unique_id: [7; 12],
        encoders: 6,
        rate_min_hz: 100,
        rate_max_hz: 5_000,
        encoder_skew_ns: 1,
        lvdt_delay_ns: 2,
        uptime_us: 3,
        reset: ResetReason::PowerOn,
        active: None,
    });
    let to_board = ToBoard::Hello(HostHello { version: PROTOCOL });
    assert_eq!(hello_version(&postcard::to_stdvec(&to_board).unwrap()), Some(PROTOCOL));
    assert_eq!(hello_version(&postcard::to_stdvec(&to_host).unwrap()), Some(PROTOCOL));
}

#[test]
fn what_is_no_hello_has_no_version() {
    let hello = postcard::to_stdvec(&ToBoard::Hello(HostHello { version: PROTOCOL })).unwrap();
    let request = postcard::to_stdvec(&(1_u8, 7_u16, 0_u8)).unwrap();
    assert_eq!(hello_version(&request), None);
    for length in 0..hello.len() {
        assert_eq!(hello_version(&hello[..length]), None, "{length} bytes");
    }
}
