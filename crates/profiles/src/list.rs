//! Macro that makes the types and tables of a node from its list of personalities.

/// The personalities of a node, in the order of their numbers: a name, the module of the profile, the name of the data
/// sheet, and a description. The module has `ROWS`, `FAULTS`, `Objects`, `fields` and `handles`, as in
/// [`pressure`](crate::pressure).
///
/// The list makes `Personality`, which only selects, and the types that hold the variant of the selected personality:
/// `AnyProfile` (the protocol half), `Measurement` (the sampling half), and `Parameters` and `Snapshot`, which both
/// halves exchange. All are enums, so nothing is allocated and no function is called through a pointer.
#[macro_export]
macro_rules! personalities {
    ($($Name:ident => $module:ident, $file:literal, $description:literal;)+) => {
        /// Number of personalities.
        const COUNT: usize = [$($file),+].len();

        /// Kind of device that the node is: selects the dictionary, the default parameters and the profile.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Personality {
            $(#[doc = concat!($description, ".")] $Name,)+
        }

        impl Personality {
            /// All personalities, in the order of their numbers.
            pub const ALL: [Personality; COUNT] = [$(Personality::$Name),+];

            /// The personality with this number in the device record; `None` if this image does not have it.
            #[must_use]
            pub fn numbered(number: u8) -> Option<Personality> {
                Personality::ALL.get(usize::from(number)).copied()
            }

            /// The number in the device record and in object 2000h.
            #[must_use]
            pub const fn number(self) -> u8 {
                self as u8
            }

            /// The table of all objects with all their properties, sorted. For the host; the node uses
            /// [`dictionary`](Personality::dictionary).
            #[must_use]
            pub const fn rows(self) -> &'static [canopen::dictionary::Object] {
                match self {
                    $(Personality::$Name => &tables::$module::ROWS,)+
                }
            }

            /// The dictionary.
            #[allow(clippy::indexing_slicing, reason = "there is one of each")]
            #[must_use]
            pub const fn dictionary(self) -> &'static canopen::dictionary::Dictionary {
                match self {
                    $(Personality::$Name => &DICTIONARIES[Personality::$Name as usize],)+
                }
            }

            /// Whether the dictionary has objects of this storage group.
            #[must_use]
            pub const fn has_group(self, group: canopen::dictionary::Group) -> bool {
                match self {
                    $(Personality::$Name => tables::$module::GROUPS & 1 << group as u8 != 0,)+
                }
            }

            /// File name of the data sheet.
            #[must_use]
            pub const fn file_name(self) -> &'static str {
                match self {
                    $(Personality::$Name => $file,)+
                }
            }

            /// Description in one line.
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

                /// The storage groups that the table has rows of, one bit for each.
                pub(crate) const GROUPS: u8 = $crate::table::groups(&ROWS);

                pub(crate) static FIELDS: <own::Objects as $crate::profile::Profile>::Fields =
                    own::fields(list::Personality::$Name.dictionary());

                // Does not compile if a row marked as handled has no rule in its profile or in the node, or if a rule
                // has no such row.
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

        /// All dictionaries, compiled together, so that common parts are in the image once.
        static DICTIONARIES: [canopen::dictionary::Dictionary; COUNT] =
            canopen::dictionaries!([$(&tables::$module::ROWS),+]);

        /// Sizes of a device, large enough for every personality.
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

        /// All faults that the profiles detect.
        pub static FAULTS: [$crate::fault::Fault; $crate::fault::count(&[$($module::FAULTS),+])] =
            $crate::fault::gather(&[$($module::FAULTS),+]);

        /// All parameters of the measurement, as one consistent set.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(clippy::large_enum_variant)] // A node has a single value of this type.
        pub enum Parameters {
            $(#[doc = concat!($description, ".")]
            $Name($crate::profile::Parameters<$module::Objects>),)+
        }

        impl Parameters {
            /// Settings of the board's position inputs.
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
        #[allow(clippy::large_enum_variant)] // A node has a single value of this type.
        pub enum Snapshot {
            /// Nothing has been measured yet.
            #[default]
            Nothing,
            $(#[doc = concat!($description, ".")]
            $Name($crate::profile::Snapshot<$module::Objects>),)+
        }

        impl Snapshot {
            /// Begins as that of a personality, before its first sample.
            #[cold]
            #[inline(never)]
            fn begin(&mut self, personality: Personality) {
                *self = match personality {
                    $(Personality::$Name => Snapshot::$Name(Default::default()),)+
                };
            }

            /// Calls `each` with every fault that the profile detects, always in the same order, and whether the values
            /// show the fault.
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
        #[allow(clippy::large_enum_variant)] // A node has a single value of this type.
        enum AnyChain {
            $($Name(<$module::Objects as $crate::profile::Profile>::Chain),)+
        }

        /// The sampling half of a node: the chain of a personality and its state.
        #[derive(Clone, Debug)]
        pub struct Measurement {
            chain: AnyChain,
            /// Nothing is measured before the first parameters.
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

            /// Takes over new parameters of the personality; they act from the next sample on.
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

            /// Processes the readings of one millisecond.
            pub fn sample(&mut self, inputs: &$crate::board::Inputs) -> Snapshot {
                let mut snapshot = Snapshot::default();
                self.update(inputs, &mut snapshot);
                snapshot
            }

            /// Like `sample`, but replaces the last snapshot in its place. Not inlined: this crate is compiled for
            /// speed, its callers for size.
            #[inline(never)]
            pub fn update(&mut self, inputs: &$crate::board::Inputs, snapshot: &mut Snapshot) {
                match &mut self.chain {
                    _ if !self.has_parameters => {}
                    $(AnyChain::$Name(chain) => {
                        if !matches!(snapshot, Snapshot::$Name(_)) {
                            snapshot.begin(Personality::$Name);
                        }
                        if let Snapshot::$Name(own) = snapshot {
                            $crate::profile::Chain::update(chain, inputs, own);
                        }
                    })+
                }
            }

            /// Writes the state to be retained through a loss of power; `false` without a state.
            #[inline(never)]
            pub fn retain(&self, words: &mut [u32; $crate::board::RETAINED_WORDS]) -> bool {
                match &self.chain {
                    _ if !self.has_parameters => false,
                    $(AnyChain::$Name(chain) => $crate::profile::Chain::retain(chain, words),)+
                }
            }

            /// The retained state in the form in which the next start finds it.
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

            /// As [`Profile::parameters`]($crate::profile::Profile::parameters).
            #[must_use]
            pub fn parameters(&self, image: &[u8]) -> Parameters {
                use $crate::profile::Profile;
                match self {
                    $(AnyProfile::$Name(own) => Parameters::$Name(own.parameters(image)),)+
                }
            }

            /// As [`Profile::publish`]($crate::profile::Profile::publish). A snapshot of another personality is
            /// ignored.
            pub fn publish(&mut self, snapshot: &Snapshot, image: &mut [u8]) {
                use $crate::profile::Profile;
                match (self, snapshot) {
                    $((AnyProfile::$Name(own), Snapshot::$Name(values)) => own.publish(values, image),)+
                    _ => {}
                }
            }

            $crate::forwards! { [$($Name)+]
                fn initialise(&mut self, image: &mut [u8], defaults: canopen::dictionary::Groups);
                fn write(
                    &mut self,
                    entry: &canopen::dictionary::Entry,
                    bytes: &[u8],
                    image: &mut [u8],
                ) -> Result<(), canopen::sdo::Abort>;
                fn received(&mut self, rpdo: u16, image: &mut [u8]);
                fn written(&mut self, entry: &canopen::dictionary::Entry, image: &mut [u8]);
                fn state(&mut self, state: canopen::nmt::State, image: &mut [u8]);
                fn synchronised(&mut self, counter: Option<u8>, image: &mut [u8]);
                fn error(&mut self, class: canopen::ErrorClass, image: &mut [u8]);
                fn show_flags(&self, flags: $crate::fault::Flags, image: &mut [u8]);
                fn stores(&self, index: u16, sub: u8) -> bool;
                fn switches_pdos(&self, index: u16) -> bool;
                fn sends_events(&self, tpdo: u16) -> bool;
                fn begin_events(&mut self, tpdo: u16, image: &mut [u8]);
                fn next_event(&mut self, tpdo: u16, image: &mut [u8]) -> bool;
                fn is_quiet(&self, tpdo: usize, place: usize, image: &[u8]) -> bool;
                fn sent(&mut self, tpdo: usize, image: &[u8]);
                fn take_preset(&mut self, image: &[u8]) -> Option<canopen::sdo::Multiplexer>;
                fn takes_all_nodes(&self, rpdo: u16) -> bool;
                fn broadcasts(&self, at: canopen::sdo::Multiplexer, image: &[u8]) -> bool;
                fn outputs(&self, image: &[u8]) -> $crate::board::Outputs;
            }
        }
    };
}

/// The hooks of [`Profile`](crate::profile::Profile) for a list of personalities: each calls that of the selected one.
#[doc(hidden)]
#[macro_export]
macro_rules! forwards {
    ($names:tt) => {};
    ($names:tt fn $hook:ident(&self, $($argument:ident: $Type:ty),+ $(,)?) $(-> $Result:ty)?; $($rest:tt)*) => {
        #[doc = concat!("As `Profile::", stringify!($hook), "`.")]
        #[allow(clippy::missing_errors_doc, clippy::must_use_candidate, reason = "as documented there")]
        pub fn $hook(&self, $($argument: $Type),+) $(-> $Result)? {
            $crate::forwards!(@match self $names $hook ($($argument),+))
        }
        $crate::forwards! { $names $($rest)* }
    };
    ($names:tt fn $hook:ident(&mut self, $($argument:ident: $Type:ty),+ $(,)?) $(-> $Result:ty)?; $($rest:tt)*) => {
        #[doc = concat!("As `Profile::", stringify!($hook), "`.")]
        #[allow(clippy::missing_errors_doc, clippy::must_use_candidate, reason = "as documented there")]
        pub fn $hook(&mut self, $($argument: $Type),+) $(-> $Result)? {
            $crate::forwards!(@match self $names $hook ($($argument),+))
        }
        $crate::forwards! { $names $($rest)* }
    };
    (@match $profile:ident [$($Name:ident)+] $hook:ident $arguments:tt) => {
        match $profile {
            $(AnyProfile::$Name(own) => $crate::forwards!(@call own $hook $arguments),)+
        }
    };
    (@call $own:ident $hook:ident ($($argument:ident),+)) => {
        $crate::profile::Profile::$hook($own, $($argument),+)
    };
}
