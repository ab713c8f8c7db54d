//! Parameter groups in two pages of NOR flash, safe against a power cut at any moment.
//!
//! A parameter group is a string of bytes with a layout version and a [`GroupNumber`]; the store does not interpret the bytes. One
//! [`Store::save`] changes any number of groups at once: after a power cut at any flash operation, either all of them
//! are old or all are new. Restoring the defaults (1011h) is such a change too. Data of an older layout is returned
//! with its version, so that the caller can migrate or refuse it as a whole.
//!
//! ```
//! use storage::{Change, Memory, GroupNumber, Pages, Store, View};
//!
//! let pages = Pages::new(0, 16 * 1024);
//! let flash = Memory(vec![0xFF; 32 * 1024]);
//! let mut store = Store::prepare(View::open(flash, pages)?)?; // at start-up, because it may erase
//! let value = &[1, 2, 3];
//! store.save(&[
//!     Change::Set { group: GroupNumber::Three, version: 1, value },
//!     Change::Restore(GroupNumber::Two),
//! ])?; // only programs words
//! let mut buf = [0; 16];
//! let loaded = store.load(GroupNumber::Three, &mut buf)?.expect("it was saved");
//! assert_eq!((loaded.version, &buf[..loaded.len]), (1, &value[..]));
//! # Ok::<(), storage::Error<embedded_storage::nor_flash::NorFlashErrorKind>>(())
//! ```
//!
//! # Timing
//!
//! A single-bank flash stops the core during an operation: 16 us for a word (100 us at most), 0.25 s for the erase of a
//! page (0.5 s at most). A save therefore only programs. A page is erased by [`Store::prepare`] at start-up, before the
//! node joins the bus, and by [`Store::make_room`], which the caller calls when a pause of the core disturbs no service.
//!
//! `save` simply blocks and belongs in the lowest-priority task. All other tasks preempt it between two words: a 1 kHz
//! sampling task starts late by one word at most and then runs at full speed, because nothing is programmed meanwhile.
//! Handing the words one by one to a scheduler would have the same effect, with more state and more possible errors.
//! The caller copies the values before the call, so no lock is held during the save.
//!
//! If neither page has room, `save` returns [`Error::Full`] and changes nothing. [`Store::saves_left`] gives the number of
//! saves that certainly succeed, so that a caller can refuse a request before its effect. A start leaves at least one
//! empty page, so at least a page of saves fits between two erases. The table is for pages of 16 KiB and 10,000 erase
//! cycles (`tests/store/figures.rs` computes it; the first two rows are for the pressure transmitter). Values that are
//! already stored are not programmed again, so saving unchanged parameters costs nothing:
//!
//! | saved at once | saves without an erase, two empty pages | saves until worn out | words of one save |
//! |---|---|---|---|
//! | application group of 212 bytes | 136 | 1,360,000 | 60, 1.0 ms |
//! | communication and application groups, 1405 bytes | 22 | 220,000 | 362, 5.8 ms |
//! | all four groups of [`MAX_VALUE`] bytes | 2 | 20,000 | 2064, 33 ms |
//!
//! [`Store::moves`] counts the erases. The number is stored in the pages, so a power cut does not lose it. Between two
//! erases each word is programmed once: the erases alone wear the flash.
//!
//! # Format
//!
//! All data is in words of 32 bits, low byte first, and no word is programmed twice. In a flash that programs 8, 16 or
//! 32 bytes at once ([`Pages::with_words`]) the same words are arranged in units of that size: every mark, the contents
//! and the commit word have a unit of their own, the two words of a record's head share a unit, and a value with its
//! check fills whole units. The rest of a unit is filled with zeros. The flash must allow zeros over a unit that is
//! already programmed (RM0440, 3.3.8).
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
//! | clean | `PRM2`, programmed when the erase of the page is complete; without it the erase may have been cut |
//! | left | 0 once the store has moved on to the other page |
//! | begin | 0, ignored. If a cut leaves this word reading as erased, the next save may program its zeros again |
//! | generation | equal in all records of a page; counts the uses of pages, so the page with the later one is in use |
//! | contents | number of words of records in 12 bits, and the groups of the records in 4 |
//! | check | CRC-32 over the offset of the record in the page and the words of the record before the check |
//! | commit | CRC-32 (ISO HDLC) over the transaction's offset and all its words but begin; all ones are stored as 0 |
//! | closed | 0: the commit word is complete, and does not read well after a cut only by chance |
//!
//! A transaction counts from its commit word on. The generation wraps after 65,536; the two pages are never far apart,
//! so the sign of their difference gives the order.
//!
//! A number with its complement cannot become another number in a power cut, because a half-programmed word lacks zeros
//! in either half.
//!
//! **Move.** A save that does not fit starts the other, clean page with a transaction that names every group, and then
//! marks the old page *left*. A page whose first transaction cannot be read or is not closed does not count while the
//! page before it exists.
//!
//! **Erase.** `prepare` and `make_room` erase the page that is not in use. If the page in use is damaged, or ends with anything but
//! a closed transaction and erased words, its state is first moved to the other page, and then it is erased. Nothing is
//! therefore ever appended to doubtful words, and a commit word that reads well by chance is decided once and for all.
//!
//! # Damage
//!
//! In a transaction whose CRC fails, every record with a correct check of its own counts: a damaged record affects its
//! own group only. The state of that group is then the state before the record, and [`Health`] reports this, unless a
//! later save contains the group. If neither the contents nor the records tell which groups there were, all groups are
//! in doubt. The first transaction of a page counts only as a whole, as long as the page before it exists. A save that
//! was cut is not damage: its words end in order, before the closing mark. If cells of the newest transactions return
//! completely to the erased value, this looks the same; such a loss is the only one that is not reported. In the other
//! direction, an erase that was cut where nothing was ever saved cannot be distinguished from damage: it is reported
//! although nothing is lost.
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

#[cfg(feature = "mock")]
pub mod cells;
pub mod checksum;
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
pub use group::{Change, GroupNumber, Health, Loaded};
pub use lookup::device_record;
pub use memory::Memory;
pub use page::Pages;
pub use provision::{provision, read};
pub use store::{MAX_VALUE, Store};
pub use view::View;
