//! Writes the boards' flash to files while the simulation runs, so that a killed simulation loses one second at most.
//! The backup SRAM is written at the end.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Result;

use crate::board::Board;
use crate::flash;

/// Period of the checks for changes, in the host's time.
const PERIOD: Duration = Duration::from_secs(1);

/// The directory of the files, and the state of the files.
pub(crate) struct Keeper {
    dir: PathBuf,
    /// For each board, the number of changes of its flash when it was last written.
    written: Vec<Option<u64>>,
    looked: Instant,
}

impl Keeper {
    /// A keeper that has written nothing yet.
    pub(crate) fn new(dir: PathBuf) -> Keeper {
        Keeper { dir, written: Vec::new(), looked: Instant::now() }
    }

    /// Writes the boards whose flash has changed, if a check is due at `now`.
    ///
    /// # Errors
    /// When a file cannot be written; the message names it.
    pub(crate) fn look(&mut self, boards: &[Board], now: Instant) -> Result<()> {
        if now.duration_since(self.looked) < PERIOD {
            return Ok(());
        }
        self.looked = now;
        self.written.resize(boards.len(), None);
        for (board, written) in boards.iter().zip(&mut self.written) {
            let changes = Some(board.flash_changes());
            if *written != changes {
                flash::save(&self.dir, board.id(), &board.flash())?;
                *written = changes;
            }
        }
        Ok(())
    }

    /// Writes the flash and the backup SRAM of all boards, at the end.
    ///
    /// # Errors
    /// When a file cannot be written; the message names it.
    pub(crate) fn close(&self, boards: &[Board]) -> Result<()> {
        boards.iter().try_for_each(|board| {
            flash::save(&self.dir, board.id(), &board.flash())?;
            flash::save_backup(&self.dir, board.id(), board.backup().as_deref())
        })
    }
}
