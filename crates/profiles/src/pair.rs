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

    fn initialise(&mut self, image: &mut [u8], stored: Groups) {
        self.0.initialise(image, stored);
        self.1.initialise(image, stored);
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

    fn is_quiet(&self, place: usize) -> bool {
        self.0.is_quiet(place) || self.1.is_quiet(place)
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

    struct Nothing;

    impl Chain for Nothing {
        type Parameters = ();
        type Snapshot = ();

        fn new(_: &PowerOn) -> Nothing {
            Nothing
        }

        fn apply(&mut self, (): &()) {}

        fn update(&mut self, _: &Inputs, (): &mut ()) {}
    }

    /// A profile that stores its calls at its own place in the image.
    struct Witness(usize);

    impl Profile for Witness {
        type Chain = Nothing;
        type Fields = usize;

        fn new(place: &'static usize) -> Witness {
            Witness(*place)
        }

        fn parameters(&self, _: &[u8]) {}

        fn publish(&mut self, (): &(), _: &mut [u8]) {}

        fn handles(&self, _: u16, _: u8) -> bool {
            false
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
    }

    #[test]
    fn both_profiles_receive_syncs_and_errors() {
        let (mut pair, mut image) = (Pair::<Witness, Witness>::new(&(0, 1)), [0; 2]);
        pair.synchronised(Some(7), &mut image);
        assert_eq!(image, [7, 7]);
        pair.synchronised(None, &mut image);
        assert_eq!(image, [0xFF, 0xFF]);
        pair.error(ErrorClass::DEVICE, &mut image);
        assert_eq!(image, [2, 2]);
    }
}
