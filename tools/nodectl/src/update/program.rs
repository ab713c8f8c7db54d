//! The objects of the program (CiA 302-3): 1F50h, 1F51h, 1F56h, 1F57h, each at sub-index 1; and of nodes of this project alone 2002h,
//! the trial of a new program, and 2003h, who may change the program.

use canopen::NodeId;
use canopen::client::sdo;
use canopen::sdo::Multiplexer;

use super::{AuthorisationKey, Status};
use crate::Network;
use crate::object::at;
use crate::sdo::{Cause, Client, Error, Options};

const DATA: Multiplexer = at(0x1F50, 1);
const CONTROL: Multiplexer = at(0x1F51, 1);
const IDENTIFICATION: Multiplexer = at(0x1F56, 1);
const STATUS: Multiplexer = at(0x1F57, 1);

const TRIAL_STATE: Multiplexer = at(0x2002, 1);
const TRIAL_COMMAND: Multiplexer = at(0x2002, 2);

const SERIAL_NUMBER: Multiplexer = at(0x1018, 4);
const AUTHORISATION_STATE: Multiplexer = at(0x2003, 1);
const CHALLENGE: Multiplexer = at(0x2003, 2);
const RESPONSE: Multiplexer = at(0x2003, 3);

/// Names of the objects, for errors.
const NAMES: [(Multiplexer, &str); 9] = [
    (DATA, "Program data"),
    (CONTROL, "Program control"),
    (IDENTIFICATION, "Program software identification"),
    (STATUS, "Flash status identification"),
    (TRIAL_STATE, "Program trial: state"),
    (TRIAL_COMMAND, "Program trial: command"),
    (AUTHORISATION_STATE, "Program authorisation: state"),
    (CHALLENGE, "Program authorisation: challenge"),
    (RESPONSE, "Program authorisation: response"),
];

/// What 1F51h takes. More is not portable.
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

    /// Whether it runs; if not, the loader answers.
    ///
    /// # Errors
    /// Those of SDO.
    pub fn is_running(&mut self) -> Result<bool, Error> {
        Ok(self.read(CONTROL)?.first() == Some(&1))
    }

    /// What identifies the program. `None` where the node does not say: no such object, or 0.
    ///
    /// # Errors
    /// Those of SDO.
    pub fn identification(&mut self) -> Result<Option<u32>, Error> {
        Ok(self.word(IDENTIFICATION)?.filter(|&id| id != 0))
    }

    /// The status of the flash. `None` where the node has no such object.
    ///
    /// # Errors
    /// Those of SDO.
    pub fn status(&mut self) -> Result<Option<Status>, Error> {
        Ok(self.word(STATUS)?.map(Status::from_word))
    }

    /// Whether the program that runs is on trial: the one before comes back unless it is confirmed. Of nodes of this project only.
    ///
    /// # Errors
    /// Those of SDO.
    pub fn is_on_trial(&mut self) -> Result<bool, Error> {
        match self.read(TRIAL_STATE) {
            Ok(state) => Ok(state.first() == Some(&1)),
            // A program from before there were trials.
            Err(error) if error.is_absent() => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Whether the node wants to know who changes its program, and nobody has told it since its start. Of nodes of this project only.
    ///
    /// # Errors
    /// Those of SDO.
    pub fn is_closed(&mut self) -> Result<bool, Error> {
        match self.read(AUTHORISATION_STATE) {
            Ok(state) => Ok(state.first() == Some(&1)),
            // A program from before there were challenges, or a bootloader without a key.
            Err(error) if error.is_absent() => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Answers the challenge of the node: it takes commands until its next start.
    ///
    /// # Errors
    /// Those of SDO: the node refuses the response of another key.
    pub fn open(&mut self, key: &AuthorisationKey) -> Result<(), Error> {
        let serial_number = self.word(SERIAL_NUMBER)?.unwrap_or_default();
        // A challenge of another length has no answer: the node will say so.
        let challenge = self.read(CHALLENGE)?.try_into().unwrap_or_default();
        let response = key.response(challenge, serial_number);
        self.client(self.options).download(RESPONSE, &response, |_| ()).map_err(named)
    }

    /// Confirms the program that runs. The node ends the trial a moment later.
    ///
    /// # Errors
    /// Those of SDO.
    pub fn confirm(&mut self) -> Result<(), Error> {
        self.client(self.options).download(TRIAL_COMMAND, b"conf", |_| ()).map_err(named)
    }

    /// A command that is acknowledged.
    ///
    /// # Errors
    /// Those of SDO.
    pub fn command(&mut self, command: Command) -> Result<(), Error> {
        self.client(self.options).download(CONTROL, &[command as u8], |_| ()).map_err(named)
    }

    /// A command that restarts the node: it is given once, and silence is fine.
    ///
    /// # Errors
    /// The node refuses, or the bus is lost.
    pub fn restart(&mut self, command: Command) -> Result<(), Error> {
        let once = Options { retries: 0, ..self.options };
        match self.client(once).download(CONTROL, &[command as u8], |_| ()) {
            Err(Error { cause: Cause::Transfer(sdo::Error::NoAnswer), .. }) => Ok(()),
            result => result.map_err(named),
        }
    }

    /// Downloads the program in blocks. It is not begun anew: half a program has to be cleared first.
    ///
    /// # Errors
    /// Those of SDO.
    pub fn download_blocks(&mut self, bytes: &[u8], progress: impl FnMut(usize)) -> Result<(), Error> {
        let once = Options { retries: 0, ..self.options };
        self.client(once).block_download(DATA, bytes, progress).map_err(named)
    }

    /// Downloads the program in segments.
    ///
    /// # Errors
    /// Those of SDO.
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
