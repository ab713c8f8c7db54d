//! Writes what boards keep without power to files while the simulation runs: whoever kills it loses a second at most.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Result;

use crate::board::Board;
use crate::flash;

/// How often boards are looked at, in the host's time.
const PERIOD: Duration = Duration::from_secs(1);

/// The directory of the files, and what is in them.
pub(crate) struct Keeper {
    dir: PathBuf,
    /// For each board how often its flash had changed when it was written.
    written: Vec<Option<u64>>,
    looked: Instant,
}

impl Keeper {
    /// Nothing is written yet.
    pub(crate) fn new(dir: PathBuf) -> Keeper {
        Keeper { dir, written: Vec::new(), looked: Instant::now() }
    }

    /// Writes the boards whose flash has changed, when it is time to at `now`.
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

    /// Writes everything, at the end.
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
