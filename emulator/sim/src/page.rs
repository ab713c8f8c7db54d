//! The page in the browser: a separate program (`nodectl serve`), which gets two connections to the simulator.

use std::io::{BufRead as _, BufReader};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use serde_json::Value;

use crate::gateway::BUS_NAME;

/// Time limit for the program to report the address of the page.
const PATIENCE: Duration = Duration::from_secs(10);

/// The program that serves the page. The program ends when its standard input closes, and so with the simulator in any
/// case.
pub(crate) struct Page {
    /// Owns the other end of the program's standard input.
    _program: Option<Child>,
    address: Result<String, String>,
}

/// The connections for the program, and the address for the page.
pub(crate) struct Connections {
    pub(crate) socketcand: SocketAddr,
    pub(crate) control: SocketAddr,
    pub(crate) page: SocketAddr,
}

impl Page {
    /// The address for the browser, or the reason why there is no page.
    pub(crate) fn address(&self) -> Result<&str, &str> {
        self.address.as_deref().map_err(String::as_str)
    }

    /// Starts the program, and waits until it reports the address of the page. A failure does not stop the simulation.
    pub(crate) fn start(program: &Path, connections: &Connections) -> Page {
        let Connections { socketcand, control, page } = connections;
        let mut command = Command::new(program);
        command.args(["--json", "serve", &format!("socketcand://{socketcand}/{BUS_NAME}")]);
        command.args([
            "--page",
            &page.to_string(),
            "--stimuli",
            &control.to_string(),
            "--until-end-of-input",
        ]);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut program = match command.spawn() {
            Ok(program) => program,
            Err(error) => {
                let reason = format!("cannot start {}: {error}", program.display());
                return Page { _program: None, address: Err(reason) };
            }
        };
        let output = program.stdout.take();
        let (sender, lines) = channel();
        thread::spawn(move || {
            let mut line = String::new();
            let _ = output.map(|output| BufReader::new(output).read_line(&mut line));
            let _ = sender.send(line);
        });
        let line = lines.recv_timeout(PATIENCE).unwrap_or_default();
        Page { _program: Some(program), address: address(&line) }
    }
}

fn address(line: &str) -> Result<String, String> {
    let said: Value = serde_json::from_str(line).unwrap_or_default();
    match (said["page"].as_str(), said["error"].as_str()) {
        (Some(address), _) => Ok(address.to_owned()),
        (None, error) => Err(error.unwrap_or("it does not say where the page is").to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_says_where_the_page_is_or_why_there_is_none() {
        assert_eq!(address(r#"{"page":"http://127.0.0.1:1/"}"#).as_deref(), Ok("http://127.0.0.1:1/"));
        assert_eq!(address(r#"{"error":"no","exit_code":2}"#), Err("no".to_owned()));
        assert!(address("").is_err());
    }
}
