//! The objects of the program (CiA 302-3): 1F50h, 1F51h, 1F56h, 1F57h, each at sub-index 1. Only nodes of this project
//! have 2002h, the trial of a new program, and 2003h, the authorisation of a change.

use canopen::NodeId;
use canopen::sdo::Multiplexer;

use super::{AuthorisationKey, Status};
use crate::Network;
use crate::object::at;
use crate::sdo::{Client, Error, Options};

const DATA: Multiplexer = at(0x1F50, 1);
const CONTROL: Multiplexer = at(0x1F51, 1);
const IDENTIFICATION: Multiplexer = at(0x1F56, 1);
const STATUS: Multiplexer = at(0x1F57, 1);

const TRIAL_STATE: Multiplexer = at(0x2002, 1);
const TRIAL_COMMAND: Multiplexer = at(0x2002, 2);

const BOARD: Multiplexer = at(0x2004, 1);

const SERIAL_NUMBER: Multiplexer = at(0x1018, 4);
const AUTHORISATION_STATE: Multiplexer = at(0x2003, 1);
const CHALLENGE: Multiplexer = at(0x2003, 2);
const RESPONSE: Multiplexer = at(0x2003, 3);

/// Names of the objects, for errors.
const NAMES: [(Multiplexer, &str); 10] = [
    (DATA, "Program data"),
    (CONTROL, "Program control"),
    (IDENTIFICATION, "Program software identification"),
    (STATUS, "Flash status identification"),
    (TRIAL_STATE, "Program trial: state"),
    (TRIAL_COMMAND, "Program trial: command"),
    (AUTHORISATION_STATE, "Program authorisation: state"),
    (CHALLENGE, "Program authorisation: challenge"),
    (RESPONSE, "Program authorisation: response"),
    (BOARD, "Program state: board"),
];

/// The portable values of 1F51h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Command {
    /// Stop the program: the loader answers.
    Stop = 0,
    /// Start the program.
    Start = 1,
    /// Clear the program.
    Clear = 3,
}

/// The program of a node.
pub struct Program<'n> {
    network: &'n mut Network,
    node: NodeId,
    options: Options,
}

impl<'n> Program<'n> {
    /// The program of this node.
    pub fn new(network: &'n mut Network, node: NodeId, options: Options) -> Program<'n> {
        Program { network, node, options }
    }

    /// Whether the program runs. If not, the loader answers.
    ///
    /// # Errors
    /// SDO errors.
    pub fn is_running(&mut self) -> Result<bool, Error> {
        Ok(self.read(CONTROL)?.first() == Some(&1))
    }

    /// The identification of the program. `None` where the node does not tell it: no such object, or 0.
    ///
    /// # Errors
    /// SDO errors.
    pub fn identification(&mut self) -> Result<Option<u32>, Error> {
        Ok(self.word(IDENTIFICATION)?.filter(|&id| id != 0))
    }

    /// The code of the board, which the header of an image names. `None` where the node has no such object: only nodes
    /// of this project have it.
    ///
    /// # Errors
    /// SDO errors.
    pub fn board(&mut self) -> Result<Option<u32>, Error> {
        self.word(BOARD)
    }

    /// The status of the flash. `None` where the node has no such object.
    ///
    /// # Errors
    /// SDO errors.
    pub fn status(&mut self) -> Result<Option<Status>, Error> {
        Ok(self.word(STATUS)?.map(Status::from_word))
    }

    /// Whether the running program is on trial: without a confirmation the former program is restored. Only for nodes of
    /// this project.
    ///
    /// # Errors
    /// SDO errors.
    pub fn is_on_trial(&mut self) -> Result<bool, Error> {
        match self.read(TRIAL_STATE) {
            Ok(state) => Ok(state.first() == Some(&1)),
            // Programs of the time before trials have no such object.
            Err(error) if error.is_absent() => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Whether the node demands an authorisation that it has not had since its start. Only for nodes of this project.
    ///
    /// # Errors
    /// SDO errors.
    pub fn is_closed(&mut self) -> Result<bool, Error> {
        Ok(self.authorisation()? == 1)
    }

    /// Whether the node demands an authorisation after each of its starts. Only for nodes of this project.
    ///
    /// # Errors
    /// SDO errors.
    pub fn is_guarded(&mut self) -> Result<bool, Error> {
        Ok(self.authorisation()? != 0)
    }

    fn authorisation(&mut self) -> Result<u8, Error> {
        match self.read(AUTHORISATION_STATE) {
            Ok(state) => Ok(state.first().copied().unwrap_or(0)),
            // Programs of the time before authorisations, and bootloaders without a key, have no such object.
            Err(error) if error.is_absent() => Ok(0),
            Err(error) => Err(error),
        }
    }

    /// Answers the challenge of the node. The node then accepts commands until its next start.
    ///
    /// # Errors
    /// SDO errors. The node refuses the response of a wrong key.
    pub fn open(&mut self, key: &AuthorisationKey) -> Result<(), Error> {
        let serial_number = self.word(SERIAL_NUMBER)?.unwrap_or_default();
        // A challenge of a wrong length has no valid answer, so that the node will refuse the response.
        let challenge = self.read(CHALLENGE)?.try_into().unwrap_or_default();
        let response = key.response(challenge, serial_number);
        self.client(self.options).download(RESPONSE, &response, |_| ()).map_err(named)
    }

    /// Confirms the running program. The node ends the trial a moment later.
    ///
    /// # Errors
    /// SDO errors.
    pub fn confirm(&mut self) -> Result<(), Error> {
        self.client(self.options).download(TRIAL_COMMAND, b"conf", |_| ()).map_err(named)
    }

    /// Withdraws the running program. The node restarts a moment later and restores the previous program.
    ///
    /// # Errors
    /// SDO errors.
    pub fn roll_back(&mut self) -> Result<(), Error> {
        self.client(self.options).download(TRIAL_COMMAND, b"back", |_| ()).map_err(named)
    }

    /// Sends a command that the node acknowledges.
    ///
    /// # Errors
    /// SDO errors.
    pub fn command(&mut self, command: Command) -> Result<(), Error> {
        self.client(self.options).download(CONTROL, &[command as u8], |_| ()).map_err(named)
    }

    /// Sends a command that restarts the node. The command is sent once, and a missing answer is no error.
    ///
    /// # Errors
    /// The node refuses, or the bus is lost.
    pub fn restart(&mut self, command: Command) -> Result<(), Error> {
        self.client(self.options).command(CONTROL, command as u8).map_err(named)
    }

    /// Downloads the program in blocks. The download is not repeated, because half a program has to be cleared first.
    ///
    /// # Errors
    /// SDO errors.
    pub fn download_blocks(&mut self, bytes: &[u8], progress: impl FnMut(usize)) -> Result<(), Error> {
        let once = Options { retries: 0, ..self.options };
        self.client(once).block_download(DATA, bytes, progress).map_err(named)
    }

    /// Downloads the program in segments.
    ///
    /// # Errors
    /// SDO errors.
    pub fn download_segments(&mut self, bytes: &[u8], progress: impl FnMut(usize)) -> Result<(), Error> {
        let once = Options { retries: 0, ..self.options };
        self.client(once).download(DATA, bytes, progress).map_err(named)
    }

    fn word(&mut self, at: Multiplexer) -> Result<Option<u32>, Error> {
        match self.read(at) {
            Ok(bytes) => Ok(bytes.try_into().ok().map(u32::from_le_bytes)),
            Err(error) if error.is_absent() => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn read(&mut self, at: Multiplexer) -> Result<Vec<u8>, Error> {
        self.client(self.options).upload(at).map_err(named)
    }

    fn client(&mut self, options: Options) -> Client<'_> {
        Client::new(self.network, self.node, options)
    }
}

fn named(error: Error) -> Error {
    let name = NAMES.iter().find(|(at, _)| *at == error.at).map(|(_, name)| (*name).to_owned());
    Error { name, ..error }
}
