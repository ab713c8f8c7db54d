//! Commands that the user types while the simulation runs.

use std::io::BufRead;
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use crate::stimuli::{KINDS, Stimulus, Targeted};

/// A command.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Sets a stimulus from now on.
    Stimulus(Targeted<Stimulus>),
    /// Ends the run, with its summary.
    Quit,
}

/// The syntax of the commands.
pub fn help() -> String {
    format!("commands: {} [ID=]SPEC, e.g. pressure 1=const:300000; quit", KINDS.join("|"))
}

/// Parses one line; `None` for an empty line.
pub fn parse(line: &str) -> Option<Result<Command, String>> {
    let line = line.trim();
    let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    Some(match word {
        "" => return None,
        "quit" if rest.is_empty() => Ok(Command::Quit),
        "help" => Err(help()),
        kind if KINDS.contains(&kind) => Stimulus::parse(kind, rest.trim()).map(Command::Stimulus),
        _ => Err(format!("{word:?} is no command; {}", help())),
    })
}

/// Lines from the standard input; a separate thread reads them.
pub fn lines() -> Receiver<String> {
    let (sender, lines) = channel();
    thread::spawn(move || {
        let input = std::io::stdin().lock();
        input
            .lines()
            .map_while(Result::ok)
            .take_while(|line| sender.send(line.clone()).is_ok())
            .for_each(drop);
    });
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_read_and_other_lines_are_rejected() {
        assert_eq!(parse("  "), None);
        assert_eq!(parse(" quit "), Some(Ok(Command::Quit)));
        let Some(Ok(Command::Stimulus(stimulus))) = parse("pressure 1=const:300000") else { panic!() };
        assert_eq!(stimulus.node, Some(1));
        for line in ["fly", "pressure", "pressure 1=", "pressure nonsense", "quit now", "shaft 200=const:1"] {
            assert!(matches!(parse(line), Some(Err(_))), "{line}");
        }
    }
}
