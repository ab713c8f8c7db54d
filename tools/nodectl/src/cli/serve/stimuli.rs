//! The control connection of a simulator. A command is a line, and the answer is a line of JSON (docs/page.md).

use std::io::{self, BufRead, BufReader, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::mpsc::Sender;
use std::thread;
use std::time::Duration;

use serde_json::Value as Json;

use super::order::Order;

/// The time-out for an answer of the simulator.
const PATIENCE: Duration = Duration::from_secs(5);
/// The time between two attempts to connect to the simulator.
const AGAIN: Duration = Duration::from_secs(1);
/// The stimuli that a page may change.
const KINDS: [&str; 9] =
    ["pressure", "temperature", "thermistor", "supply", "power", "shaft", "ssi", "button", "fault"];

/// Passes every change of the stimuli to the pump, also a change by another program. Ends with the pump.
pub(super) fn watch(control: SocketAddr, orders: Sender<Order>) {
    thread::spawn(move || {
        // A lost simulator may come back.
        while listen(control, &orders).is_ok() {
            thread::sleep(AGAIN);
        }
    });
}

/// Passes changes to the pump until the connection is lost. Fails when the pump has ended.
fn listen(control: SocketAddr, orders: &Sender<Order>) -> Result<(), ()> {
    let Ok(mut stream) = TcpStream::connect_timeout(&control, PATIENCE) else { return Ok(()) };
    if stream.write_all(b"watch\n").is_err() {
        return Ok(());
    }
    for line in BufReader::new(stream).lines().map_while(Result::ok) {
        let news: Option<Json> = serde_json::from_str(&line).ok();
        if let Some(news) = news.filter(|news| news["boards"].is_array()) {
            orders.send(Order::Stimuli(news)).map_err(drop)?;
        }
    }
    Ok(())
}

/// Sends a command and returns the answer.
///
/// # Errors
/// The error text of the simulator, or the reason why it cannot be reached.
pub(super) fn ask(control: SocketAddr, command: &str) -> Result<Json, String> {
    let line =
        exchange(control, command).map_err(|error| format!("the simulator does not answer: {error}"))?;
    let answer: Json = serde_json::from_str(&line).map_err(|_| "the simulator answers no JSON".to_owned())?;
    match answer["error"].as_str() {
        Some(error) => Err(error.to_owned()),
        None => Ok(answer),
    }
}

fn exchange(control: SocketAddr, command: &str) -> io::Result<String> {
    let mut stream = TcpStream::connect_timeout(&control, PATIENCE)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    stream.write_all(format!("{command}\n").as_bytes())?;
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line)?;
    Ok(line)
}

/// The command that changes a stimulus.
///
/// # Errors
/// The text has more than one line, or contains another command.
pub(super) fn command(board: u8, kind: &str, spec: &str) -> Result<String, String> {
    let is_plain = |text: &str| !text.is_empty() && !text.chars().any(char::is_control);
    if !KINDS.contains(&kind) || !is_plain(spec) {
        return Err(format!("{kind:?} {spec:?} is no stimulus"));
    }
    Ok(format!("{kind} {board}={spec}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stimulus_is_one_line_and_no_other_command() {
        assert_eq!(command(1, "pressure", "const:300000").unwrap(), "pressure 1=const:300000");
        for kind in ["supply", "power", "ssi"] {
            assert_eq!(command(2, kind, "off").unwrap(), format!("{kind} 2=off"));
        }
        for (kind, spec) in [
            ("quit", "1"),
            ("pressure", "const:1\nquit"),
            ("pressure", ""),
            ("pressure 1=const:1\nquit", "x"),
        ] {
            assert!(command(1, kind, spec).is_err(), "{kind} {spec}");
        }
    }
}
