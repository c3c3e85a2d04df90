//! Peers that never finish what they say, and commands that are to end meanwhile.

use super::*;

/// A serial port at whose other end bytes come one by one, for ever, at a distance.
struct Dribble {
    name: String,
    is_stopped: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Dribble {
    /// First a beginning at once, then the same bytes again and again, `step` at a time.
    fn start(beginning: Vec<u8>, bytes: Vec<u8>, step: usize, pause: Duration) -> Self {
        let (mut master, slave) = TTYPort::pair().expect("a pseudo-terminal");
        let name = slave.name().expect("it has a name");
        drop(slave);
        let is_stopped = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&is_stopped);
        let thread = std::thread::spawn(move || {
            master.set_timeout(Duration::from_millis(5)).expect("a timeout");
            let mut heard = [0; 256];
            let mut is_begun = false;
            let mut rest = bytes.iter().copied().cycle();
            while !stop.load(Ordering::Relaxed) {
                // Every hello is answered with the beginning.
                if master.read(&mut heard).is_ok() && !std::mem::replace(&mut is_begun, true) {
                    let _ = master.write_all(&beginning);
                }
                let next: Vec<u8> = rest.by_ref().take(step).collect();
                let _ = master.write(&next);
                std::thread::sleep(pause);
            }
        });
        Self { name, is_stopped, thread: Some(thread) }
    }
}

impl Drop for Dribble {
    fn drop(&mut self) {
        self.is_stopped.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn hello_frame() -> Vec<u8> {
    let hello = BoardHello {
        version: PROTOCOL,
        firmware: "0.9.1".try_into().unwrap(),
        board: "test".try_into().unwrap(),
        unique_id: [7; 12],
        encoders: 6,
        rate_min_hz: 100,
        rate_max_hz: 5_000,
        encoder_skew_ns: 0,
        lvdt_delay_ns: 0,
        uptime_us: 5,
        reset: ResetReason::PowerOn,
        active: None,
    };
    encode(&ToHost::Hello(hello), &mut [0; MAX_FRAME]).unwrap().to_vec()
}

/// Longer than five tries of 0.8 s on a busy machine, far shorter than any of these peers would talk.
const PATIENCE: Duration = Duration::from_secs(30);

#[test]
fn a_board_that_never_finishes_its_answer_is_given_up() {
    let folder = TempDir::new().unwrap();
    let slow = Duration::from_millis(100);
    let peers = [
        ("a byte at a time", Dribble::start(Vec::new(), hello_frame()[..20].to_vec(), 1, slow), "no board answers"),
        ("no end of a frame", Dribble::start(Vec::new(), vec![7; 100], 2_000, Duration::from_millis(1)), "no board answers"),
        ("nothing but zeros", Dribble::start(Vec::new(), vec![0; 100], 2_000, Duration::from_millis(1)), "no board answers"),
        ("hellos and no answers", Dribble::start(hello_frame(), hello_frame(), 500, Duration::from_millis(1)), "did not answer"),
        ("a hello, then a byte at a time", Dribble::start(hello_frame(), vec![3, 1], 1, slow), "did not answer"),
    ];
    for (what, peer, words) in &peers {
        let began = Instant::now();
        let run = host_cal_in(folder.path(), &["status", &peer.name]);
        assert!(run.code == 2 && run.stderr.contains(words) && began.elapsed() < PATIENCE, "{what}: {}", run.transcript());
    }
}

/// Asks a process to end, as Ctrl-C does; how long it takes.
fn end_of(mut child: Child) -> (Option<i32>, Duration) {
    let began = Instant::now();
    let status = std::process::Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    assert!(status.expect("there is a kill").success());
    loop {
        if let Some(status) = child.try_wait().expect("a child") {
            return (status.code(), began.elapsed());
        }
        if began.elapsed() > PATIENCE {
            let _ = child.kill();
            panic!("it does not end");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_signal_ends_a_recording_promptly_while_the_board_is_silent_or_talks_for_ever() {
    for falls_silent in [true, false] {
        let folder = TempDir::new().unwrap();
        let folder = folder.path();
        let board = board(20);
        let is_off = Arc::new(AtomicBool::new(false));
        let off = Arc::clone(&is_off);
        let line = TamperedLine::start(board.port(), move |message| match (off.load(Ordering::Relaxed), falls_silent) {
            (false, _) => vec![message],
            (true, true) => Vec::new(),
            // Its stream goes on, and nothing that is asked is answered.
            (true, false) if matches!(message, ToHost::Stream(_)) => vec![message; 3],
            (true, false) => Vec::new(),
        });
        let args = ["stream", line.port(), "--session", "s", "--pairing", "A:1", "--bar", "460", "--json"];
        let child = host_cal_command(folder, &args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let began = Instant::now();
        while !folder.join("s/poses.csv").is_file() {
            assert!(began.elapsed() < PATIENCE, "no pose");
            std::thread::sleep(Duration::from_millis(20));
        }
        is_off.store(true, Ordering::Relaxed);
        // Into the midst of asking the board how it is.
        std::thread::sleep(Duration::from_millis(1_500));
        let (code, took) = end_of(child);
        assert!(code.is_some_and(|code| code < 2) && took < Duration::from_secs(3), "{code:?} after {took:?}");
        let description = std::fs::read_to_string(folder.join("s/session.toml")).unwrap();
        assert!(description.contains("ended = "), "{description}");
        assert!(std::fs::read_to_string(folder.join("s/poses.csv")).unwrap().ends_with('\n'));
    }
}

/// A way to an address on which, once the flag is set, nothing comes back but a byte now and then.
fn dribbling_way(address: String, is_dribbling: Arc<AtomicBool>) -> String {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let here = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        for client in listener.incoming().flatten() {
            let server = std::net::TcpStream::connect(&address).expect("the controller listens");
            for stream in [&client, &server] {
                stream.set_nodelay(true).expect("a connection");
            }
            let (mut from_client, mut to_server) = (client.try_clone().unwrap(), server.try_clone().unwrap());
            std::thread::spawn(move || std::io::copy(&mut from_client, &mut to_server));
            let (mut from_server, mut to_client) = (server, client);
            let dribbles = Arc::clone(&is_dribbling);
            std::thread::spawn(move || {
                let mut bytes = [0; 4096];
                while let Ok(count @ 1..) = from_server.read(&mut bytes) {
                    while dribbles.load(Ordering::Relaxed) && to_client.write_all(b"x").is_ok() {
                        std::thread::sleep(Duration::from_millis(200));
                    }
                    if to_client.write_all(&bytes[..count]).is_err() {
                        return;
                    }
                }
            });
        }
    });
    here
}

#[test]
fn a_signal_ends_a_collection_promptly_while_the_controller_sends_a_byte_now_and_then() {
    let cell = SimulatedCell::start(plant(3), 7e-5, &SHORT_PLAN);
    let is_dribbling = Arc::new(AtomicBool::new(false));
    let way = dribbling_way(cell.address.clone(), Arc::clone(&is_dribbling));
    let mut args = cell.collect_args("session");
    let at = args.iter().position(|arg| *arg == cell.address).unwrap();
    args[at] = way;
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let mut command = host_cal_command(cell.folder.path(), &args);
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let began = Instant::now();
    while !cell.path("session/poses.csv").is_file() {
        assert!(began.elapsed() < PATIENCE, "no pose");
        std::thread::sleep(Duration::from_millis(20));
    }
    is_dribbling.store(true, Ordering::Relaxed);
    std::thread::sleep(Duration::from_millis(700));
    let (code, took) = end_of(child);
    assert!(code == Some(1) && took < Duration::from_secs(3), "{code:?} after {took:?}");
    let description = std::fs::read_to_string(cell.path("session/session.toml")).unwrap();
    assert!(description.contains("ended = "), "{description}");
    // The same command goes on from there.
    is_dribbling.store(false, Ordering::Relaxed);
    let run = cell.collect("session", &["--json"]);
    assert_eq!(run.code, 0, "{}", run.transcript());
    cell.assert_all_measured("session");
}
