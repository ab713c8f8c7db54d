//! The plain model of the store, and functions that run both.

use storage::mock::{MockFlash, PowerCut};
use storage::{Change, Error, GroupNumber, Health, MAX_VALUE, Pages, Store, View};

/// A version and a value, or nothing.
pub(crate) type Value = Option<(u16, Vec<u8>)>;

/// The values that should be stored, in the order of [`GroupNumber::ALL`].
pub(crate) type Model = [Value; 4];

/// The changes of a save.
pub(crate) type Changes = Vec<(GroupNumber, Value)>;

/// Nothing stored.
pub(crate) const EMPTY: Model = [None, None, None, None];

/// One action of a device.
#[derive(Clone, Debug)]
pub(crate) enum Step {
    /// One save.
    Save(Changes),
    /// Start-up: `open` and `prepare`.
    Restart,
    /// `make_room`, while the device runs.
    MakeRoom,
}

/// Sets a group to `len` bytes of noise.
pub(crate) fn set(group: GroupNumber, version: u16, len: usize) -> (GroupNumber, Value) {
    (group, Some((version, noise(u64::from(version), len))))
}

/// Restores the defaults of a group.
pub(crate) fn restore(group: GroupNumber) -> (GroupNumber, Value) {
    (group, None)
}

/// `len` bytes that look random and are the same each time.
pub(crate) fn noise(seed: u64, len: usize) -> Vec<u8> {
    let mut random = fastrand::Rng::with_seed(seed);
    (0..len).map(|_| random.u8(..)).collect()
}

/// The model after a save.
pub(crate) fn after(model: &Model, changes: &Changes) -> Model {
    let mut model = model.clone();
    for (group, value) in changes {
        let place = GroupNumber::ALL.iter().position(|g| g == group).unwrap();
        model[place].clone_from(value);
    }
    model
}

/// The changes as the store takes them.
pub(crate) fn as_changes(changes: &Changes) -> Vec<Change<'_>> {
    changes.iter().map(as_change).collect()
}

fn as_change((group, value): &(GroupNumber, Value)) -> Change<'_> {
    match value {
        Some((version, value)) => Change::Set { group: *group, version: *version, value },
        None => Change::Restore(*group),
    }
}

/// The stored values, and their health.
pub(crate) fn read<const ERASE: usize, const WORD: usize>(
    flash: &mut MockFlash<ERASE, WORD>,
    pages: Pages,
) -> (Model, [Health; 4]) {
    let mut view = View::open(flash, pages).unwrap();
    let value = GroupNumber::ALL.map(|group| {
        let mut buf = [0; MAX_VALUE];
        let loaded = view.load(group, &mut buf).unwrap()?;
        Some((loaded.version, buf[..loaded.len].to_vec()))
    });
    (value, GroupNumber::ALL.map(|group| view.health(group)))
}

/// The stored values, in a flash in which nothing may be doubtful.
pub(crate) fn read_good<const ERASE: usize, const WORD: usize>(
    flash: &mut MockFlash<ERASE, WORD>,
    pages: Pages,
) -> Model {
    let (model, health) = read(flash, pages);
    assert_eq!(health, [Health::Good; 4], "a power cut is no damage");
    model
}

/// Opens and prepares the store and takes the steps. Returns the states that the flash may then be in: one, or two if
/// the power was cut during a save.
pub(crate) fn run<const ERASE: usize, const WORD: usize>(
    flash: &mut MockFlash<ERASE, WORD>,
    pages: Pages,
    steps: &[Step],
    mut model: Model,
) -> Vec<Model> {
    let Ok(mut store) = start(flash, pages) else { return vec![model] };
    for step in steps {
        match step {
            Step::Save(changes) => match store.save(&as_changes(changes)) {
                Ok(()) => model = after(&model, changes),
                Err(Error::Flash(PowerCut)) => return vec![after(&model, changes), model],
                Err(Error::Full | Error::TooLong) => {}
                Err(error) => panic!("{error}"),
            },
            Step::MakeRoom => match store.make_room() {
                Ok(()) => {}
                Err(Error::Flash(PowerCut)) => return vec![model],
                Err(error) => panic!("{error}"),
            },
            Step::Restart => {
                let flash = store.into_flash();
                match start(flash, pages) {
                    Ok(prepared) => store = prepared,
                    Err(PowerCut) => return vec![model],
                }
            }
        }
    }
    vec![model]
}

/// Starts the store, unless the power is cut.
pub(crate) fn start<const ERASE: usize, const WORD: usize>(
    flash: &mut MockFlash<ERASE, WORD>,
    pages: Pages,
) -> Result<Store<&mut MockFlash<ERASE, WORD>>, PowerCut> {
    match View::open(flash, pages).and_then(Store::prepare) {
        Ok(store) => Ok(store),
        Err(Error::Flash(PowerCut)) => Err(PowerCut),
        Err(error) => panic!("{error}"),
    }
}

/// Restores the power: one of the `allowed` states must be read, `prepare` must keep it, and all later reads must
/// return it.
pub(crate) fn recover<const ERASE: usize, const WORD: usize>(
    flash: &mut MockFlash<ERASE, WORD>,
    pages: Pages,
    allowed: &[Model],
) -> Model {
    flash.power_up();
    let model = read_good(flash, pages);
    assert!(allowed.contains(&model), "{model:?} is neither old nor new");
    start(flash, pages).unwrap();
    for _ in 0..2 {
        assert_eq!(read_good(flash, pages), model, "decided once");
        flash.power_up();
    }
    model
}
