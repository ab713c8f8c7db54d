//! The command line: one file for each command.

mod bus;
mod by_id;
mod can_id;
mod check;
mod dbc;
mod dump;
mod explain;
mod failure;
mod info;
mod list;
mod load;
mod lss;
mod manual;
mod map;
mod monitor;
mod net;
mod nmt;
mod node_set;
mod options;
mod output;
mod paper;
mod read;
mod record;
mod replacement;
mod replay;
mod rules;
mod scan;
mod send;
mod serve;
mod session;
mod sheets;
mod simulate;
mod source;
mod store;
mod trace;
mod traffic;
mod trial;
mod update;
mod write;

use std::ffi::OsString;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

pub use failure::Failure;
pub use options::Options;
pub use output::Output;
pub use paper::Paper;
pub use session::Session;

/// Talks to CANopen nodes: read, write, watch, configure, update.
///
/// Results go to the standard output, progress and errors to the standard error output.
#[derive(Debug, Parser)]
#[command(name = "nodectl", version, max_term_width = 100, after_help = failure::EXIT_CODES)]
pub struct Cli {
    /// For every command.
    #[command(flatten)]
    pub options: Options,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Scan(scan::Scan),
    Info(info::Info),
    Read(read::Read),
    Write(write::Write),
    List(list::List),
    Map(map::Map),
    Unmap(map::Unmap),
    Dump(dump::Dump),
    Diff(dump::Diff),
    Apply(dump::Apply),
    #[command(visible_alias = "watch")]
    Monitor(monitor::Monitor),
    Record(record::Record),
    Trace(trace::Trace),
    Replay(replay::Replay),
    Send(send::Send),
    Bus(bus::Bus),
    Net(net::Net),
    Simulate(simulate::Simulate),
    Rules(rules::Rules),
    Save(store::Save),
    Restore(store::Restore),
    Nmt(nmt::Nmt),
    Lss(lss::Lss),
    Update(update::Update),
    Confirm(trial::Confirm),
    Rollback(trial::Rollback),
    Serve(serve::Serve),
    Check(check::Check),
    Explain(explain::Explain),
    Completions(manual::Completions),
    Man(manual::Man),
}

impl Cli {
    /// Parses a command line. A negative number after an option is the value of the option.
    ///
    /// # Errors
    /// The error of the command line, or the help.
    pub fn from_words<W: Into<OsString> + Clone>(
        words: impl IntoIterator<Item = W>,
    ) -> Result<Cli, clap::Error> {
        let mut command = with_negative_numbers(Cli::command());
        let mut matches = command.try_get_matches_from_mut(words)?;
        Cli::from_arg_matches_mut(&mut matches).map_err(|error| error.format(&mut command))
    }

    /// Runs the command on the bus of the options.
    ///
    /// # Errors
    /// The failure of the command.
    pub fn run(&self, output: Output) -> Result<(), Failure> {
        // `serve` opens the bus on a thread of its own, because many sessions share the bus.
        if let Command::Serve(serve) = &self.command {
            return serve.run(&self.options, output);
        }
        let mut session = if self.needs_a_bus() {
            Session::open(&self.options, output)?
        } else {
            Session::without_a_bus(&self.options, output)?
        };
        self.run_in(&mut session)
    }

    /// Whether the command needs a bus, not only files.
    fn needs_a_bus(&self) -> bool {
        match &self.command {
            Command::Diff(diff) => diff.needs_a_bus(),
            Command::Trace(trace) => trace.needs_a_bus(),
            Command::Rules(rules) => rules.needs_a_bus(),
            Command::Check(check) => check.needs_a_bus(),
            Command::Net(net) => net.needs_a_bus(),
            Command::Bus(_) | Command::Explain(_) | Command::Completions(_) | Command::Man(_) => false,
            _ => true,
        }
    }

    /// Runs the command in an open session.
    ///
    /// # Errors
    /// The failure of the command.
    pub fn run_in(&self, session: &mut Session) -> Result<(), Failure> {
        match &self.command {
            Command::Scan(scan) => scan.run(session),
            Command::Info(info) => info.run(session),
            Command::Read(read) => read.run(session),
            Command::Write(write) => write.run(session),
            Command::List(list) => list.run(session),
            Command::Map(map) => map.run(session),
            Command::Unmap(unmap) => unmap.run(session),
            Command::Dump(dump) => dump.run(session),
            Command::Diff(diff) => diff.run(session),
            Command::Apply(apply) => apply.run(session),
            Command::Monitor(monitor) => monitor.run(session),
            Command::Record(record) => record.run(session),
            Command::Trace(trace) => trace.run(session),
            Command::Replay(replay) => replay.run(session),
            Command::Send(send) => send.run(session),
            Command::Bus(bus) => bus.run(session),
            Command::Net(net) => net.run(session),
            Command::Simulate(simulate) => simulate.run(session),
            Command::Rules(rules) => rules.run(session),
            Command::Save(save) => save.run(session),
            Command::Restore(restore) => restore.run(session),
            Command::Nmt(nmt) => nmt.run(session),
            Command::Lss(lss) => lss.run(session),
            Command::Update(update) => update.run(session),
            Command::Confirm(confirm) => confirm.run(session),
            Command::Rollback(rollback) => rollback.run(session),
            Command::Serve(_) => Err(Failure::Usage("it has sessions of its own".to_owned())),
            Command::Check(check) => check.run(session),
            Command::Explain(explain) => explain.run(session),
            Command::Completions(completions) => completions.run(session),
            Command::Man(man) => man.run(session),
        }
    }
}

/// The command, with negative numbers as values of its arguments.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let command = command.mut_args(|arg| {
        let takes_values = arg.get_action().takes_values();
        if takes_values { arg.allow_negative_numbers(true) } else { arg }
    });
    command.mut_subcommands(with_negative_numbers)
}
