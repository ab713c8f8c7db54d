//! From the list of personalities to the types and tables that have one of each.

/// The personalities of a node, in the order of their numbers: a name, the module of its profile, the name of its data
/// sheet, and what it is. The module has `ROWS`, `FAULTS`, `Objects`, `fields` and `handles`, as
/// [`pressure`](crate::pressure) has.
///
/// The list makes `Personality`, which selects and nothing else, and the types that hold one of each kind: `AnyProfile`
/// (the protocol half), `Measurement` (the sampling half), and `Parameters` and `Snapshot`, which travel between both. They
/// are enums, so nothing is allocated, and no function is called through a pointer.
#[macro_export]
macro_rules! personalities {
    ($($Name:ident => $module:ident, $file:literal, $description:literal;)+) => {
        /// How many personalities there are.
        const COUNT: usize = [$($file),+].len();

        /// Which device the node is: its dictionary, its default parameters and its profile.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Personality {
            $(#[doc = concat!($description, ".")] $Name,)+
        }

        impl Personality {
            /// All of them, in the order of their numbers.
            pub const ALL: [Personality; COUNT] = [$(Personality::$Name),+];

            /// The personality of a number in the device record; `None` for one that this image does not have.
            #[must_use]
            pub fn numbered(number: u8) -> Option<Personality> {
                Personality::ALL.get(usize::from(number)).copied()
            }

            /// Its number in the device record and in object 2000h.
            #[must_use]
            pub const fn number(self) -> u8 {
                self as u8
            }

            /// Its table, sorted: everything there is to say about every object. For the host; the node has
            /// [`dictionary`](Personality::dictionary).
            #[must_use]
            pub const fn rows(self) -> &'static [canopen::dictionary::Object] {
                match self {
                    $(Personality::$Name => &tables::$module::ROWS,)+
                }
            }

            /// Its dictionary.
            #[allow(clippy::indexing_slicing, reason = "there is one of each")]
            #[must_use]
            pub const fn dictionary(self) -> &'static canopen::dictionary::Dictionary {
                match self {
                    $(Personality::$Name => &DICTIONARIES[Personality::$Name as usize],)+
                }
            }

            /// Whether its dictionary has objects of this storage group.
            #[must_use]
            pub const fn has_group(self, group: canopen::dictionary::Group) -> bool {
                match self {
                    $(Personality::$Name => tables::$module::GROUPS & 1 << group as u8 != 0,)+
                }
            }

            /// File name of its data sheet.
            #[must_use]
            pub const fn file_name(self) -> &'static str {
                match self {
                    $(Personality::$Name => $file,)+
                }
            }

            /// What it is, in one line.
            #[must_use]
            pub const fn description(self) -> &'static str {
                match self {
                    $(Personality::$Name => $description,)+
                }
            }
        }

        impl Default for Personality {
            /// The first of the list.
            fn default() -> Personality {
                let [first, ..] = Personality::ALL;
                first
            }
        }

        mod tables {
            $(pub(super) mod $module {
                use super::super::{self as list, $module as own};
                use canopen::dictionary::Object;

                const PERSONALITY: Object =
                    $crate::communication::personality(list::Personality::$Name as u8, list::COUNT);
                const PARTS: &[&[&[Object]]] = &[$crate::communication::COMMON, &[&[PERSONALITY]], own::ROWS];
                pub(crate) static ROWS: [Object; $crate::table::count(PARTS)] = $crate::table::merged(PARTS);

                /// The storage groups of which the table has rows, a bit for each.
                pub(crate) const GROUPS: u8 = $crate::table::groups(&ROWS);

                pub(crate) static FIELDS: <own::Objects as $crate::profile::Profile>::Fields =
                    own::fields(list::Personality::$Name.dictionary());

                // A row that neither its profile nor the node handles, or a rule without a row, does not compile.
                #[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
                const _: () = {
                    let mut i = 0;
                    while i < ROWS.len() {
                        let is_handled = $crate::table::is_handled(&ROWS[i]);
                        let (index, sub) = (ROWS[i].index, ROWS[i].sub);
                        let has_rule = own::handles(index, sub) || $crate::communication::handles(index, sub);
                        assert!(is_handled == has_rule, "a row and its rule");
                        i += 1;
                    }
                };
            })+
        }

        /// All dictionaries, compiled together: what they have in common is in the image once.
        static DICTIONARIES: [canopen::dictionary::Dictionary; COUNT] =
            canopen::dictionaries!([$(&tables::$module::ROWS),+]);

        /// The room of a device, enough for every personality.
        #[allow(long_running_const_eval)]
        pub const ROOM: canopen::dictionary::Sizes =
            canopen::dictionary::Sizes::of_any(&[$(&tables::$module::ROWS),+]);

        /// Bytes of the image of all values, enough for every personality.
        pub const IMAGE_SIZE: usize = ROOM.image;

        /// Bytes of the packed values of a storage group, large enough for every personality.
        #[must_use]
        pub const fn packed_size(group: canopen::dictionary::Group) -> usize {
            let mut size = 0;
            $(size = $crate::table::larger(
                size,
                canopen::dictionary::packed_size(&tables::$module::ROWS, group),
            );)+
            size
        }

        /// All faults that the profiles can find.
        pub static FAULTS: [$crate::fault::Fault; $crate::fault::count(&[$($module::FAULTS),+])] =
            $crate::fault::gather(&[$($module::FAULTS),+]);

        /// All parameters of the measurement, as one consistent set.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(clippy::large_enum_variant)] // There is one of them.
        pub enum Parameters {
            $(#[doc = concat!($description, ".")]
            $Name($crate::profile::Parameters<$module::Objects>),)+
        }

        impl Parameters {
            /// How the board has to read the position sensors.
            #[must_use]
            pub fn position_inputs(&self) -> $crate::board::PositionInputs {
                match self {
                    $(Parameters::$Name(own) => {
                        <<$module::Objects as $crate::profile::Profile>::Chain as $crate::profile::Chain>
                            ::position_inputs(own)
                    })+
                }
            }
        }

        /// All measured values of one millisecond, as one consistent set.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        #[allow(clippy::large_enum_variant)] // There is one of them.
        pub enum Snapshot {
            /// Nothing is measured yet.
            #[default]
            Nothing,
            $(#[doc = concat!($description, ".")]
            $Name($crate::profile::Snapshot<$module::Objects>),)+
        }

        impl Snapshot {
            /// Calls `each` with every fault that the profile can find, always in the same order, and whether the
            /// values show it.
            pub fn faults(&self, each: &mut impl FnMut(&'static $crate::fault::Fault, bool)) {
                match self {
                    Snapshot::Nothing => {}
                    $(Snapshot::$Name(own) => {
                        <$module::Objects as $crate::profile::Profile>::faults(own, each);
                    })+
                }
            }
        }

        /// The chain of a personality.
        #[derive(Clone, Debug)]
        #[allow(clippy::large_enum_variant)] // There is one of them.
        enum AnyChain {
            $($Name(<$module::Objects as $crate::profile::Profile>::Chain),)+
        }

        /// The sampling half of a node: the chain of a personality and its state.
        #[derive(Clone, Debug)]
        pub struct Measurement {
            chain: AnyChain,
            /// Before there are parameters, nothing is measured.
            has_parameters: bool,
        }

        impl Measurement {
            /// A measurement after power-on.
            #[must_use]
            pub fn new(personality: Personality, power_on: &$crate::board::PowerOn) -> Measurement {
                let chain = match personality {
                    $(Personality::$Name => AnyChain::$Name($crate::profile::Chain::new(power_on)),)+
                };
                Measurement { chain, has_parameters: false }
            }

            /// Takes over new parameters of its personality, from the next sample on.
            pub fn apply(&mut self, parameters: &Parameters) {
                self.has_parameters = true;
                match (&mut self.chain, parameters) {
                    $((AnyChain::$Name(chain), Parameters::$Name(own)) => {
                        $crate::profile::Chain::apply(chain, own);
                    })+
                    #[allow(unreachable_patterns)] // In a list of one.
                    _ => {}
                }
            }

            /// Processes what was read in one millisecond.
            pub fn sample(&mut self, inputs: &$crate::board::Inputs) -> Snapshot {
                let mut snapshot = Snapshot::default();
                self.update(inputs, &mut snapshot);
                snapshot
            }

            /// The same, with the snapshot where it is to be: `snapshot` is the last one. Not inlined: this crate is
            /// compiled for speed, its callers for size.
            #[inline(never)]
            pub fn update(&mut self, inputs: &$crate::board::Inputs, snapshot: &mut Snapshot) {
                match &mut self.chain {
                    _ if !self.has_parameters => {}
                    $(AnyChain::$Name(chain) => {
                        if !matches!(snapshot, Snapshot::$Name(_)) {
                            *snapshot = Snapshot::$Name(Default::default());
                        }
                        if let Snapshot::$Name(own) = snapshot {
                            $crate::profile::Chain::update(chain, inputs, own);
                        }
                    })+
                }
            }

            /// Writes what is to outlive a loss of power; `false` while there is nothing.
            #[inline(never)]
            pub fn retain(&self, words: &mut [u32; $crate::board::RETAINED_WORDS]) -> bool {
                match &self.chain {
                    _ if !self.has_parameters => false,
                    $(AnyChain::$Name(chain) => $crate::profile::Chain::retain(chain, words),)+
                }
            }

            /// The same as it is found at the next start.
            #[must_use]
            pub fn retained(&self) -> $crate::board::Retained {
                let mut words = [0; $crate::board::RETAINED_WORDS];
                match self.retain(&mut words) {
                    true => $crate::board::Retained::Words(words),
                    false => $crate::board::Retained::Nothing,
                }
            }
        }

        /// The protocol half of a personality.
        #[derive(Debug)]
        pub enum AnyProfile {
            $(#[doc = concat!($description, ".")]
            $Name($module::Objects),)+
        }

        impl AnyProfile {
            /// The profile of a personality.
            #[must_use]
            pub fn new(personality: Personality) -> AnyProfile {
                use $crate::profile::Profile;
                match personality {
                    $(Personality::$Name => AnyProfile::$Name(Profile::new(&tables::$module::FIELDS)),)+
                }
            }

            /// As [`Profile::REGISTER_BITS`]($crate::profile::Profile::REGISTER_BITS).
            #[must_use]
            pub fn register_bits(&self) -> u8 {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(_) => $module::Objects::REGISTER_BITS,)+
                }
            }

            /// As [`Profile::initialise`]($crate::profile::Profile::initialise).
            pub fn initialise(&mut self, image: &mut [u8]) {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.initialise(image),)+
                }
            }

            /// As [`Profile::parameters`]($crate::profile::Profile::parameters).
            #[must_use]
            pub fn parameters(&self, image: &[u8]) -> Parameters {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => Parameters::$Name(own.parameters(image)),)+
                }
            }

            /// As [`Profile::publish`]($crate::profile::Profile::publish); what another personality has measured is
            /// left alone.
            pub fn publish(&mut self, snapshot: &Snapshot, image: &mut [u8]) {
                use $crate::profile::Profile;
                match (self, snapshot) {
                    $((AnyProfile::$Name(own), Snapshot::$Name(values)) => own.publish(values, image),)+
                    _ => {}
                }
            }

            /// As [`Profile::write`]($crate::profile::Profile::write).
            ///
            /// # Errors
            /// The reason to refuse it.
            pub fn write(
                &mut self,
                entry: &canopen::dictionary::Entry,
                bytes: &[u8],
                image: &mut [u8],
            ) -> Result<(), canopen::sdo::Abort> {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.write(entry, bytes, image),)+
                }
            }

            /// As [`Profile::received`]($crate::profile::Profile::received).
            pub fn received(&mut self, rpdo: u16, image: &mut [u8]) {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.received(rpdo, image),)+
                }
            }

            /// As [`Profile::written`]($crate::profile::Profile::written).
            pub fn written(&mut self, entry: &canopen::dictionary::Entry, image: &mut [u8]) {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.written(entry, image),)+
                }
            }

            /// As [`Profile::state`]($crate::profile::Profile::state).
            pub fn state(&mut self, state: canopen::nmt::State, image: &mut [u8]) {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.state(state, image),)+
                }
            }

            /// As [`Profile::synchronised`]($crate::profile::Profile::synchronised).
            pub fn synchronised(&mut self, counter: Option<u8>, image: &mut [u8]) {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.synchronised(counter, image),)+
                }
            }

            /// As [`Profile::error`]($crate::profile::Profile::error).
            pub fn error(&mut self, class: canopen::ErrorClass, image: &mut [u8]) {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.error(class, image),)+
                }
            }

            /// As [`Profile::show_flags`]($crate::profile::Profile::show_flags).
            pub fn show_flags(&self, flags: $crate::fault::Flags, image: &mut [u8]) {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.show_flags(flags, image),)+
                }
            }

            /// As [`Profile::stores`]($crate::profile::Profile::stores).
            #[must_use]
            pub fn stores(&self, index: u16, sub: u8) -> bool {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.stores(index, sub),)+
                }
            }

            /// As [`Profile::sends_events`]($crate::profile::Profile::sends_events).
            #[must_use]
            pub fn sends_events(&self, tpdo: u16) -> bool {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.sends_events(tpdo),)+
                }
            }

            /// As [`Profile::begin_events`]($crate::profile::Profile::begin_events).
            pub fn begin_events(&mut self, tpdo: u16, image: &mut [u8]) {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.begin_events(tpdo, image),)+
                }
            }

            /// As [`Profile::next_event`]($crate::profile::Profile::next_event).
            pub fn next_event(&mut self, tpdo: u16, image: &mut [u8]) -> bool {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.next_event(tpdo, image),)+
                }
            }

            /// As [`Profile::takes_all_nodes`]($crate::profile::Profile::takes_all_nodes).
            #[must_use]
            pub fn takes_all_nodes(&self, rpdo: u16) -> bool {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.takes_all_nodes(rpdo),)+
                }
            }

            /// As [`Profile::broadcasts`]($crate::profile::Profile::broadcasts).
            #[must_use]
            pub fn broadcasts(&self, at: canopen::sdo::Multiplexer, image: &[u8]) -> bool {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.broadcasts(at, image),)+
                }
            }

            /// As [`Profile::outputs`]($crate::profile::Profile::outputs).
            #[must_use]
            pub fn outputs(&self, image: &[u8]) -> $crate::board::Outputs {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => own.outputs(image),)+
                }
            }
        }
    };
}
