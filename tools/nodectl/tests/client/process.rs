//! Tests of the program as a process: exit codes, and the connection to a bus over TCP.

use std::io::{BufRead, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;

use assert_cmd::Command;
use canopen::{Duration, Frame};
use nodectl::bus::{Bus, Simulated};

use crate::pressure::Pressure;

fn nodectl(bus: &str, line: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("nodectl").expect("the program");
    let output = command.env("NODECTL_BUS", bus).args(line).output().expect("an output");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (output.status.code().expect("an exit code"), text(output.stdout), text(output.stderr))
}

#[test]
fn the_help_lists_the_exit_codes() {
    let (code, help, _) = nodectl("socketcan:none", &["--help"]);
    assert_eq!(code, 0);
    for command in [
        "scan",
        "info",
        "read",
        "write",
        "monitor",
        "record",
        "trace",
        "save",
        "restore",
        "nmt",
        "lss",
        "update",
        "check",
        "completions",
        "man",
    ] {
        assert!(help.contains(&format!("\n  {command} ")), "{command}");
    }
    assert!(help.contains("Exit codes:\n  0  done\n"));
}

/// Every command has shell completions and a manual page.
#[test]
fn shells_and_man_know_every_command() {
    const COMMANDS: [&str; 5] = ["scan", "trace", "lss", "update", "check"];
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let (code, script, error) = nodectl("socketcan:none", &["completions", shell]);
        assert_eq!((code, error.as_str()), (0, ""), "{shell}");
        for command in COMMANDS {
            assert!(script.contains(command), "{shell}: {command}");
        }
        assert!(script.contains("--bit-rate") || script.contains("bit-rate"), "{shell}");
    }
    assert_eq!(nodectl("socketcan:none", &["completions", "cmd"]).0, 2);

    let (code, page, _) = nodectl("socketcan:none", &["man"]);
    assert_eq!(code, 0);
    assert!(page.contains(".TH nodectl 1") && page.contains("nodectl\\-trace(1)"), "{page}");
    let dir = std::env::temp_dir().join(format!("nodectl-man-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("a directory");
    let (code, out, error) = nodectl("socketcan:none", &["man", "--dir", dir.to_str().expect("text")]);
    assert_eq!((code, out.as_str(), error.as_str()), (0, "", ""));
    for page in ["nodectl.1", "nodectl-read.1", "nodectl-lss-scan.1", "nodectl-check.1"] {
        let text = std::fs::read_to_string(dir.join(page)).expect(page);
        assert!(text.contains(".SH SYNOPSIS"), "{page}");
    }
    std::fs::remove_dir_all(&dir).expect("a directory");
    let (code, _, error) = nodectl("socketcan:none", &["man", "--dir", "/no/such/directory"]);
    assert!(code != 0 && error.contains("/no/such/directory"), "{code}: {error}");
}

#[test]
fn a_wrong_command_line_is_2_and_a_bus_that_is_not_there_4() {
    for line in [
        &["fly"][..],
        &["read"],
        &["read", "1000", "--node", "0"],
        &["write", "1017"],
        &["--bus", "x", "scan"],
    ] {
        assert_eq!(nodectl("socketcan:none", line).0, 2, "{line:?}");
    }
    // No program listens on port 1.
    let (code, out, error) = nodectl("socketcand://127.0.0.1:1/vcan0", &["scan"]);
    assert_eq!((code, out.as_str()), (4, ""));
    assert!(error.starts_with("nodectl: cannot open socketcand://127.0.0.1:1/vcan0: "), "{error}");
    let (code, out, _) = nodectl("slcan:/dev/no-such-port", &["scan", "--json"]);
    let value: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((code, value["exit_code"].as_i64()), (4, Some(4)));
}

#[test]
fn a_socketcand_daemon_is_a_bus() {
    let bus = daemon();
    let (code, out, error) = nodectl(&bus, &["read", "1008", "1017"]);
    let expected = "1008h:0 Manufacturer device name = STM32F4 pressure transmitter\n\
                    1017h:0 Producer heartbeat time = 1000 ms\n";
    assert_eq!((code, out.as_str(), error.as_str()), (0, expected, ""));
    let (code, _, error) = nodectl(&bus, &["write", "1000", "1"]);
    let expected =
        "nodectl: node 1, 1000h:0 \"Device type\": 0601 0002h, attempt to write a read-only object\n";
    assert_eq!((code, error.as_str()), (1, expected));
    let (code, _, error) = nodectl(&bus.replace("vcan0", "can7"), &["scan"]);
    assert_eq!((code, error.contains("no such bus")), (4, true), "{error}");
}

/// The node keeps its node-ID until then, also if it is to have none.
#[test]
fn a_node_id_that_waits_for_a_reset_is_announced() {
    let bus = daemon();
    for id in ["9", "255"] {
        let line = ["lss", "set-id", id, "--select", "0:1:0x10000:0x12345678"];
        let (code, out, error) = nodectl(&bus, &line);
        assert_eq!((code, out), (0, format!("node-ID {id}\n")), "{error}");
        assert!(error.contains("in force after `nodectl nmt reset-comm --node all`"), "{id}: {error}");
    }
}

/// For a wrong scheme with the right port, the error names the right scheme.
#[test]
fn slcan_at_a_socketcand_daemon_is_reported() {
    let address = daemon().replace("socketcand", "slcan").replace("/vcan0", "");
    let (code, _, error) = nodectl(&address, &["scan"]);
    assert_eq!(code, 4);
    assert!(
        error.contains("a socketcand answers there: the address is socketcand://HOST:PORT/BUS"),
        "{error}"
    );
}

/// An adapter needs time for a frame, does not tell when it has sent the frame, and drops it when it is closed.
#[test]
fn the_channel_of_a_slow_adapter_is_closed_when_its_frames_are_sent() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("slcan://{}", listener.local_addr().expect("an address"));
    for _ in 0..3 {
        let listener = listener.try_clone().expect("a port");
        let adapter = thread::spawn(move || sent_by_adapter(&listener.accept().expect("a client").0));
        let (code, _, error) = nodectl(&address, &["--bit-rate", "10", "nmt", "preop", "--no-wait"]);
        assert_eq!((code, error.as_str()), (0, ""));
        assert_eq!(adapter.join().expect("an adapter"), ["t00028001"]);
    }
}

/// The frames that an adapter at 10 kbit/s has sent before its channel is closed.
fn sent_by_adapter(stream: &TcpStream) -> Vec<String> {
    const FRAME: std::time::Duration = std::time::Duration::from_millis(13);
    let (mut sent, mut waiting) = (Vec::new(), Vec::new());
    for line in std::io::BufReader::new(stream).split(b'\r').map_while(Result::ok) {
        let line = String::from_utf8(line).expect("text");
        let now = std::time::Instant::now();
        match line.chars().next() {
            Some('t') => waiting.push((line, now + FRAME)),
            Some('C') => sent.extend(waiting.drain(..).filter(|(_, at)| *at <= now).map(|(line, _)| line)),
            _ => (),
        }
    }
    sent
}

/// A daemon with a node, for the time of the test. Returns its address.
fn daemon() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port();
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            serve(stream);
        }
    });
    format!("socketcand://127.0.0.1:{port}/vcan0")
}

/// Answers until the client is gone. The node has a time of its own, which advances with each frame.
fn serve(mut stream: TcpStream) {
    let mut bus = Simulated::new(Pressure::new(1));
    let mut say = |text: &str| stream.write_all(text.as_bytes()).expect("a client");
    say("< hi >");
    let mut reader = stream.try_clone().expect("a stream");
    while let Some(message) = message(&mut reader) {
        let words: Vec<&str> = message.split_ascii_whitespace().collect();
        let answer = match &words[..] {
            ["open", "vcan0"] | ["rawmode"] => "< ok >".to_owned(),
            ["send", id, _, bytes @ ..] => frames(&mut bus, id, bytes),
            _ => "< error no such bus >".to_owned(),
        };
        if stream.write_all(answer.as_bytes()).is_err() {
            return;
        }
    }
}

/// The text between two brackets; `None` when the client is gone.
fn message(reader: &mut TcpStream) -> Option<String> {
    let (mut text, mut byte) = (String::new(), [0]);
    while reader.read_exact(&mut byte).is_ok() {
        match byte[0] {
            b'<' => text.clear(),
            b'>' => return Some(text),
            letter => text.push(letter.into()),
        }
    }
    None
}

/// The frames of the node in answer to a frame.
fn frames(bus: &mut Simulated<Pressure>, id: &str, bytes: &[&str]) -> String {
    let hex = |text: &&str| u8::from_str_radix(text, 16).expect("a byte");
    let id = u16::from_str_radix(id, 16).expect("an identifier");
    let data: Vec<u8> = bytes.iter().map(hex).collect();
    bus.send(&Frame::new(id, &data).expect("a frame")).expect("a bus");
    let mut answer = String::new();
    let until = bus.now() + Duration::from_millis(2);
    while let Some(received) = bus.receive(until).expect("a bus") {
        let data: String = received.frame.data().iter().map(|byte| format!("{byte:02X}")).collect();
        let (seconds, micros) = (received.at.0 / 1_000_000, received.at.0 % 1_000_000);
        answer += &format!("< frame {:03X} {seconds}.{micros:06} {data} >", received.frame.id());
    }
    answer
}
