//! The end of a trial (2002h): the program of a node is confirmed, or the previous one is restored.

use canopen::{Duration, NodeId};

use ::update::{Reason, Refusal};

use super::waiting::{POLL, RESTART, wait_until_running};
use super::{AuthorisationKey, Command, Error, Program, Status};
use crate::Network;
use crate::sdo::Options;

/// How long a node may take to end a trial, and to copy the previous program back.
const CONFIRM: Duration = Duration::from_millis(5_000);
const ROLLBACK: Duration = Duration::from_millis(60_000);

/// The end of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// The program on trial stays.
    Confirm,
    /// The previous program is restored.
    RollBack,
}

/// Ends the trial of the program of a node. A node in its bootloader starts the program first.
///
/// # Errors
/// [`Error::NoTrial`]; [`Error::Closed`] without the key that the node asks for; [`Error::Stuck`]; SDO errors.
pub fn decide(
    network: &mut Network,
    node: NodeId,
    decision: Decision,
    options: Options,
    key: Option<&AuthorisationKey>,
) -> Result<(), Error> {
    if !Program::new(network, node, options).is_running()? {
        open(network, node, options, key)?;
        Program::new(network, node, options).restart(Command::Start)?;
        wait_until_running(network, node, options, (true, RESTART), "start its program")?;
    }
    if !Program::new(network, node, options).is_on_trial()? {
        return Err(Error::NoTrial { node });
    }
    open(network, node, options, key)?;
    match decision {
        Decision::Confirm => confirm(network, node, options),
        Decision::RollBack => roll_back(network, node, options),
    }
}

/// Answers the challenge of a node that demands an authorisation.
pub(super) fn open(
    network: &mut Network,
    node: NodeId,
    options: Options,
    key: Option<&AuthorisationKey>,
) -> Result<(), Error> {
    let mut program = Program::new(network, node, options);
    if program.is_closed()? {
        program.open(key.ok_or(Error::Closed { node })?)?;
    }
    Ok(())
}

/// Confirms the program on trial, and waits for the end of the trial.
pub(super) fn confirm(network: &mut Network, node: NodeId, options: Options) -> Result<(), Error> {
    Program::new(network, node, options).confirm()?;
    let until = network.now() + CONFIRM;
    while Program::new(network, node, options).is_on_trial()? {
        if network.now() >= until {
            return Err(Error::Stuck { node, what: "confirm its program" });
        }
        network.pause(POLL)?;
    }
    Ok(())
}

/// Whether a status means that the previous program was restored.
fn is_taken_back(status: Status) -> bool {
    status.code == Refusal::TakenBack { reason: Reason::Withdrawn }.code()
}

/// Withdraws the program on trial, and waits until the previous one runs.
fn roll_back(network: &mut Network, node: NodeId, options: Options) -> Result<(), Error> {
    Program::new(network, node, options).roll_back()?;
    let until = network.now() + ROLLBACK;
    while network.now() < until {
        let mut program = Program::new(network, node, options);
        let is_decided =
            program.is_running().and_then(|is_running| Ok(is_running && !program.is_on_trial()?));
        match is_decided {
            // A node whose previous program is damaged keeps the present one.
            Ok(true) if program.status()?.is_some_and(is_taken_back) => return Ok(()),
            Ok(true) => break,
            Err(error) if !error.may_pass() || error.is_bus_lost() => return Err(error.into()),
            _ => network.pause(POLL)?,
        }
    }
    Err(Error::Stuck { node, what: "restore its previous program" })
}
