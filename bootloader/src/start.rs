//! The decision at every start: the application, or the bus.

use bsp::chip::handover::Handover;
use bsp::chip::vectors::Vectors;
use bsp::chip::{application, factory, memory, retained};
use bsp::start::loader::Loader;
use update::key::KEY_LEN;
use update::{AUTHORISATION_KEY, Authorisation, Decision, Pair, Reset, Start, Status, Stay};

use crate::target::TARGET;

/// Why the bootloader stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reason {
    /// On request, or because there is no application that may be started; with the value of 1F57h.
    Stay(Status),
    /// A checked image waits to be copied.
    Copy,
    /// The previous image must be restored.
    Revert,
}

/// Result of the decision.
pub(crate) enum Outcome {
    /// Start the application.
    Application(Vectors),
    /// Stay for this reason; with the note that was left in RAM.
    Stay(Reason, Option<Handover>),
}

/// Counts the reset, takes the request out of the note in RAM, and decides.
pub(crate) fn decide(loader: &mut Loader) -> Outcome {
    retained::set_development(cfg!(feature = "development"));
    match &AUTHORISATION_KEY {
        Some(key) => retained::set_authorisation(&pair(key)),
        None => retained::forget_authorisation(),
    }
    let note = retained::handover();
    if let Some(note) = note {
        retained::hand_over(&Handover { stay: false, ..note });
    }
    let crashes = retained::crashes().after(loader.reset);
    retained::set_crashes(crashes);
    if loader.reset == Reset::Power {
        retained::forget_proof();
    }
    let start = Start {
        stay: note.is_some_and(|note| note.stay),
        reset: loader.reset,
        crashes,
        proof: retained::proof(),
    };
    let mut seal = 0;
    match update::boot_sealed(&mut loader.flash, &TARGET, start, &mut seal) {
        Decision::Start(_) => {
            retained::set_proof(seal);
            application::vectors().map_or(stay(Stay::Asked, note), Outcome::Application)
        }
        Decision::Copy => Outcome::Stay(Reason::Copy, note),
        Decision::Revert => Outcome::Stay(Reason::Revert, note),
        Decision::Stay(why @ Stay::NoProgram(_)) => unsigned().map_or(stay(why, note), Outcome::Application),
        Decision::Stay(why) => stay(why, note),
    }
}

/// Challenge and response of this start. The pair of the previous start is part of the noise, so without a power cut no
/// pair repeats.
#[inline(never)]
fn pair(key: &[u8; KEY_LEN]) -> Pair {
    Pair::new(key, &memory::noise::<256>(), factory::serial_number())
}

/// The authorisation of this start. It is given already if the application has requested the bootloader; otherwise a
/// client must answer the challenge.
pub(crate) fn authorisation(note: Option<Handover>) -> Authorisation {
    let pair = AUTHORISATION_KEY.and_then(|_| retained::authorisation());
    Authorisation::new(pair, note.is_some_and(|note| note.stay))
}

fn stay(why: Stay, note: Option<Handover>) -> Outcome {
    Outcome::Stay(Reason::Stay(why.status()), note)
}

/// An application written by a debugger: valid vectors and no header at all. Only a development bootloader starts it.
#[cfg(feature = "development")]
pub(crate) fn unsigned() -> Option<Vectors> {
    let vectors = application::vectors().filter(|_| application::has_no_header());
    vectors.inspect(|_| retained::set_proof(application::SEAL_OF_NO_HEADER))
}

/// Unsigned applications are not started.
#[cfg(not(feature = "development"))]
pub(crate) fn unsigned() -> Option<Vectors> {
    None
}
