//! `nodectl net`: a whole bus by its file.

mod apply;
mod check;
mod dump;
mod finding;
mod senders;
mod watch;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use canopen::Duration;
use clap::{Args, Subcommand};

use super::session::{sheet, whole};
use super::{Failure, Session};
use crate::Catalogue;
use crate::net::{File, Plan, PlannedNode, schema};

/// The largest file of a bus.
const LARGEST: u64 = 1 << 20;

/// How long to listen after the last question of a scan.
const LISTEN: Duration = Duration::from_millis(200);

/// Checks and configures all nodes of a bus by one file, as the boot-up of CiA 302-2.
#[derive(Debug, Args)]
pub(super) struct Net {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Compares the bus with the file, and changes nothing. Each difference is a line.
    Check(Checked),
    /// Configures and starts the nodes of the file. A node with another identity is left alone.
    Apply(Applied),
    /// Writes the file of the present bus, and a configuration file (DCF) for each node with a data sheet.
    Dump(Dumped),
    /// Prints the schema of the file (JSON Schema), for editors.
    Schema,
}

#[derive(Debug, Args)]
struct Checked {
    /// The file of the bus (YAML).
    file: PathBuf,
}

#[derive(Debug, Args)]
struct Applied {
    /// The file of the bus (YAML).
    file: PathBuf,

    /// Write the values also where the date of the configuration (1020h) is that of the file.
    #[arg(long)]
    all: bool,

    /// Then watch the bus: a node that returns is configured and started again.
    #[arg(long)]
    watch: bool,

    /// End the watch after this number of seconds.
    #[arg(long = "for", value_name = "SECONDS", requires = "watch")]
    duration: Option<u32>,
}

#[derive(Debug, Args)]
struct Dumped {
    /// The file to write. The configuration files are beside it.
    file: PathBuf,
}

impl Net {
    pub(super) fn needs_a_bus(&self) -> bool {
        !matches!(self.command, Command::Schema)
    }

    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        match &self.command {
            Command::Check(Checked { file }) => {
                check::run(session, &load(file)?).map_err(|failure| in_file(file, failure))
            }
            Command::Apply(how) => {
                apply::run(session, &load(&how.file)?, how).map_err(|failure| in_file(&how.file, failure))
            }
            Command::Dump(Dumped { file }) => dump::run(session, file),
            Command::Schema => Ok(session.output.write(format!("{:#}\n", schema()).as_bytes())?),
        }
    }
}

/// The plan of a file, with the files that it names.
fn load(path: &Path) -> Result<Plan, Failure> {
    let text = wire::input::read_to_string(path, LARGEST).map_err(|error| Failure::file(path, error))?;
    let file = File::parse(&text).map_err(|reason| Failure::file(path, reason))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let plan = Plan::new(file, |named| sheet(&folder.join(named)), |named| whole(&folder.join(named)));
    plan.map_err(|failure| in_file(path, failure))
}

/// A mistake with the name of the file.
fn in_file(path: &Path, failure: Failure) -> Failure {
    match failure {
        Failure::Plan(error) => Failure::file(path, error),
        other => other,
    }
}

/// The data sheet of a node: that of the file, else the one that fits the identity.
fn catalogue(session: &mut Session, planned: &PlannedNode) -> Result<Arc<Catalogue>, Failure> {
    if let Some(catalogue) = &planned.catalogue {
        session.know(planned.node, Arc::clone(catalogue));
    }
    session.catalogue(planned.node)
}

/// How long to wait for a heartbeat of this time.
fn patience(heartbeat: Duration) -> Duration {
    Duration(heartbeat.0 * 3 / 2)
}
