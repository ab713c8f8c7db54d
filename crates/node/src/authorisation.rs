//! 2003h: permission to change the program (docs/update.md). If the bootloader has a key, a client must answer the
//! challenge of this start.

use canopen::dictionary::{Group, Groups};
use canopen::sdo::Abort;
use profiles::communication::{PERSONALITY, PROGRAM_AUTHORISATION, PROGRAM_TRIAL};
use update::{Authorisation, Cause};

use crate::Protocol;
use crate::application::NodeApplication;

/// Whether a write decides which program runs, or what is confirmed. Restored defaults and another personality change the
/// times of the trial (2002h).
fn has_effect_on_program(index: u16, sub: u8) -> bool {
    match index {
        0x1011 => Groups::of_sub(sub).is_some_and(|groups| groups.contains(Group::Application)),
        0x1F51 | PERSONALITY | PROGRAM_TRIAL => true,
        _ => false,
    }
}

impl Protocol {
    /// Takes the authorisation that the bootloader has left. To be called before the start.
    pub fn set_authorisation(&mut self, authorisation: Authorisation) {
        self.device.application_mut().authorisation = authorisation;
    }
}

impl NodeApplication {
    /// Refuses a write that has an effect on the program until the challenge has been answered.
    pub(crate) fn admit(&self, index: u16, sub: u8) -> Result<(), Abort> {
        let is_free = self.authorisation.is_open() || !has_effect_on_program(index, sub);
        if is_free { Ok(()) } else { Err(Abort::DeviceState) }
    }

    /// Handles a write to 2003h:3.
    pub(crate) fn answer(&mut self, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        if !self.authorisation.asks() {
            return Err(Abort::DeviceState);
        }
        let is_right = bytes.try_into().is_ok_and(|response| self.authorisation.answer(response));
        self.show_authorisation(image);
        if is_right { Ok(()) } else { Err(Abort::InvalidValue) }
    }

    /// The sender of a command that [`admit`](Self::admit) accepts: the holder of the key, if there is a key.
    pub(crate) fn commander(&self) -> Cause {
        if self.authorisation.asks() { Cause::Holder } else { Cause::Command }
    }

    pub(crate) fn show_authorisation(&self, image: &mut [u8]) {
        let authorisation = &self.authorisation;
        self.show(PROGRAM_AUTHORISATION, 1, &[authorisation.state()], image);
        self.show(PROGRAM_AUTHORISATION, 2, &authorisation.challenge(), image);
    }
}
