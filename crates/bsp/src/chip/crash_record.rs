//! The crash record: a few words in RAM that no start-up code changes. A crash leaves the record for the next start; a
//! CRC distinguishes the record from random content of RAM.

const MAGIC: u32 = 0x4352_5348;
const FAULT: u32 = 1;
const PANIC: u32 = 2;
const CLOCK: u32 = 3;
const INTERRUPT: u32 = 4;
const FILE_WORDS: usize = 8;

/// Words for the details of a crash. The location of a panic (a line and the name of a file) needs the most.
type Content = [u32; 1 + FILE_WORDS];

/// Words of a record in RAM: a mark, the kind of crash, its details, and the CRC.
pub const WORDS: usize = 3 + size_of::<Content>() / 4;

/// The words of the record in RAM.
pub type Sealed = [u32; WORDS];

/// A crash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crash {
    /// The core took a fault.
    Fault(Fault),
    /// A panic of the program.
    Panic(Place),
    /// The clock on `OSC_IN` failed.
    Clock,
    /// An interrupt without a handler: its number in the NVIC or, below 0, the number of a core exception minus 16
    /// (PM0214, 2.3.2: IRQ number).
    Interrupt(i16),
}

/// Registers at a fault (PM0214, 4.4). Program counter and link register are 0 if the stack could not be read, for
/// example after an overflow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Program counter of the fault.
    pub pc: u32,
    /// Link register: the caller of the function.
    pub lr: u32,
    /// The stack pointer on entry.
    pub sp: u32,
    /// Configurable fault status.
    pub cfsr: u32,
    /// Hard fault status.
    pub hfsr: u32,
    /// Address of the access, if CFSR says that it is valid.
    pub address: u32,
}

/// Location of a panic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    line: u32,
    file: [u8; FILE_WORDS * 4],
}

impl Place {
    /// A line of a source file. Only the end of a long file name is kept.
    #[must_use]
    pub fn new(file: &str, line: u32) -> Place {
        let mut kept = [0; FILE_WORDS * 4];
        kept.iter_mut().rev().zip(file.bytes().rev()).for_each(|(to, from)| *to = from);
        Place { line, file: kept }
    }

    /// The line number.
    #[must_use]
    pub fn line(&self) -> u32 {
        self.line
    }

    /// The end of the file name; empty if the cut was inside a character.
    #[must_use]
    pub fn file(&self) -> &str {
        let name = self.file.iter().position(|&byte| byte != 0).and_then(|start| self.file.get(start..));
        name.and_then(|bytes| core::str::from_utf8(bytes).ok()).unwrap_or_default()
    }
}

impl Crash {
    /// The record to leave in RAM. Inlined, because each of the few callers has a known kind of crash, and the compiler
    /// removes the others.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    #[must_use]
    pub fn seal(&self) -> Sealed {
        match self {
            Crash::Fault(f) => sealed(FAULT, &[f.pc, f.lr, f.sp, f.cfsr, f.hfsr, f.address]),
            Crash::Panic(place) => sealed(PANIC, &place_words(place)),
            Crash::Clock => sealed(CLOCK, &[]),
            Crash::Interrupt(number) => sealed(INTERRUPT, &[u32::from(number.cast_unsigned())]),
        }
    }

    /// The crash in `words`; `None` if the mark or the CRC is wrong, for example after power-on.
    #[must_use]
    pub fn open(words: &Sealed) -> Option<Crash> {
        let [MAGIC, kind, content @ .., sum] = words else { return None };
        if *sum != check(words) {
            return None;
        }
        match *kind {
            FAULT => Some(Crash::Fault(fault(content))),
            PANIC => Some(Crash::Panic(place(content))),
            CLOCK => Some(Crash::Clock),
            INTERRUPT => Some(Crash::Interrupt(interrupt(content))),
            _ => None,
        }
    }
}

#[inline(never)]
fn sealed(kind: u32, details: &[u32]) -> Sealed {
    let mut words = [0; WORDS];
    let [magic, of_crash, content @ ..] = &mut words;
    (*magic, *of_crash) = (MAGIC, kind);
    content.iter_mut().zip(details).for_each(|(to, from)| *to = *from);
    words[WORDS - 1] = check(&words);
    words
}

fn place_words(place: &Place) -> Content {
    let mut words = [place.line; 1 + FILE_WORDS];
    let (chunks, _) = place.file.as_chunks::<4>();
    words.iter_mut().skip(1).zip(chunks).for_each(|(to, from)| *to = u32::from_le_bytes(*from));
    words
}

fn fault(&[pc, lr, sp, cfsr, hfsr, address, ..]: &Content) -> Fault {
    Fault { pc, lr, sp, cfsr, hfsr, address }
}

fn place([line, name @ ..]: &Content) -> Place {
    let mut file = [0; FILE_WORDS * 4];
    let (chunks, _) = file.as_chunks_mut::<4>();
    chunks.iter_mut().zip(name).for_each(|(to, from)| *to = from.to_le_bytes());
    Place { line: *line, file }
}

fn interrupt([number, ..]: &Content) -> i16 {
    let [low, high, ..] = number.to_le_bytes();
    i16::from_le_bytes([low, high])
}

/// The CRC of all words except the last.
fn check(words: &Sealed) -> u32 {
    let mut digest = storage::checksum::begin();
    words.iter().take(WORDS - 1).for_each(|word| digest.update(&word.to_le_bytes()));
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAULTED: Crash = Crash::Fault(Fault {
        pc: 0x0801_2345,
        lr: 0x0801_1111,
        sp: 0x2000_3F00,
        cfsr: 0x8200,
        hfsr: 0x4000_0000,
        address: 0xDEAD_BEEF,
    });

    #[test]
    fn a_crash_survives() {
        let panicked = Crash::Panic(Place::new("crates/canopen/src/sdo.rs", 77));
        for crash in [FAULTED, panicked, Crash::Clock, Crash::Interrupt(63), Crash::Interrupt(-2)] {
            assert_eq!(Crash::open(&crash.seal()), Some(crash));
        }
    }

    #[test]
    fn any_flipped_bit_voids_it() {
        let good = FAULTED.seal();
        for bit in 0..WORDS * 32 {
            let mut bad = good;
            bad[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(Crash::open(&bad), None, "bit {bit}");
        }
    }

    #[test]
    fn random_ram_after_power_on_is_no_crash() {
        assert_eq!(Crash::open(&[0; WORDS]), None);
        assert_eq!(Crash::open(&[u32::MAX; WORDS]), None);
    }

    #[test]
    fn of_a_long_file_name_the_end_is_kept() {
        let place = Place::new("/home/somebody/project/crates/bsp/src/transmit_queue.rs", 1);
        assert_eq!(place.file(), "crates/bsp/src/transmit_queue.rs");
        assert_eq!(Place::new("main.rs", 1).file(), "main.rs");
    }
}
