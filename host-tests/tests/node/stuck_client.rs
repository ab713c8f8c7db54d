//! Clients that die, abort or start over at every step of every transfer, and lost frames: the server is free again, at
//! the latest after its time-out, and never stores an incomplete value.

use canopen::Duration;
use canopen::sdo::Response;
use host_tests::domain::{DOMAIN, DomainDevice, ID, WORD};
use host_tests::network::{Link, Network};
use host_tests::sdo::{Channel, Client, Failure};

/// Time-out of the server, and a little more.
const TIME_OUT: Duration = Duration::from_millis(1010);
/// The pause within a block after which the server acknowledges it.
const BLOCK_PAUSE: Duration = Duration::from_millis(300);
/// Segments in a block of an upload.
const BLOCK_SIZE: u8 = 10;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Transfer {
    Read,
    Write,
    ReadBlocks,
    WriteBlocks,
}

use Transfer::{Read, ReadBlocks, Write, WriteBlocks};

impl Transfer {
    const ALL: [Transfer; 4] = [Read, Write, ReadBlocks, WriteBlocks];

    fn run(self, channel: &mut impl Channel) -> Result<(), Failure> {
        let mut client = Client::new(channel);
        match self {
            Read => client.read(DOMAIN).map(|value| assert!(value == old())),
            ReadBlocks => client.read_blocks(DOMAIN, BLOCK_SIZE).map(|value| assert!(value == old())),
            Write => client.write(DOMAIN, &new()),
            WriteBlocks => client.write_blocks(DOMAIN, &new()),
        }
    }
}

/// The stored value, and the value to write: 29 segments each.
fn old() -> Vec<u8> {
    (0..200).collect()
}

fn new() -> Vec<u8> {
    (0..200).rev().collect()
}

type Bus = Network<DomainDevice>;

fn bus() -> Bus {
    let mut network = Network::new([DomainDevice::new()]);
    network.stations[0].unit.set_content(&old());
    network.start();
    network.run(Duration::from_millis(5));
    network
}

/// A channel with a fault at one frame.
struct Broken<'a> {
    link: Link<'a, DomainDevice>,
    requests: usize,
    responses: usize,
    /// The client dies after this many requests.
    dies_after: usize,
    /// Numbers of the lost request and of the lost response, from 0.
    loses_request: Option<usize>,
    loses_response: Option<usize>,
}

impl<'a> Broken<'a> {
    fn new(network: &'a mut Bus) -> Broken<'a> {
        Broken {
            link: network.server(ID),
            requests: 0,
            responses: 0,
            dies_after: usize::MAX,
            loses_request: None,
            loses_response: None,
        }
    }

    fn pass(&mut self, response: Option<[u8; 8]>) -> Option<[u8; 8]> {
        let number = self.responses;
        self.responses += usize::from(response.is_some());
        response.filter(|_| self.loses_response != Some(number))
    }

    fn is_dead(&self) -> bool {
        self.requests >= self.dies_after
    }
}

impl Channel for Broken<'_> {
    fn send(&mut self, request: [u8; 8]) {
        if !self.is_dead() {
            if self.loses_request != Some(self.requests) {
                self.link.send(request);
            }
            self.requests += 1;
        }
    }

    fn received(&mut self) -> Option<[u8; 8]> {
        if self.is_dead() {
            return None;
        }
        let response = self.link.received();
        self.pass(response)
    }

    fn wait(&mut self) -> Option<[u8; 8]> {
        if self.is_dead() {
            return None;
        }
        let lost = self.responses;
        let response = self.link.wait();
        match self.pass(response) {
            None if self.responses > lost => self.wait(),
            response => response,
        }
    }
}

/// Runs a transfer whose client dies after `step` requests; `false` when the transfer was complete by then.
fn die(network: &mut Bus, transfer: Transfer, step: usize) -> bool {
    let mut channel = Broken { dies_after: step, ..Broken::new(network) };
    let result = transfer.run(&mut channel);
    assert!(matches!(result, Ok(()) | Err(Failure::Silence)), "{transfer:?} {step}: {result:?}");
    result.is_err()
}

/// All responses of the server since the last call.
fn responses(network: &mut Bus) -> Vec<[u8; 8]> {
    let mut link = network.server(ID);
    std::iter::from_fn(|| link.received()).collect()
}

/// Checks that all transfers of another client succeed.
fn assert_free(network: &mut Bus, context: &dyn std::fmt::Debug) {
    let content = network.stations[0].unit.content().to_vec();
    assert!(content == old() || content == new(), "{context:?}: half a value");
    let mut link = network.server(ID);
    let mut client = Client::new(&mut link);
    assert_eq!(client.read(WORD), Ok(vec![0; 4]), "{context:?}");
    assert_eq!(client.write_blocks(DOMAIN, &old()), Ok(()), "{context:?}");
    assert!(client.read_blocks(DOMAIN, 127) == Ok(old()), "{context:?}");
}

/// Calls `then` for each step of a transfer at which its client can die, each on a new bus.
fn each_step(mut then: impl FnMut(&mut Bus, Transfer, usize)) {
    let mut steps = 0;
    for transfer in Transfer::ALL {
        for step in 1.. {
            let mut network = bus();
            if !die(&mut network, transfer, step) {
                break;
            }
            then(&mut network, transfer, step);
            steps += 1;
        }
    }
    // Number of requests: twice 1 and 29 segments; begin, start and three acknowledgements; begin, 29 segments and end.
    assert_eq!(steps, 30 + 30 + 5 + 31);
}

#[test]
fn a_transfer_of_a_dead_client_is_aborted_after_the_time_out() {
    each_step(|network, transfer, step| {
        // Within a block, the time-out begins when the server acknowledges the pause.
        network.run(BLOCK_PAUSE);
        network.run(TIME_OUT);
        let last = responses(network).last().copied().and_then(Response::parse);
        // After the last segment of a segmented transfer and after the end of a block download, the server waits for no
        // further request.
        let is_told = matches!(last, Some(Response::Abort(at, 0x0504_0000)) if at == DOMAIN);
        let is_over = match transfer {
            Read | Write => step == 30,
            ReadBlocks => false,
            WriteBlocks => step == 31,
        };
        assert_eq!(is_told, !is_over, "{transfer:?} {step}: {last:X?}");
        assert_free(network, &(transfer, step));
    });
}

#[test]
fn a_client_that_gives_up_leaves_a_free_server_that_says_nothing() {
    each_step(|network, transfer, step| {
        let mut link = network.server(ID);
        Client::new(&mut link).abort(DOMAIN);
        // Segments of a block may already be in the mailboxes.
        network.run(Duration::from_millis(10));
        let aborts = responses(network).into_iter().filter(|frame| frame[0] == 0x80).count();
        assert_eq!(aborts, 0, "{transfer:?} {step}");
        assert_free(network, &(transfer, step));
        network.run(TIME_OUT);
        assert_eq!(responses(network), [[0; 8]; 0], "{transfer:?} {step}");
    });
}

#[test]
fn a_client_that_starts_over_is_served_at_once() {
    each_step(|network, transfer, step| {
        // Within a block download every frame is a segment, so the client must abort before it starts over.
        if transfer != WriteBlocks {
            network.run(Duration::from_millis(10));
            assert_free(network, &(transfer, step));
        }
    });
}

/// The server loses a frame because its receive FIFO is full. In a block transfer the client sends the frame again.
#[test]
fn a_lost_request_delays_a_block_download_or_ends_the_transfer() {
    for transfer in Transfer::ALL {
        let mut completed = 0;
        for lost in 0..40 {
            let mut network = bus();
            let mut channel = Broken { loses_request: Some(lost), ..Broken::new(&mut network) };
            let result = transfer.run(&mut channel);
            let was_lost = channel.requests > lost;
            network.run(TIME_OUT);
            assert_free(&mut network, &(transfer, lost));
            match result {
                Ok(()) => completed += usize::from(was_lost),
                Err(failure) => assert_eq!(failure, Failure::Silence, "{transfer:?} {lost}"),
            }
        }
        // Completed transfers: for each of the 29 segments of the block download, and for the end confirmation of the
        // block upload, which the client does not wait for.
        let expected = match transfer {
            Read | Write => 0,
            ReadBlocks => 1,
            WriteBlocks => 29,
        };
        assert_eq!(completed, expected, "{transfer:?}");
    }
}

/// The client loses a frame.
#[test]
fn a_lost_segment_of_a_block_upload_is_sent_again() {
    let mut completed = 0;
    for lost in 0..31 {
        let mut network = bus();
        let mut channel = Broken { loses_response: Some(lost), ..Broken::new(&mut network) };
        completed += usize::from(ReadBlocks.run(&mut channel) == Ok(()));
        network.run(TIME_OUT);
        assert_free(&mut network, &lost);
    }
    assert_eq!(completed, 29, "all but the first and the last response");
}
