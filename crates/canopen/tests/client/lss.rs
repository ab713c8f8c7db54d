//! The LSS master against slaves that are built from the protocol's messages.

use std::ops::Range;

use canopen::client::lss::{self, Error, Fastscan, Name, Options};
use canopen::client::{Service, Step, Taken};
use canopen::lss::{BitRate, Identity, Part, Request, Response};
use canopen::{Duration, Frame, Instant, NodeId};

const OPTIONS: Options = Options { timeout: Duration::from_millis(10), retries: 2 };

/// Slaves without a node-ID, known by their identities. Answers with these numbers are lost.
struct Slaves {
    waiting: Vec<(Identity, u8)>,
    selected: Option<Identity>,
    answers: usize,
    loses: Range<usize>,
}

impl Slaves {
    fn new(serials: &[u32], loses: Range<usize>) -> Slaves {
        let identity = |serial| Identity { vendor: 0x319, product: 2, revision: 0x1_0000, serial };
        let waiting = serials.iter().map(|&serial| (identity(serial), 0)).collect();
        Slaves { waiting, selected: None, answers: 0, loses }
    }

    fn answer(&mut self, frame: &Frame) -> Option<Response> {
        let request = Request::parse(frame.data().try_into().ok()?)?;
        let response = self.respond(request)?;
        self.answers += 1;
        (!self.loses.contains(&self.answers)).then_some(response)
    }

    fn respond(&mut self, request: Request) -> Option<Response> {
        match request {
            Request::SwitchGlobal { configuration: false } => {
                self.waiting.extend(self.selected.take().map(|identity| (identity, 0)));
                None
            }
            Request::Fastscan { bit: Request::CONFIRM, .. } => {
                self.waiting.iter_mut().for_each(|slave| slave.1 = 0);
                (!self.waiting.is_empty()).then_some(Response::Identified)
            }
            Request::Fastscan { value, bit, part, next } => {
                let mut matches = false;
                for (identity, turn) in &mut self.waiting {
                    let own = identity.part(Part::ALL[usize::from(part)]);
                    if *turn == part && (own ^ value) >> bit == 0 {
                        (*turn, matches) = (next, true);
                        if bit == 0 && part == 3 && next == 0 {
                            self.selected = Some(*identity);
                        }
                    }
                }
                self.waiting.retain(|(identity, _)| Some(*identity) != self.selected);
                matches.then_some(Response::Identified)
            }
            Request::Select(Part::Serial, serial) => {
                let found = self.waiting.iter().position(|(identity, _)| identity.serial == serial)?;
                self.selected = Some(self.waiting.remove(found).0);
                Some(Response::Selected)
            }
            Request::Inquire(part) => Some(Response::Identity(part, self.selected?.part(part))),
            Request::NodeId(id) => self.selected.map(|_| Response::NodeId(u8::from(id > 127))),
            _ => None,
        }
    }
}

fn run<S: Service>(mut service: S, slaves: &mut Slaves) -> S::Output {
    let (mut now, mut answer) = (Instant(0), None);
    loop {
        match service.next(now) {
            Step::Send(frame) => {
                assert_eq!((frame.id(), frame.len()), (0x7E5, 8));
                answer = slaves.answer(&frame);
            }
            Step::Wait(until) => match answer.take() {
                Some(response) => {
                    service.on_frame(&Frame::new(0x7E4, &response.encode()).unwrap(), now);
                }
                None => now = until,
            },
            Step::Done(output) => return output,
        }
    }
}

#[test]
fn fastscan_finds_the_lowest_identity_and_selects_it() {
    let mut slaves = Slaves::new(&[0xFFFF_FFFF, 7, 0x8000_0000], 0..0);
    let found = run(Fastscan::new(OPTIONS), &mut slaves).unwrap().unwrap();
    assert_eq!((found.serial, slaves.selected), (7, Some(found)));
    assert_eq!(run(lss::inquire(Part::Vendor, OPTIONS), &mut slaves), Ok(0x319));
    assert_eq!(run(lss::set_node_id(NodeId::new(9), OPTIONS), &mut slaves), Ok(()));
    let refusal = run(lss::set_node_id(None, OPTIONS), &mut slaves);
    assert_eq!(refusal, Err(Error::Refused(Name::NodeId, 1)));
}

#[test]
fn fastscan_without_a_slave_finds_none() {
    assert_eq!(run(Fastscan::new(OPTIONS), &mut Slaves::new(&[], 0..0)), Ok(None));
}

/// Whichever answer is lost, the identity found is right.
#[test]
fn a_lost_answer_costs_time_and_nothing_else() {
    for lost in 1..90 {
        let mut slaves = Slaves::new(&[0x1234_5678], lost..lost + 1);
        let found = run(Fastscan::new(OPTIONS), &mut slaves).unwrap().unwrap();
        assert_eq!((found.serial, slaves.selected), (0x1234_5678, Some(found)), "{lost}");
    }
    let mut slaves = Slaves::new(&[7], 1..3);
    slaves.selected = slaves.waiting.pop().map(|slave| slave.0);
    assert_eq!(run(lss::inquire(Part::Serial, OPTIONS), &mut slaves), Ok(7));
}

#[test]
fn silence_is_reported_after_the_retries() {
    let mut slaves = Slaves::new(&[], 0..0);
    let error = run(lss::store(OPTIONS), &mut slaves).unwrap_err();
    assert_eq!((error, error.to_string().as_str()), (Error::NoAnswer(Name::Store), "LSS store: no answer"));
}

#[test]
fn a_scan_reports_its_progress() {
    let mut slaves = Slaves::new(&[5], 0..0);
    let (mut scan, mut now, mut asked) = (Fastscan::new(OPTIONS), Instant(0), vec![]);
    loop {
        match scan.next(now) {
            Step::Send(frame) => {
                asked.push(scan.asked());
                if let Some(response) = slaves.answer(&frame) {
                    scan.on_frame(&Frame::new(0x7E4, &response.encode()).unwrap(), now);
                }
            }
            Step::Wait(until) => now = until,
            Step::Done(_) => break,
        }
    }
    assert_eq!(asked, (0..Fastscan::QUESTIONS).collect::<Vec<_>>());
}

#[test]
fn a_slave_is_selected_by_its_identity() {
    let mut slaves = Slaves::new(&[5, 7], 0..0);
    let (seven, eight) = (slaves.waiting[1].0, Identity { serial: 8, ..slaves.waiting[1].0 });
    assert_eq!(run(lss::select(&seven, OPTIONS), &mut slaves), Ok(()));
    assert_eq!(slaves.selected, Some(seven));
    assert_eq!(run(lss::select(&eight, OPTIONS), &mut slaves), Err(Error::NoAnswer(Name::Select)));
}

#[test]
fn a_second_answer_changes_nothing() {
    let mut exchange = lss::inquire(Part::Vendor, OPTIONS);
    let frame = |value| Frame::new(0x7E4, &Response::Identity(Part::Vendor, value).encode()).unwrap();
    assert_eq!(exchange.on_frame(&frame(1), Instant(0)), Taken::Ignored, "before the request");
    assert!(matches!(exchange.next(Instant(0)), Step::Send(_)));
    assert_eq!(exchange.on_frame(&frame(2), Instant(1)), Taken::Used);
    assert_eq!(exchange.on_frame(&frame(3), Instant(2)), Taken::Ignored);
    assert_eq!(exchange.next(Instant(3)), Step::Done(Ok(2)));
}

/// Slaves that a former master has selected may answer late.
#[test]
fn an_answer_before_the_last_part_of_an_identity_selects_nothing() {
    let selected = Frame::new(0x7E4, &Response::Selected.encode()).unwrap();
    let identity = Identity { vendor: 0x319, product: 2, revision: 0x1_0000, serial: 7 };
    let mut exchange = lss::select(&identity, OPTIONS);
    for part in Part::ALL {
        assert_eq!(exchange.on_frame(&selected, Instant(0)), Taken::Ignored, "{part:?}");
        assert!(matches!(exchange.next(Instant(0)), Step::Send(_)), "{part:?}");
    }
    assert_eq!(exchange.on_frame(&selected, Instant(0)), Taken::Used);
}

#[test]
fn fastscan_takes_no_other_frame_for_an_answer() {
    let other = [Response::Unconfigured, Response::Selected, Response::NodeIdIs(5)];
    let mut frames = other.map(|response| Frame::new(0x7E4, &response.encode()).unwrap()).to_vec();
    let identified = Frame::new(0x7E4, &Response::Identified.encode()).unwrap();
    frames.push(Frame::new(0x185, identified.data()).unwrap());
    let mut scan = Fastscan::new(Options { retries: 0, ..OPTIONS });
    assert_eq!(scan.on_frame(&identified, Instant(0)), Taken::Ignored, "before the first question");
    assert!(matches!(scan.next(Instant(0)), Step::Send(_)));
    for frame in frames {
        assert_eq!(scan.on_frame(&frame, Instant(1)), Taken::Ignored, "{frame:?}");
    }
    assert_eq!(scan.next(Instant(1)), Step::Wait(Instant(10_000)));
    assert_eq!(scan.next(Instant(10_000)), Step::Done(Ok(None)), "no slave");
}

/// Other slaves may answer a little later.
#[test]
fn a_question_ends_a_quarter_of_the_time_out_after_an_answer() {
    let options = Options { timeout: Duration(10_001), ..OPTIONS };
    let identified = Frame::new(0x7E4, &Response::Identified.encode()).unwrap();
    let mut scan = Fastscan::new(options);
    assert!(matches!(scan.next(Instant(0)), Step::Send(_)));
    assert_eq!(scan.on_frame(&identified, Instant(1000)), Taken::Used);
    assert_eq!(scan.next(Instant(1000)), Step::Wait(Instant(3500)));
    assert!(matches!(scan.next(Instant(3500)), Step::Send(_)));
}

/// The step after these responses, of which the last one must be the answer.
fn outcome<T: Copy>(mut exchange: lss::Exchange<T>, responses: &[Response]) -> Result<T, Error> {
    assert!(matches!(exchange.next(Instant(0)), Step::Send(_)));
    let (answer, others) = responses.split_last().unwrap();
    for (response, taken) in
        others.iter().map(|other| (other, Taken::Unexpected)).chain([(answer, Taken::Used)])
    {
        let frame = Frame::new(0x7E4, &response.encode()).unwrap();
        assert_eq!(exchange.on_frame(&frame, Instant(1)), taken, "{response:?}");
    }
    match exchange.next(Instant(1)) {
        Step::Done(result) => result,
        _ => panic!("the service has not ended"),
    }
}

#[test]
fn each_service_has_its_own_answer() {
    use Response::{BitTiming, Identified, NodeIdIs, Stored, Unconfigured};
    assert_eq!(outcome(lss::identify_unconfigured(OPTIONS), &[Identified, Unconfigured]), Ok(()));
    let identity = [Response::Identity(Part::Vendor, 1), Response::Identity(Part::Serial, 2)];
    assert_eq!(outcome(lss::inquire(Part::Serial, OPTIONS), &identity), Ok(2), "of the part asked for");
    let node_id = |id| outcome(lss::inquire_node_id(OPTIONS), &[Unconfigured, NodeIdIs(id)]);
    assert_eq!((node_id(5), node_id(255)), (Ok(NodeId::new(5)), Ok(None)));
    let bit_rate =
        |code| outcome(lss::set_bit_rate(BitRate::FASTEST, OPTIONS), &[Stored(code), BitTiming(code)]);
    assert_eq!((bit_rate(0), bit_rate(1)), (Ok(()), Err(Error::Refused(Name::BitRate, 1))));
    let store = |code| outcome(lss::store(OPTIONS), &[BitTiming(code), Stored(code)]);
    assert_eq!((store(0), store(2)), (Ok(()), Err(Error::Refused(Name::Store, 2))));
}
