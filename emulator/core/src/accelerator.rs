//! The caches between flash and core (RM0390, 3.4.2): 64 lines of 128 bits for code and 8 lines for constants. A new
//! line replaces the least recently used one.

use chip::FlashAccess;

/// Bytes of a line.
const LINE: u32 = 16;

/// Both caches.
#[derive(Clone, Debug)]
pub(crate) struct Accelerator {
    code: Lines,
    constants: Lines,
    /// How often the program had emptied each cache.
    resets: [u32; 2],
    /// A line that was used although the flash has changed: of what, and its address.
    stale: Option<(&'static str, u32)>,
}

/// The numbers of the lines in a cache, the most recently used last.
#[derive(Clone, Debug)]
struct Lines {
    held: Vec<u32>,
    /// Lines among them that the flash has no longer.
    stale: Vec<u32>,
    room: usize,
}

impl Accelerator {
    pub(crate) fn new() -> Accelerator {
        Accelerator { code: Lines::new(64), constants: Lines::new(8), resets: [0; 2], stale: None }
    }

    /// The flash has changed: the caches keep what they have.
    pub(crate) fn change(&mut self, address: u32, size: u32) {
        let changed = address / LINE..=(address + size.max(1) - 1) / LINE;
        for lines in [&mut self.code, &mut self.constants] {
            let stale: Vec<u32> = lines.held.iter().copied().filter(|line| changed.contains(line)).collect();
            lines.stale.extend(stale);
        }
    }

    /// Takes a line that was used although the flash has changed.
    pub(crate) fn take_stale(&mut self) -> Option<(&'static str, u32)> {
        self.stale.take()
    }

    /// Empties the caches that the program has emptied since the last access.
    fn follow(&mut self, flash: FlashAccess) {
        let resets = [flash.code_resets, flash.constant_resets];
        if resets != self.resets {
            for ((lines, new), old) in
                [&mut self.code, &mut self.constants].into_iter().zip(resets).zip(self.resets)
            {
                if new != old {
                    *lines = Lines::new(lines.room);
                }
            }
            self.resets = resets;
        }
    }

    /// Empties both caches (a reset).
    pub(crate) fn clear(&mut self) {
        *self = Accelerator::new();
    }

    /// The wait cycles of a code fetch, counted as if the core did nothing else during the wait. After a jump, a
    /// prefetch of another line may have to end first.
    pub(crate) fn fetch(&mut self, address: u32, size: u32, in_a_row: bool, flash: FlashAccess) -> u32 {
        self.follow(flash);
        let (first, last) = (address / LINE, (address + size.max(1) - 1) / LINE);
        let stale = (first..=last).find(|line| flash.caches_code && self.code.stale.contains(line));
        self.stale = stale.map(|line| ("code", line * LINE)).or(self.stale);
        (first..=last)
            .filter(|&line| !flash.caches_code || !self.code.touch(line))
            .map(|line| if line == first && !in_a_row { after_another(flash) } else { read(flash) })
            .sum()
    }

    /// The wait cycles of a constant; the read of a line of code may have to end first.
    pub(crate) fn load(&mut self, address: u32, flash: FlashAccess) -> u32 {
        self.follow(flash);
        let line = address / LINE;
        let stale = flash.caches_constants && self.constants.stale.contains(&line);
        self.stale = stale.then_some(("constants", line * LINE)).or(self.stale);
        let hit = flash.caches_constants && self.constants.touch(line);
        if hit { 0 } else { after_another(flash) }
    }
}

/// The cycles to read a line.
fn read(flash: FlashAccess) -> u32 {
    flash.wait_states + 1
}

/// The cycles to read a line after the end of another read.
fn after_another(flash: FlashAccess) -> u32 {
    flash.wait_states + read(flash)
}

impl Lines {
    fn new(room: usize) -> Lines {
        Lines { held: Vec::with_capacity(room), stale: Vec::new(), room }
    }

    /// Marks the line as used and cached; returns whether it was already in the cache.
    fn touch(&mut self, line: u32) -> bool {
        let place = self.held.iter().rposition(|&held| held == line);
        match place {
            Some(place) => drop(self.held.remove(place)),
            None if self.held.len() == self.room => {
                let old = self.held.remove(0);
                self.stale.retain(|&line| line != old);
            }
            None => {}
        }
        self.held.push(line);
        place.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLASH: FlashAccess = FlashAccess {
        wait_states: 4,
        caches_code: true,
        caches_constants: true,
        code_resets: 0,
        constant_resets: 0,
    };

    #[test]
    fn a_line_from_before_a_change_is_reported_until_the_cache_is_emptied() {
        let mut accelerator = Accelerator::new();
        accelerator.load(0x104, FLASH);
        accelerator.fetch(0x100, 4, true, FLASH);
        accelerator.change(0x108, 4);
        accelerator.load(0x100, FLASH);
        assert_eq!(accelerator.take_stale(), Some(("constants", 0x100)));
        accelerator.fetch(0x100, 4, true, FLASH);
        assert_eq!(accelerator.take_stale(), Some(("code", 0x100)));
        let emptied = FlashAccess { constant_resets: 1, ..FLASH };
        assert_eq!((accelerator.load(0x100, emptied), accelerator.take_stale()), (9, None));
        accelerator.fetch(0x100, 4, true, emptied);
        assert!(accelerator.take_stale().is_some(), "the other cache was not emptied");
        accelerator.change(0x200, 4);
        accelerator.load(0x200, emptied);
        assert_eq!(accelerator.take_stale(), None, "it was not in the cache");
    }

    #[test]
    fn a_loop_that_fits_waits_once_and_one_that_does_not_always() {
        for (bytes, waits_again) in [(1024, 0), (1040, 65 * 5)] {
            let mut accelerator = Accelerator::new();
            let mut run = || {
                (0..bytes / LINE).map(|line| accelerator.fetch(line * LINE, LINE, true, FLASH)).sum::<u32>()
            };
            assert_eq!(run(), bytes / LINE * 5);
            assert_eq!(run(), waits_again, "{bytes}");
        }
    }

    #[test]
    fn a_jump_waits_for_the_running_read() {
        let mut accelerator = Accelerator::new();
        assert_eq!(accelerator.fetch(0x100, 20, false, FLASH), 9 + 5);
        assert_eq!(accelerator.fetch(0x100, 20, false, FLASH), 0);
        let off = FlashAccess { caches_code: false, ..FLASH };
        assert_eq!(accelerator.fetch(0x100, 20, false, off), 9 + 5);
    }

    #[test]
    fn constants_have_eight_lines_of_their_own() {
        let mut accelerator = Accelerator::new();
        accelerator.fetch(0x100, 4, true, FLASH);
        assert_eq!(accelerator.load(0x100, FLASH), 9);
        assert_eq!(accelerator.load(0x10C, FLASH), 0);
        assert_eq!((1..=8).map(|line| accelerator.load(0x100 + line * LINE, FLASH)).sum::<u32>(), 8 * 9);
        assert_eq!(accelerator.load(0x100, FLASH), 9);
    }
}
