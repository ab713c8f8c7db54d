//! The page in the browser: a program of its own (`nodectl serve`), with which the simulator shares two connections.

use std::io::{BufRead as _, BufReader};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use serde_json::Value;

use crate::gateway::BUS_NAME;

/// How long the program may take to say where the page is.
const PATIENCE: Duration = Duration::from_secs(10);

/// The program that serves the page. It ends when its standard input does: with the simulator, however that ends.
pub(crate) struct Page {
    /// Holds the other end of its standard input.
    _program: Option<Child>,
    address: Result<String, String>,
}

/// The connections that the program is given, and where the page is to be.
pub(crate) struct Connections {
    pub(crate) socketcand: SocketAddr,
    pub(crate) control: SocketAddr,
    pub(crate) page: SocketAddr,
}

impl Page {
    /// What a browser opens, or why there is nothing to open.
    pub(crate) fn address(&self) -> Result<&str, &str> {
        self.address.as_deref().map_err(String::as_str)
    }

    /// Starts the program, and waits until it says where the page is. Without it the simulation runs all the same.
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
