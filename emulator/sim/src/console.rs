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

/// The syntax of the commands; `more` are those that only this input has.
pub fn help(more: &[&str]) -> String {
    let more: String = more.iter().map(|word| format!("{word}; ")).collect();
    format!("commands: {} [ID=]SPEC, e.g. pressure 1=const:300000; {more}quit", KINDS.join("|"))
}

/// Parses one line; `None` for an empty line. `more` are commands that the caller processes.
pub fn parse(line: &str, more: &[&str]) -> Option<Result<Command, String>> {
    let line = line.trim();
    let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    Some(match word {
        "" => return None,
        "quit" if rest.is_empty() => Ok(Command::Quit),
        "help" => Err(help(more)),
        kind if KINDS.contains(&kind) => Stimulus::parse(kind, rest.trim()).map(Command::Stimulus),
        _ if word == "quit" || more.contains(&word) => Err(format!("{word:?} has no argument")),
        _ => Err(format!("{word:?} is no command; {}", help(more))),
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
        let parse = |line| parse(line, &[]);
        assert_eq!(parse("  "), None);
        assert_eq!(parse(" quit "), Some(Ok(Command::Quit)));
        let Some(Ok(Command::Stimulus(stimulus))) = parse("pressure 1=const:300000") else { panic!() };
        assert_eq!(stimulus.node, Some(1));
        for line in ["fly", "pressure", "pressure 1=", "pressure nonsense", "quit now", "shaft 200=const:1"] {
            assert!(matches!(parse(line), Some(Err(_))), "{line}");
        }
    }
}
