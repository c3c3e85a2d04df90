//! Peers that never finish what they say: every link gives them up in time, and at once when the user wants to end.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use ballbar_tests::peers::Mishap;
use ballbar_tests::peers::ur::{UrPeer, UrPeerOptions};
use host_cal::deadline::StopFlag;
use host_cal::robot_link::sim::{SimClient, SimReply, SimRequest};
use host_cal::robot_link::urscript::{UrLink, UrPorts};
use host_cal::robot_link::{JointSpeed, LinkError, MoveState, RobotLink};

use super::{end_of_move, joint_vector, patience};

/// Listens, and hands every connection to `talk`. Its port.
fn listen(talk: impl Fn(TcpStream) + Send + Sync + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let talk = std::sync::Arc::new(talk);
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let talk = std::sync::Arc::clone(&talk);
            std::thread::spawn(move || talk(stream));
        }
    });
    port
}

/// Says something at once, and the rest a byte at a time, again and again until nobody listens.
fn dribble(mut stream: TcpStream, beginning: &[u8], rest: &[u8], pause: Duration) {
    let _ = stream.set_nodelay(true);
    if stream.write_all(beginning).is_err() {
        return;
    }
    for byte in rest.iter().cycle() {
        if stream.write_all(&[*byte]).is_err() {
            return;
        }
        std::thread::sleep(pause);
    }
}

const SLOW: Duration = Duration::from_millis(50);
/// Longer than any wait here is on a busy machine; far shorter than a line that comes byte by byte takes.
const SOON: Duration = Duration::from_secs(15);

/// The error that something ends with, in time.
fn error_of<T>(what: &str, act: impl FnOnce() -> Result<T, LinkError>) -> LinkError {
    let began = Instant::now();
    let error = act().err().unwrap_or_else(|| panic!("{what}: no error"));
    assert!(began.elapsed() < SOON, "{what}: after {:?}", began.elapsed());
    error
}

/// Sets a flag in a moment.
fn set_soon(stop: &StopFlag) -> Instant {
    let stop = stop.clone();
    std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(300));
        stop.set();
    });
    Instant::now()
}

/// A second at most, and what a busy machine adds.
const AT_ONCE: Duration = Duration::from_secs(2);

#[test]
fn a_reply_of_the_simulation_has_a_deadline_for_all_of_it_and_a_bound() {
    let ask = |port: u16| SimClient::connect(&format!("127.0.0.1:{port}")).unwrap().ask(&SimRequest::State);
    let slow = listen(|stream| dribble(stream, b"", b"x", SLOW));
    let error = error_of("a byte at a time", || ask(slow));
    assert!(matches!(&error, LinkError::Unexpected { found, .. } if found.starts_with("xxx")), "{error}");
    let endless = listen(|stream| dribble(stream, b"", &[b'x'; 1], Duration::ZERO));
    assert!(matches!(error_of("a line without an end", || ask(endless)), LinkError::Unexpected { .. }));
    let silent = listen(|stream| dribble(stream, b"", &[], SLOW));
    assert!(matches!(error_of("closed at once", || ask(silent)), LinkError::Lost { .. }));
    let half = listen(|mut stream| {
        let _ = stream.read(&mut [0; 64]);
        let _ = stream.write_all(b"{\"state\":");
    });
    assert!(matches!(error_of("closed in the middle", || ask(half)), LinkError::Lost { .. }));
    let garbage = listen(|stream| dribble(stream, b"\xff\xfe\x00\n", b"\n", SLOW));
    assert!(matches!(error_of("no reply at all", || ask(garbage)), LinkError::Unexpected { .. }));
}

#[test]
fn a_reply_of_the_simulation_is_given_up_when_the_user_wants_to_end_and_the_next_one_is_its_own() {
    // The first reply comes in pieces, over two seconds; those behind it at once.
    let port = listen(|mut stream| {
        let mut bytes = [0; 512];
        let _ = stream.read(&mut bytes);
        let slow = b"{\"refused\":\"too late\"}\n";
        for byte in slow {
            let _ = stream.write_all(&[*byte]);
            std::thread::sleep(Duration::from_millis(80));
        }
        while stream.read(&mut bytes).is_ok_and(|count| count > 0) {
            let _ = stream.write_all(b"\"done\"\n");
        }
    });
    let mut client = SimClient::connect(&format!("127.0.0.1:{port}")).unwrap();
    let stop = StopFlag::default();
    client.heed(&stop);
    let began = set_soon(&stop);
    assert!(matches!(client.ask(&SimRequest::State), Err(LinkError::Stopped)));
    assert!(began.elapsed() < AT_ONCE, "{:?}", began.elapsed());
    client.heed(&StopFlag::default());
    assert_eq!(client.ask(&SimRequest::Halt).unwrap(), SimReply::Done, "not the reply that was given up");
}

#[test]
fn a_ur_that_dribbles_its_answers_is_given_up() {
    let connect = |rtde: u16| {
        let script = listen(|stream| dribble(stream, b"", b"state", SLOW));
        UrLink::connect("127.0.0.1", UrPorts { script, rtde, dashboard: script }, patience())
    };
    let yes: &[u8] = b"\x00\x04V\x01";
    let cases: [(&str, u16); 4] = [
        ("a byte at a time", listen(|stream| dribble(stream, b"", b"\x03\x00V", Duration::from_millis(200)))),
        ("half a package", listen(move |stream| dribble(stream, b"\x03\xffV", b"\x01", SLOW))),
        ("words and no answer", listen(|stream| dribble(stream, b"", b"\x00\x08M\x01a\x01b\x01", Duration::ZERO))),
        ("a yes and then nothing whole", listen(move |stream| dribble(stream, yes, b"\x03\xff", SLOW))),
    ];
    for (what, rtde) in cases {
        let error = error_of(what, || connect(rtde));
        assert!(matches!(error, LinkError::Unexpected { .. }), "{what}: {error}");
    }
}

/// A UR after a protective stop, whose dashboard is somebody else.
fn stopped_ur(dashboard: u16) -> (UrPeer, UrLink) {
    let peer = UrPeer::start(UrPeerOptions { pace: 1.0, ..UrPeerOptions::default() });
    let mut link = UrLink::connect("127.0.0.1", UrPorts { dashboard, ..peer.ports() }, patience()).unwrap();
    peer.next(Mishap::FaultsHalfWay);
    let speed = JointSpeed { revolute_rad_s: 2.0, prismatic_m_s: 0.25 };
    link.start_move(&joint_vector(&[0.5, -1.2, 1.3, -1.6, -1.4, 0.3]), &speed).unwrap();
    assert!(matches!(end_of_move(&mut link).unwrap(), MoveState::Fault(_)));
    assert!(link.intervention().unwrap().is_some());
    (peer, link)
}

#[test]
fn a_dashboard_that_dribbles_its_line_is_given_up() {
    for (what, dashboard) in [
        ("a byte at a time", listen(|stream| dribble(stream, b"", b"Dashboard Server ", SLOW))),
        ("a line without an end", listen(|stream| dribble(stream, b"", b"x", Duration::ZERO))),
        ("a greeting and then a byte at a time", listen(|stream| dribble(stream, b"Dashboard Server\n", b"x", SLOW))),
    ] {
        let (_peer, mut link) = stopped_ur(dashboard);
        let began = Instant::now();
        link.release().unwrap();
        assert!(began.elapsed() < SOON, "{what}: {:?}", began.elapsed());
        assert!(matches!(link.start_move(&joint_vector(&[0.0; 6]), &JointSpeed::default()), Ok(())));
        assert!(matches!(link.poll().unwrap(), MoveState::Refused(words) if words.contains("PROTECTIVE_STOP")), "{what}");
    }
}

#[test]
fn a_release_is_given_up_when_the_user_wants_to_end() {
    let dashboard = listen(|stream| dribble(stream, b"", b"x", SLOW));
    let (_peer, mut link) = stopped_ur(dashboard);
    let stop = StopFlag::default();
    link.heed(&stop);
    let began = set_soon(&stop);
    assert!(matches!(link.release(), Err(LinkError::Stopped)));
    assert!(began.elapsed() < AT_ONCE, "{:?}", began.elapsed());
    link.stop().unwrap();
}

#[cfg(unix)]
mod val {
    use std::time::Instant;

    use host_cal::robot_link::val::{VAL_BAUD, ValLink, ValSpeeds};
    use serialport::{SerialPort, TTYPort};

    use super::{AT_ONCE, Duration, LinkError, RobotLink, SOON, StopFlag, Write, patience, set_soon};
    use ballbar_tests::peers::val::{ValPeer, ValPeerOptions};

    /// A terminal's line on which the same bytes come again and again.
    fn line(bytes: &'static [u8], pause: Duration) -> String {
        let (mut master, slave) = TTYPort::pair().expect("a pseudo-terminal");
        let name = slave.name().expect("it has a name");
        drop(slave);
        std::thread::spawn(move || {
            let _ = master.set_timeout(Duration::from_millis(5));
            let began = Instant::now();
            while began.elapsed() < 2 * SOON {
                let _ = master.write(bytes);
                std::thread::sleep(pause);
            }
        });
        name
    }

    #[test]
    fn a_monitor_that_never_comes_to_its_prompt_is_given_up() {
        for (bytes, pause) in [(&b"x"[..], 20), (b"x\n", 20), (b".", 20), (&[b'x'; 512], 1)] {
            let began = Instant::now();
            let error = ValLink::open(&line(bytes, Duration::from_millis(pause)), VAL_BAUD, ValSpeeds::default(), patience());
            let error = error.err().expect("no prompt, no link");
            assert!(
                matches!(error, LinkError::Unexpected { .. }) && began.elapsed() < SOON,
                "{error} after {:?}",
                began.elapsed()
            );
        }
    }

    #[test]
    fn a_reply_is_given_up_when_the_user_wants_to_end() {
        // So slow a line that an answer takes minutes.
        let peer = ValPeer::start(ValPeerOptions::default());
        let mut link = ValLink::open(peer.port(), VAL_BAUD, ValSpeeds::default(), patience()).unwrap();
        let stop = StopFlag::default();
        link.heed(&stop);
        stop.set();
        let began = set_soon(&stop);
        assert!(matches!(link.joints(), Err(LinkError::Stopped)));
        assert!(began.elapsed() < AT_ONCE);
        // What stops the robot is typed all the same.
        link.stop().unwrap();
        assert!(peer.lines().iter().any(|line| line == "ABORT"), "{:?}", peer.lines());
    }
}
