//! The parameter pages: saves, power cuts and damage in any order. Saved values can be read, or the store reports why
//! not.

use arbitrary::{Arbitrary, Unstructured};
use storage::mock::{MockFlash, PowerCut, Weak};
use storage::{Change, Error, GroupNumber, Health, Loaded, Pages, Store, View};

const PAGE: usize = 512;
const PAGES: Pages = Pages::new(0, 512);
const GROUPS: [GroupNumber; 4] = [GroupNumber::Two, GroupNumber::Three, GroupNumber::Four, GroupNumber::One];
/// Longest value of a save.
const LONGEST: usize = 64;

#[derive(Arbitrary, Debug)]
enum Step<'a> {
    Save {
        group: u8,
        version: u16,
        value: &'a [u8],
    },
    Restore {
        group: u8,
    },
    /// Power off and on.
    Restart,
    /// A power cut in the middle of an operation, after `after` further operations.
    Cut {
        after: u8,
        weak: u8,
    },
    /// A byte of the flash changes without a write.
    Damage {
        offset: u16,
        flip: u8,
    },
}

/// The content of a group: layout version and value, or nothing.
type Read = Option<(u16, Vec<u8>)>;

struct Bench {
    flash: MockFlash<PAGE>,
    /// The possible contents of each group. A cut save leaves two possibilities until the next start decides.
    possible: [Vec<Read>; 4],
    is_damaged: bool,
    /// An erase was cut. If nothing was ever saved, the store cannot tell the remains from damage.
    is_half_erased: bool,
}

/// Runs the steps.
pub fn run(data: &[u8]) {
    let mut input = Unstructured::new(data);
    let mut bench = Bench {
        flash: MockFlash::new(2 * PAGE, 1),
        possible: [(); 4].map(|()| vec![None]),
        is_damaged: false,
        is_half_erased: false,
    };
    while !input.is_empty() {
        let Ok(step) = input.arbitrary::<Step>() else { return };
        bench.take(&step);
        bench.check();
    }
}

impl Bench {
    fn take(&mut self, step: &Step) {
        match *step {
            Step::Save { group, version, value } => {
                let value = &value[..value.len().min(LONGEST)];
                let group = GROUPS[usize::from(group) % 4];
                self.save(group, &Change::Set { group, version, value }, Some((version, value.to_vec())));
            }
            Step::Restore { group } => {
                let group = GROUPS[usize::from(group) % 4];
                self.save(group, &Change::Restore(group), None);
            }
            Step::Restart => self.restart(),
            Step::Cut { after, weak } => {
                let weak = [Weak::Before, Weak::After, Weak::Random][usize::from(weak) % 3];
                self.flash.cut_after(after.into(), weak);
            }
            Step::Damage { offset, flip } => {
                self.is_damaged |= flip != 0;
                self.flash.disturb(usize::from(offset) % (2 * PAGE), |byte| byte ^ flip);
            }
        }
        if self.flash.is_down() {
            self.flash.power_up();
        }
    }

    /// Starts the store, which decides about a cut save for good.
    fn restart(&mut self) {
        let view = View::open(&mut self.flash, PAGES).expect("there is power");
        let Ok(mut store) = Store::prepare(view) else {
            self.is_half_erased = true;
            return;
        };
        for (group, possible) in GROUPS.into_iter().zip(&mut self.possible) {
            let mut buffer = [0; LONGEST];
            let read = store.load(group, &mut buffer).map(|loaded| value(loaded, &buffer));
            let read = read.expect("a value of a length that was saved");
            assert!(possible.contains(&read) || self.is_damaged, "{group:?}: {read:?}, not {possible:?}");
            *possible = vec![read];
        }
    }

    /// Saves after a start, because only a start frees a page, and the pages are small.
    fn save(&mut self, group: GroupNumber, change: &Change<'_>, value: Read) {
        self.restart();
        let Ok(view) = View::open(&mut self.flash, PAGES) else { return };
        let result = Store::prepare(view).and_then(|mut store| store.save(std::slice::from_ref(change)));
        let place = GROUPS.iter().position(|&other| other == group).expect("one of them");
        let possible = &mut self.possible[place];
        match result {
            Ok(()) => *possible = vec![value],
            Err(Error::Flash(PowerCut)) => possible.push(value),
            Err(error) => panic!("{error:?}"),
        }
    }

    /// Checks that every group has one of its possible contents.
    fn check(&mut self) {
        let mut view = View::open(&mut self.flash, PAGES).expect("there is power");
        for (group, possible) in GROUPS.into_iter().zip(&self.possible) {
            let mut buffer = [0; LONGEST];
            let loaded = view.load(group, &mut buffer).expect("a value of a length that was saved");
            let (read, health) = (value(loaded, &buffer), view.health(group));
            assert!(possible.contains(&read) || self.is_damaged, "{group:?}: {read:?}, not {possible:?}");
            let may_be_bad = self.is_damaged || self.is_half_erased;
            assert!(health == Health::Good || may_be_bad, "{group:?}: {health:?}");
        }
    }
}

fn value(loaded: Option<Loaded>, buffer: &[u8]) -> Read {
    loaded.map(|loaded| (loaded.version, buffer[..loaded.len].to_vec()))
}
