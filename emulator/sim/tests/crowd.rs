//! Many clients, some slow and one greedy: the other clients are not affected. Latency is virtual time; memory is that
//! of the process.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};

use canbus::Time;
use sim::gateway::{Gateway, Protocol};
use sim::world::World;

const MILLISECOND: Time = Time::from_millis(1);

/// Number of clients, number of clients that never read, and the memory limit of the process in bytes.
const CLIENTS: usize = 400;
const DEAF: usize = 20;
const MEMORY: u64 = 200_000_000;

struct Crowd {
    world: World,
    gateway: Gateway,
    address: SocketAddr,
    /// The two clients whose latency is measured; `others` are the rest.
    pair: [TcpStream; 2],
    others: Vec<TcpStream>,
}

impl Crowd {
    fn new() -> Crowd {
        let (world, mut gateway) = (World::new(Vec::new(), 500, 0), Gateway::new().unwrap());
        let address = gateway.listen("127.0.0.1:0".parse().unwrap(), Protocol::Slcan).unwrap();
        let pair = [connect(address), connect(address)];
        let mut crowd = Crowd { world, gateway, address, pair, others: Vec::new() };
        crowd.settle();
        crowd
    }

    fn join(&mut self, count: usize) {
        let address = self.address;
        for _ in 0..count {
            self.others.push(connect(address));
            // The host's queue for the listener is shorter than the number of clients.
            self.step();
        }
        self.settle();
    }

    /// Runs until all clients are on the bus.
    fn settle(&mut self) {
        while self.gateway.clients() < self.others.len() + 2 {
            self.step();
        }
        (0..10).for_each(|_| self.step());
        self.read(DEAF);
        self.pair.iter_mut().for_each(|client| drop(taken(client)));
    }

    fn step(&mut self) {
        self.gateway.poll(&mut self.world);
        self.world.run_until(self.world.now() + MILLISECOND);
        self.gateway.deliver(&mut self.world);
    }

    /// All other clients but the first `deaf` ones read.
    fn read(&mut self, deaf: usize) {
        self.others.iter_mut().skip(deaf).for_each(|client| drop(taken(client)));
    }

    /// Mean virtual milliseconds from a frame of the first client to its arrival at the second.
    fn latency(&mut self, mut meanwhile: impl FnMut(&mut Crowd)) -> f64 {
        const TIMES: u32 = 20;
        let start = self.world.now();
        for _ in 0..TIMES {
            let sent = self.world.now();
            self.pair[0].write_all(b"t123155\r").unwrap();
            loop {
                meanwhile(self);
                self.step();
                if taken(&mut self.pair[1]).contains("t123155\r") {
                    break;
                }
                assert!(self.world.now().since(sent) < MILLISECOND * 100, "it never comes");
            }
        }
        self.world.now().since(start).as_secs_f64() * 1000.0 / f64::from(TIMES)
    }
}

fn connect(address: SocketAddr) -> TcpStream {
    let mut client = TcpStream::connect(address).unwrap();
    client.set_nonblocking(true).unwrap();
    // The host must not delay a frame to join it with the next one.
    client.set_nodelay(true).unwrap();
    client.write_all(b"S6\rO\r").unwrap();
    client
}

/// The text that a client has received.
fn taken(client: &mut TcpStream) -> String {
    let (mut all, mut buffer) = (Vec::new(), [0; 65536]);
    loop {
        match client.read(&mut buffer) {
            Ok(0) => panic!("the connection was closed"),
            Ok(count) => all.extend(&buffer[..count]),
            Err(error) if error.kind() == ErrorKind::WouldBlock => return String::from_utf8(all).unwrap(),
            Err(error) => panic!("{error}"),
        }
    }
}

/// Resident memory of this process in bytes, which includes the clients.
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmRSS")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
}

/// Sends without pause and ignores errors.
fn flood(client: &mut TcpStream) {
    while client.write(&b"t7FF80000000000000000\r".repeat(100)).is_ok() {}
}

#[cfg(target_os = "linux")]
#[test]
fn a_crowd_with_deaf_and_greedy_clients_keeps_its_latency_and_its_memory() {
    let mut crowd = Crowd::new();
    let alone = crowd.latency(|_| {});
    crowd.join(CLIENTS - 2);
    let greedy = CLIENTS - 3;
    // A minute of virtual time takes minutes on the host.
    let span = if std::env::var_os("THOROUGH").is_some() { 60_000 } else { 200 };
    for _ in 0..span {
        flood(&mut crowd.others[greedy]);
        crowd.step();
        crowd.read(DEAF);
        taken(&mut crowd.pair[0]);
        taken(&mut crowd.pair[1]);
    }
    let crowded = crowd.latency(|crowd| {
        flood(&mut crowd.others[greedy]);
        crowd.read(DEAF);
        taken(&mut crowd.pair[0]);
    });
    assert!(crowded <= 2.0 * alone, "{alone} ms alone, {crowded} ms in the crowd");
    let full = memory();
    assert!(full < MEMORY, "{full} bytes");

    crowd.others.clear();
    while crowd.gateway.clients() > 2 {
        crowd.step();
    }
    taken(&mut crowd.pair[0]);
    taken(&mut crowd.pair[1]);
    let after = crowd.latency(|_| {});
    assert!(after <= 1.5 * alone, "{alone} ms before, {after} ms after the crowd");
    let left = crowd.world.take_frames().len();
    assert!(left > span, "the bus was full: {left} frames");
}
