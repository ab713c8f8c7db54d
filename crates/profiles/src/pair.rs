//! Two profiles in one dictionary, as one profile.

use canopen::ErrorClass;
use canopen::dictionary::{Entry, Groups};
use canopen::nmt::State;
use canopen::sdo::{Abort, Multiplexer};

use crate::board::{DIGITAL_OUTPUTS, Inputs, Outputs, PositionInputs, PowerOn, RETAINED_WORDS};
use crate::fault::{Fault, Flags};
use crate::profile::{Chain, Parameters, Profile, Snapshot};

/// Two protocol halves whose objects do not overlap.
#[derive(Debug)]
pub struct Pair<A, B>(A, B);

/// The two sampling halves of the pair.
#[derive(Clone, Debug)]
pub struct ChainPair<A, B>(A, B);

impl<A: Chain, B: Chain> Chain for ChainPair<A, B> {
    type Parameters = (A::Parameters, B::Parameters);
    type Snapshot = (A::Snapshot, B::Snapshot);

    fn new(power_on: &PowerOn) -> Self {
        ChainPair(A::new(power_on), B::new(power_on))
    }

    fn apply(&mut self, (first, second): &Self::Parameters) {
        self.0.apply(first);
        self.1.apply(second);
    }

    fn update(&mut self, inputs: &Inputs, (first, second): &mut Self::Snapshot) {
        self.0.update(inputs, first);
        self.1.update(inputs, second);
    }

    fn position_inputs((first, second): &Self::Parameters) -> PositionInputs {
        let (first, second) = (A::position_inputs(first), B::position_inputs(second));
        PositionInputs {
            are_used: first.are_used || second.are_used,
            ssi_bits: first.ssi_bits.or(second.ssi_bits),
        }
    }

    /// The retained memory belongs to the first profile that uses it.
    fn retain(&self, words: &mut [u32; RETAINED_WORDS]) -> bool {
        self.0.retain(words) || self.1.retain(words)
    }
}

impl<A: Profile, B: Profile> Profile for Pair<A, B> {
    type Chain = ChainPair<A::Chain, B::Chain>;
    type Fields = (A::Fields, B::Fields);

    fn new((first, second): &'static Self::Fields) -> Self {
        Pair(A::new(first), B::new(second))
    }

    fn initialise(&mut self, image: &mut [u8], defaults: Groups) {
        self.0.initialise(image, defaults);
        self.1.initialise(image, defaults);
    }

    fn parameters(&self, image: &[u8]) -> Parameters<Self> {
        (self.0.parameters(image), self.1.parameters(image))
    }

    fn publish(&mut self, (first, second): &Snapshot<Self>, image: &mut [u8]) {
        self.0.publish(first, image);
        self.1.publish(second, image);
    }

    fn handles(&self, index: u16, sub: u8) -> bool {
        self.0.handles(index, sub) || self.1.handles(index, sub)
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        if self.0.handles(entry.index(), entry.sub()) {
            self.0.write(entry, bytes, image)
        } else {
            self.1.write(entry, bytes, image)
        }
    }

    fn received(&mut self, rpdo: u16, image: &mut [u8]) {
        self.0.received(rpdo, image);
        self.1.received(rpdo, image);
    }

    fn written(&mut self, entry: &Entry, image: &mut [u8]) {
        self.0.written(entry, image);
        self.1.written(entry, image);
    }

    fn state(&mut self, state: State, image: &mut [u8]) {
        self.0.state(state, image);
        self.1.state(state, image);
    }

    fn synchronised(&mut self, counter: Option<u8>, image: &mut [u8]) {
        self.0.synchronised(counter, image);
        self.1.synchronised(counter, image);
    }

    fn error(&mut self, class: ErrorClass, image: &mut [u8]) {
        self.0.error(class, image);
        self.1.error(class, image);
    }

    fn faults((first, second): &Snapshot<Self>, each: &mut impl FnMut(&'static Fault, bool)) {
        A::faults(first, each);
        B::faults(second, each);
    }

    fn show_flags(&self, flags: Flags, image: &mut [u8]) {
        self.0.show_flags(flags, image);
        self.1.show_flags(flags, image);
    }

    fn stores(&self, index: u16, sub: u8) -> bool {
        self.0.stores(index, sub) || self.1.stores(index, sub)
    }

    fn switches_pdos(&self, index: u16) -> bool {
        self.0.switches_pdos(index) || self.1.switches_pdos(index)
    }

    fn sends_events(&self, tpdo: u16) -> bool {
        self.0.sends_events(tpdo) || self.1.sends_events(tpdo)
    }

    fn begin_events(&mut self, tpdo: u16, image: &mut [u8]) {
        if self.0.sends_events(tpdo) {
            self.0.begin_events(tpdo, image);
        } else {
            self.1.begin_events(tpdo, image);
        }
    }

    fn next_event(&mut self, tpdo: u16, image: &mut [u8]) -> bool {
        if self.0.sends_events(tpdo) {
            self.0.next_event(tpdo, image)
        } else {
            self.1.next_event(tpdo, image)
        }
    }

    fn is_quiet(&self, tpdo: usize, place: usize, image: &[u8]) -> bool {
        self.0.is_quiet(tpdo, place, image) || self.1.is_quiet(tpdo, place, image)
    }

    fn sent(&mut self, tpdo: usize, image: &[u8]) {
        self.0.sent(tpdo, image);
        self.1.sent(tpdo, image);
    }

    fn take_preset(&mut self, image: &[u8]) -> Option<Multiplexer> {
        self.0.take_preset(image).or_else(|| self.1.take_preset(image))
    }

    fn takes_all_nodes(&self, rpdo: u16) -> bool {
        self.0.takes_all_nodes(rpdo) || self.1.takes_all_nodes(rpdo)
    }

    fn broadcasts(&self, at: Multiplexer, image: &[u8]) -> bool {
        self.0.broadcasts(at, image) && self.1.broadcasts(at, image)
    }

    /// A digital output is on if one of the profiles switches it on.
    fn outputs(&self, image: &[u8]) -> Outputs {
        let (first, second) = (self.0.outputs(image).digital, self.1.outputs(image).digital);
        let mut digital: [bool; DIGITAL_OUTPUTS] = first;
        digital.iter_mut().zip(second).for_each(|(on, other)| *on |= other);
        Outputs { digital }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sensor;

    impl Chain for Sensor {
        type Parameters = PositionInputs;
        type Snapshot = u32;

        fn new(_: &PowerOn) -> Sensor {
            Sensor
        }

        fn apply(&mut self, _: &PositionInputs) {}

        fn update(&mut self, _: &Inputs, count: &mut u32) {
            *count += 1;
        }

        fn position_inputs(parameters: &PositionInputs) -> PositionInputs {
            *parameters
        }
    }

    /// A profile at its own place in the image. Its TPDO, its handled object and its output have the number of the place;
    /// it stores its calls at the place.
    struct Witness(usize);

    impl Witness {
        fn is_mine(&self, number: u16) -> bool {
            usize::from(number) == self.0
        }
    }

    impl Profile for Witness {
        type Chain = Sensor;
        type Fields = usize;

        fn new(place: &'static usize) -> Witness {
            Witness(*place)
        }

        fn parameters(&self, image: &[u8]) -> PositionInputs {
            PositionInputs { are_used: true, ssi_bits: Some(image[self.0].into()) }
        }

        fn publish(&mut self, count: &u32, image: &mut [u8]) {
            image[self.0] = count.to_le_bytes()[0];
        }

        fn handles(&self, index: u16, _: u8) -> bool {
            self.is_mine(index)
        }

        fn write(&mut self, _: &Entry, _: &[u8], _: &mut [u8]) -> Result<(), Abort> {
            Err(Abort::Access)
        }

        fn synchronised(&mut self, counter: Option<u8>, image: &mut [u8]) {
            image[self.0] = counter.unwrap_or(0xFF);
        }

        fn error(&mut self, class: ErrorClass, image: &mut [u8]) {
            image[self.0] = class.0;
        }

        fn sends_events(&self, tpdo: u16) -> bool {
            self.is_mine(tpdo)
        }

        fn begin_events(&mut self, _: u16, image: &mut [u8]) {
            image[self.0] = 100;
        }

        fn next_event(&mut self, _: u16, image: &mut [u8]) -> bool {
            image[self.0] = image[self.0].saturating_sub(60);
            image[self.0] > 0
        }

        fn is_quiet(&self, _: usize, place: usize, _: &[u8]) -> bool {
            place == self.0
        }

        fn outputs(&self, image: &[u8]) -> Outputs {
            let mut outputs = Outputs::default();
            outputs.digital[self.0] = image[self.0] > 0;
            outputs
        }
    }

    type Two = Pair<Witness, Witness>;

    fn two() -> (Two, [u8; 2]) {
        (Two::new(&(0, 1)), [0; 2])
    }

    #[test]
    fn both_profiles_receive_syncs_and_errors() {
        let (mut pair, mut image) = two();
        pair.synchronised(Some(7), &mut image);
        assert_eq!(image, [7, 7]);
        pair.synchronised(None, &mut image);
        assert_eq!(image, [0xFF, 0xFF]);
        pair.error(ErrorClass::DEVICE, &mut image);
        assert_eq!(image, [2, 2]);
    }

    #[test]
    fn the_events_of_a_tpdo_are_those_of_the_profile_that_sends_them() {
        for tpdo in [0, 1] {
            let (mut pair, mut image) = two();
            let expect = |value: u8| if tpdo == 0 { [value, 0] } else { [0, value] };
            assert!(pair.sends_events(tpdo));
            pair.begin_events(tpdo, &mut image);
            assert_eq!(image, expect(100));
            assert!(pair.next_event(tpdo, &mut image));
            assert_eq!(image, expect(40));
            assert!(!pair.next_event(tpdo, &mut image));
            assert_eq!(image, expect(0));
        }
        assert!(!two().0.sends_events(2));
    }

    #[test]
    fn an_object_and_a_threshold_belong_to_either_profile() {
        let (pair, image) = two();
        assert_eq!([0, 1, 2].map(|index| pair.handles(index, 0)), [true, true, false]);
        assert_eq!([0, 1, 2].map(|place| pair.is_quiet(0, place, &image)), [true, true, false]);
    }

    #[test]
    fn a_digital_output_is_on_when_either_profile_switches_it_on() {
        let (pair, _) = two();
        for digital in [[false, false], [true, false], [false, true], [true, true]] {
            assert_eq!(pair.outputs(&digital.map(u8::from)), Outputs { digital });
        }
    }

    #[test]
    fn the_position_inputs_serve_the_first_profile_that_uses_them() {
        let unused = PositionInputs::default();
        let incremental = PositionInputs { are_used: true, ..unused };
        let ssi = |bits| PositionInputs { ssi_bits: Some(bits), ..incremental };
        let of = |first, second| ChainPair::<Sensor, Sensor>::position_inputs(&(first, second));
        assert_eq!(of(unused, unused), unused);
        assert_eq!(of(incremental, unused), incremental);
        assert_eq!(of(unused, ssi(12)), ssi(12));
        assert_eq!(of(ssi(24), ssi(12)), ssi(24));
    }
}
