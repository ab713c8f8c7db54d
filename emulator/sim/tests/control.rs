//! The control connection over real sockets, on a bus without a board.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;

use canbus::Time;
use serde_json::Value;
use sim::control::Control;
use sim::world::World;

/// A world whose time passes while a client waits.
struct Bench {
    world: World,
    control: Control,
    has_quit: bool,
}

impl Bench {
    fn new() -> Bench {
        let control = Control::listen("127.0.0.1:0".parse().unwrap()).unwrap();
        Bench { world: World::new(Vec::new(), 250, 0), control, has_quit: false }
    }

    fn connect(&self) -> TcpStream {
        let client = TcpStream::connect(self.control.address().unwrap()).unwrap();
        client.set_nonblocking(true).unwrap();
        client
    }

    fn step(&mut self) {
        self.has_quit |= self.control.poll(&mut self.world);
        self.world.run_until(self.world.now() + Time::from_millis(1));
        std::thread::yield_now();
    }

    /// The next line; `None` when the connection is closed.
    fn line(&mut self, client: &mut TcpStream) -> Option<Value> {
        let mut text = Vec::new();
        while text.last() != Some(&b'\n') {
            let mut byte = [0];
            match client.read(&mut byte) {
                Ok(0) => return None,
                Ok(_) => text.push(byte[0]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => self.step(),
                Err(_) => return None,
            }
        }
        Some(serde_json::from_slice(&text).unwrap())
    }

    fn ask(&mut self, client: &mut TcpStream, line: &str) -> Option<Value> {
        client.write_all(format!("{line}\n").as_bytes()).unwrap();
        self.line(client)
    }
}

#[test]
fn a_line_is_a_command_and_a_line_the_answer() {
    let mut bench = Bench::new();
    let mut client = bench.connect();
    let boards = bench.ask(&mut client, "boards").unwrap();
    assert_eq!((&boards["bit_rate"], boards["boards"].as_array().map(Vec::len)), (&250.into(), Some(0)));
    assert_eq!(boards["faults"][0]["name"], "open-sensor");
    assert_eq!(bench.ask(&mut client, "pressure const:300000").unwrap()["ok"], true);
    for (line, words) in [
        ("pressure 5=const:300000", "there is no node 5 here"),
        ("temperature const:25", "temperatures are in K"),
        ("fault 1=open-sensor", "NAME:on"),
        ("fault broken:on", "unknown fault `broken`"),
        ("fly", "boards; watch; quit"),
        ("boards x", "\"boards\" has no argument"),
        ("watch 1", "\"watch\" has no argument"),
        ("quit now", "\"quit\" has no argument"),
        ("supply const:5", "0 to 4 V"),
    ] {
        let answer = bench.ask(&mut client, line).unwrap();
        assert!(answer["error"].as_str().unwrap().contains(words), "{line}: {answer}");
    }
    assert!(!bench.has_quit);
    bench.ask(&mut client, "quit").unwrap();
    assert!(bench.has_quit);
}

#[test]
fn watchers_receive_the_changes_of_other_clients() {
    let mut bench = Bench::new();
    let (mut watcher, mut other) = (bench.connect(), bench.connect());
    bench.ask(&mut watcher, "watch").unwrap();
    let before = bench.line(&mut watcher).unwrap()["t"].as_f64().unwrap();
    bench.ask(&mut other, "shaft rpm:60").unwrap();
    let after = bench.line(&mut watcher).unwrap()["t"].as_f64().unwrap();
    assert!(after - before < 1.0, "a change is told at once: {before} {after}");
}

/// A connection must neither read the files of this machine nor hold up the simulation with a named pipe or a device.
#[test]
fn a_connection_names_no_file() {
    let mut bench = Bench::new();
    let mut client = bench.connect();
    for line in ["pressure csv:/etc/passwd", "shaft 1=csv:/dev/zero", "thermistor  csv:Cargo.toml"] {
        let answer = bench.ask(&mut client, line).unwrap();
        assert_eq!(answer["error"], "csv: is for the command line of the simulator", "{line}");
    }
}

/// Any web page can make a browser send a request to this port, with commands in its body.
#[test]
fn a_browser_gives_no_commands() {
    let mut bench = Bench::new();
    let mut browser = bench.connect();
    let request = "POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/plain\r\n\r\nquit\n";
    browser.write_all(request.as_bytes()).unwrap();
    assert!(bench.line(&mut browser).unwrap()["error"].is_string());
    assert_eq!(bench.line(&mut browser), None);
    assert!(!bench.has_quit);
}

#[test]
fn clients_that_say_nothing_or_too_much_cost_the_others_nothing() {
    let mut bench = Bench::new();
    let mut good = bench.connect();
    bench.ask(&mut good, "boards").unwrap();
    let mut endless = bench.connect();
    let silent: Vec<TcpStream> = (0..8).map(|_| bench.connect()).collect();
    let _ = endless.write_all(&[b'x'; 8192]);
    let mut deaf = bench.connect();
    let _ = deaf.write_all("boards\n".repeat(100).as_bytes());
    for _ in 0..50 {
        assert_eq!(bench.ask(&mut good, "button 1:up").unwrap()["ok"], true);
    }
    assert_eq!(bench.line(&mut endless), None, "a line without an end is none");
    drop((silent, deaf));
}
