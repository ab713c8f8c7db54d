//! Parameter groups in two pages of NOR flash, safe against a power cut at any moment.
//!
//! A group is a string of bytes with a layout version and a [`Number`]; what is in it is the caller's business. One [`Store::save`]
//! changes any number of groups at once: after a power cut at any flash operation all of them are old or all are new.
//! Going back to the defaults is such a change too. Data of an older layout is handed back with its version, to
//! be migrated or refused as a whole by the caller.
//!
//! ```
//! use storage::{Change, Memory, Number, Pages, Store, View};
//!
//! let pages = Pages::new(0, 16 * 1024);
//! let flash = Memory(vec![0xFF; 32 * 1024]);
//! let mut store = Store::prepare(View::open(flash, pages)?)?; // start-up: may erase
//! let value = &[1, 2, 3];
//! store.save(&[
//!     Change::Set { group: Number::Three, version: 1, value },
//!     Change::Restore(Number::Two),
//! ])?; // only programs words
//! let mut buf = [0; 16];
//! let loaded = store.load(Number::Three, &mut buf)?.expect("it was saved");
//! assert_eq!((loaded.version, &buf[..loaded.len]), (1, &value[..]));
//! # Ok::<(), storage::Error<embedded_storage::nor_flash::NorFlashErrorKind>>(())
//! ```
//!
//! # When it runs
//!
//! A single-bank flash stops the core while it works: 16 us for a word (100 us at most), 0.25 s for the erase of a page.
//! So erasing is left to [`Store::prepare`] at start-up, before the node goes on the bus, and a save only programs.
//!
//! `save` simply blocks. It belongs in the lowest-priority task: everything else preempts it between two words, so a
//! 1 kHz sampling task starts late by one word at most and then runs at full speed, for nothing is programmed while it
//! does. Handing the words out one by one to a scheduler would give the same, with a state to keep and to get wrong. The
//! caller copies the values before the call, so no lock is held meanwhile.
//!
//! When neither page has room, `save` answers [`Error::RestartNeeded`] and changes nothing. A start leaves at least one
//! empty page, so at least a page's worth of saves fits between two starts. With pages of 16 KiB and 10,000 erase cycles
//! (`tests/store/figures.rs` computes the table, whose first two sets are those of the pressure transmitter). What is stored
//! already is not programmed again, so saving unchanged parameters costs nothing:
//!
//! | saved at once | saves from empty pages on | saves until worn out | words of one save |
//! |---|---|---|---|
//! | application group of 212 bytes | 136 | 1,360,000 | 60, 1.0 ms |
//! | communication and application groups, 1405 bytes | 22 | 220,000 | 362, 5.8 ms |
//! | all four groups of [`MAX_VALUE`] bytes | 2 | 20,000 | 2064, 33 ms |
//!
//! # Format
//!
//! Everything is words of 32 bits, low byte first, and no word is programmed twice. A flash that programs 8, 16 or 32 bytes
//! as one ([`Pages::with_words`]) has the same words in units of that size: every mark and the commit word have a unit of
//! their own, as has the contents; the two words of a record's head share one, and a value with its check fills whole units; what
//! is left of a unit is zeros. Zeros must be allowed over a unit that is programmed already (RM0440, 3.3.8).
//!
//! ```text
//! page         transaction        record
//! ┌──────────┐ ┌────────────────┐ ┌───────────────────────────────────┐
//! │ clean    │ │ begin = 0      │ │ group (8) │ kind (8) │ version (16) │
//! │ left     │ │ contents   │ ! │ │ length (16) │ generation (16)     │
//! ├──────────┤ ├────────────────┤ │ value, zeros up to a whole word     │
//! │ transac- │ │ record         │ │ check: CRC-32                       │
//! │ tion     │ │ record ...     │ └───────────────────────────────────┘
//! ├──────────┤ ├────────────────┤   kind 1: the group has this value
//! │ transac- │ │ commit: CRC-32 │   kind 2: it has none (length 0), the defaults hold
//! │ tion ... │ │ closed = 0     │
//! ├──────────┤ └────────────────┘   !: complement of the lower half
//! │ erased   │
//! └──────────┘
//! ```
//!
//! | word | meaning |
//! |---|---|
//! | clean | `PRM2`, programmed when the erase of the page has run to its end; without it the erase may have been cut |
//! | left | 0 once the store has moved on to the other page |
//! | begin | 0, not looked at. Programming zeros over a half programmed word is sound, so if a cut leaves no trace of this first word, the next save may start at it again |
//! | generation | the same in all records of a page, counts the uses of pages: the page with the later one is in use. It wraps after 65,536; as the two are never far apart, the order is that of their difference |
//! | contents | number of words of records in 12 bits, and the groups of the records in 4 |
//! | check | CRC-32 over the offset of the record in the page and the words of the record before the check |
//! | commit | CRC-32 (ISO HDLC) over the offset of the transaction in the page and all its words but begin; all ones are stored as 0. From this word on the transaction counts |
//! | closed | 0: the commit word is whole, not just lucky to read well after a cut |
//!
//! A number beside its complement cannot be torn into another number: a torn word has zeros missing, in either half.
//!
//! **Move.** A save that does not fit begins the other, clean page with a transaction that names every group, then marks
//! the old page *left*. A page whose first transaction cannot be read or is not closed does not count while the page
//! before it is there.
//!
//! **Start-up.** `prepare` erases the page that is not in use. If the page in use ends in anything but a closed
//! transaction and erased words, or is damaged, its state is moved first, and only then is it erased: nothing is ever
//! appended to doubtful words, and a commit word that reads well by chance is decided once and for all.
//!
//! # Damage
//!
//! Of a transaction whose CRC fails, every record counts whose own check is right: a damaged record is damage to its group and
//! to no other. The state of that group is then the one before, and [`Health`] says so, unless a later save holds the group.
//! Where neither the contents nor the records tell which groups there were, all of them are in doubt. The first transaction of a
//! page counts as a whole as long as the page before it is there to go back to. A save that was cut is no damage: its
//! words end in order, before the closing mark. Cells of the newest transactions that return to the erased value
//! altogether look just like it; this is the one loss that goes unreported. The other way round, an erase that was cut
//! where nothing was ever saved cannot be told from damage: it is reported though nothing is lost.
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]
// Nothing that comes from the bus or from the flash may panic or index out of range.
#![cfg_attr(
    not(any(test, feature = "mock")),
    warn(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

#[cfg(any(test, feature = "mock"))]
extern crate std;

mod device;
mod error;
mod format;
mod group;
mod lookup;
mod memory;
#[cfg(feature = "mock")]
pub mod mock;
mod page;
mod provision;
mod scan;
mod store;
mod view;
mod writer;

pub use device::DeviceRecord;
pub use error::Error;
pub use group::{Change, Health, Loaded, Number};
pub use lookup::device_record;
pub use memory::Memory;
pub use page::Pages;
pub use provision::{provision, read};
pub use store::{MAX_VALUE, Store};
pub use view::View;
