//! The program on the bus: effects of a master's commands, and values of the objects of CiA 302-3.

use bsp::ProgramFlash;
use bsp::boards::BOARD;
use bsp::chip::retained;
use canopen::dictionary::{Entry, Field};
use canopen::sdo::{Abort, Multiplexer};
use canopen::{Application, Part, Reset};
use update::{AUTHORISATION_KEY, Authorisation, Proof, Refusal, Updater};

use crate::dictionary::DICTIONARY;
use crate::identity::Identity;
use crate::target::TARGET;

/// Commands of 1F51h (CiA 302-3).
const STOP: u8 = 0;
const START: u8 = 1;
const RESET: u8 = 2;
const CLEAR: u8 = 3;

const HARDWARE: Field = DICTIONARY.field(0x1009, 0);
const IDENTITY: [Field; 4] = [
    DICTIONARY.field(0x1018, 1),
    DICTIONARY.field(0x1018, 2),
    DICTIONARY.field(0x1018, 3),
    DICTIONARY.field(0x1018, 4),
];
const PROGRAM_CONTROL: Field = DICTIONARY.field(0x1F51, 1);
const STATUS: Field = DICTIONARY.field(0x1F57, 1);
/// State and challenge, in a bootloader with an authorisation key.
const AUTHORISATION: Option<[Field; 2]> = if AUTHORISATION_KEY.is_some() {
    Some([DICTIONARY.field(0x2003, 1), DICTIONARY.field(0x2003, 2)])
} else {
    None
};

/// The update in progress, as the application of the CANopen device.
pub(crate) struct Program {
    updater: Updater<ProgramFlash>,
    authorisation: Authorisation,
    /// 1018h:2.
    product: u32,
    /// 1018h:4.
    serial_number: u32,
    /// A master has requested the start of the program, which is allowed.
    starts: bool,
}

impl Program {
    pub(crate) fn new(
        updater: Updater<ProgramFlash>,
        authorisation: Authorisation,
        identity: &Identity,
    ) -> Program {
        let &Identity { product, serial_number, .. } = identity;
        Program { updater, authorisation, product, serial_number, starts: false }
    }

    pub(crate) fn updater(&mut self) -> &mut Updater<ProgramFlash> {
        &mut self.updater
    }

    /// Whether the application must be started.
    pub(crate) fn starts(&self) -> bool {
        self.starts
    }

    /// Writes the present values of the program's objects. 1F56h stays 0, because no program runs.
    pub(crate) fn show(&self, image: &mut [u8]) {
        PROGRAM_CONTROL.store(image, [STOP]);
        STATUS.store(image, self.updater.status().word().to_le_bytes());
        if let Some([state, challenge]) = AUTHORISATION {
            state.store(image, [self.authorisation.state()]);
            challenge.store(image, self.authorisation.challenge());
        }
    }

    /// Refuses a change of the program until the challenge has been answered, if a key is set.
    fn admit(&self) -> Result<(), Abort> {
        if AUTHORISATION_KEY.is_none() || self.authorisation.is_open() {
            Ok(())
        } else {
            Err(Abort::DeviceState)
        }
    }

    fn control(&mut self, command: u8) -> Result<(), Abort> {
        self.admit()?;
        match command {
            // The program is stopped and reset already.
            STOP | RESET => Ok(()),
            START => self.start(),
            CLEAR => self.clear(),
            _ => Err(Abort::InvalidValue),
        }
    }

    fn clear(&mut self) -> Result<(), Abort> {
        let mut clears = retained::clears();
        let outcome = self.updater.clear_within(&mut clears);
        retained::set_clears(clears);
        outcome.map_err(abort)
    }

    fn answer(&mut self, response: &[u8]) -> Result<(), Abort> {
        let is_right = response.try_into().is_ok_and(|response| self.authorisation.answer(response));
        if is_right { Ok(()) } else { Err(Abort::InvalidValue) }
    }

    fn start(&mut self) -> Result<(), Abort> {
        if self.updater.status().busy {
            return Err(Abort::DeviceState);
        }
        let found = update::application(self.updater.flash(), &TARGET, Proof::Waived);
        self.starts = found.is_ok() || crate::start::unsigned().is_some();
        if self.starts { Ok(()) } else { Err(Abort::DeviceState) }
    }
}

impl Application for Program {
    /// Block upload is off: the longest readable value is a short text.
    const BLOCK_UPLOAD: bool = false;

    fn initialise(&mut self, _: Reset, image: &mut [u8]) {
        HARDWARE.set(image, BOARD.name.as_bytes());
        let identity =
            [profiles::product::VENDOR_ID, self.product, profiles::product::REVISION, self.serial_number];
        for (field, value) in IDENTITY.into_iter().zip(identity) {
            field.store(image, value.to_le_bytes());
        }
        self.show(image);
    }

    /// Handles 1F51h:1 and, in a bootloader with a key, 2003h:3, which has eight bytes.
    fn write(&mut self, _: &Entry, bytes: &[u8], _: &mut [u8]) -> Result<(), Abort> {
        match bytes {
            &[command] => self.control(command),
            response if AUTHORISATION_KEY.is_some() => self.answer(response),
            _ => Err(Abort::Access),
        }
    }

    /// Handles 1F50h:1, the only domain.
    fn write_domain(&mut self, _: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        self.admit()?;
        let updater = &mut self.updater;
        let outcome = match part {
            Part::Begin(size) => updater.begin(size.map(|size| size.try_into().unwrap_or(u32::MAX))),
            Part::Data(_, bytes) => updater.receive(bytes),
            Part::End(_) => updater.finish(),
        };
        outcome.map_err(abort)
    }
}

/// The abort code of a refusal for the SDO client; 1F57h has the details.
fn abort(refusal: Refusal) -> Abort {
    match refusal {
        Refusal::NotCleared | Refusal::OnTrial | Refusal::Worn | Refusal::Unspecified => Abort::DeviceState,
        _ => Abort::Hardware,
    }
}
