//! SDO transfers on a bus where one frame in a hundred is destroyed, one arrives twice and one is held up.

use canopen::Duration;
use fastrand::Rng;
use host_tests::domain::{CAPACITY, DOMAIN, DomainDevice, ID};
use host_tests::network::{Disturbance, Network, Tally};
use host_tests::sdo::Client;

/// Rounds of four transfers each.
const ROUNDS: u64 = 80;
/// The pause between two transfers: repeated or delayed frames of one transfer have arrived before the next one begins.
const PAUSE: Duration = Duration::from_millis(10);

fn bus(seed: u64, percent: u32) -> Network<DomainDevice> {
    let mut network = Network::new([DomainDevice::new()]).disturbed(Disturbance::new(seed, percent));
    network.start();
    network.run(PAUSE);
    network
}

/// Downloads and uploads by both kinds of transfer, each time with other data.
fn round(network: &mut Network<DomainDevice>, rng: &mut Rng, len: usize) {
    let [first, second] = [0; 2].map(|_| (0..len).map(|_| rng.u8(..)).collect::<Vec<_>>());
    let block_size = rng.u8(2..=127);
    for (by_blocks, data) in [(true, first), (false, second)] {
        let mut link = network.server(ID);
        let mut client = Client::new(&mut link);
        let written =
            if by_blocks { client.write_blocks(DOMAIN, &data) } else { client.write(DOMAIN, &data) };
        assert_eq!(written, Ok(()));
        assert!(network.stations[0].unit.content() == data);
        network.run(PAUSE);
        let mut link = network.server(ID);
        let mut client = Client::new(&mut link);
        let read = if by_blocks { client.read(DOMAIN) } else { client.read_blocks(DOMAIN, block_size) };
        assert!(read == Ok(data), "{:?}", read.err());
        network.run(PAUSE);
        assert_eq!(aborts(network), 0, "the server has complained of a request that came twice");
    }
}

fn aborts(network: &mut Network<DomainDevice>) -> usize {
    let responses = std::iter::from_fn(|| network.hear_id(0x580 + u16::from(ID)));
    responses.filter(|frame| frame.data()[0] == 0x80).count()
}

#[test]
fn transfers_of_any_length_arrive_unchanged() {
    let (mut transfers, mut sum) = (0, Tally::default());
    for seed in 0..ROUNDS {
        let (mut network, mut rng) = (bus(seed, 1), Rng::with_seed(seed));
        let len = rng.usize(5..=2048);
        round(&mut network, &mut rng, len);
        transfers += 4;
        let tally = network.tally();
        sum.destroyed += tally.destroyed;
        sum.repeated += tally.repeated;
        sum.delayed += tally.delayed;
        assert!(network.traffic().errors > 0);
    }
    println!("{transfers} transfers: {sum:?}");
    assert!(sum.destroyed > 500 && sum.repeated > 500 && sum.delayed > 500);
}

#[test]
fn four_kib_arrive_unchanged() {
    for seed in 100..105 {
        round(&mut bus(seed, 1), &mut Rng::with_seed(seed), 4096);
    }
    round(&mut bus(105, 1), &mut Rng::with_seed(105), CAPACITY);
}

#[test]
fn the_same_seed_takes_the_same_course() {
    let course = |seed| {
        let mut network = bus(seed, 1);
        round(&mut network, &mut Rng::with_seed(1), 1000);
        (network.now(), network.traffic(), network.tally())
    };
    assert_eq!(course(7), course(7));
    assert_ne!(course(7), course(8));
}

/// Three times the error rate. At five times the rate, the error counters would end in bus-off: they go up by eight for
/// a failed frame and down by one for a sent frame.
#[test]
fn a_worse_bus_is_slower_and_no_less_exact() {
    for seed in 200..210 {
        round(&mut bus(seed, 3), &mut Rng::with_seed(seed), 500);
    }
}
