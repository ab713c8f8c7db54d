//! Clients over real sockets on one bus, without a board.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};

use canbus::Time;
use sim::gateway::{Gateway, Protocol};
use sim::world::World;

/// A bus with a gateway, and virtual time that passes while a client waits for an answer.
struct Bench {
    world: World,
    gateway: Gateway,
}

impl Bench {
    fn new() -> Bench {
        Bench { world: World::new(Vec::new(), 1000, 0), gateway: Gateway::new().unwrap() }
    }

    fn serve(&mut self, protocol: Protocol) -> SocketAddr {
        self.gateway.listen("127.0.0.1:0".parse().unwrap(), protocol).unwrap()
    }

    fn connect(&mut self, address: SocketAddr) -> TcpStream {
        let client = TcpStream::connect(address).unwrap();
        client.set_nonblocking(true).unwrap();
        client
    }

    fn step(&mut self) {
        self.gateway.poll(&mut self.world);
        self.world.run_until(self.world.now() + Time::from_millis(1));
        self.gateway.deliver(&mut self.world);
        std::thread::yield_now();
    }

    fn run(&mut self, steps: usize) {
        (0..steps).for_each(|_| self.step());
    }

    /// The bytes that the client receives, up to and including `end`.
    fn answer(&mut self, client: &mut TcpStream, end: u8) -> String {
        let mut text = Vec::new();
        while text.last() != Some(&end) {
            let mut byte = [0];
            match client.read(&mut byte) {
                Ok(0) => panic!("the connection was closed after {:?}", String::from_utf8_lossy(&text)),
                Ok(_) => text.push(byte[0]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => self.step(),
                Err(error) => panic!("{error}"),
            }
        }
        String::from_utf8(text).unwrap()
    }

    /// Sends a message of socketcand and returns the answer.
    fn ask(&mut self, client: &mut TcpStream, message: &str) -> String {
        client.write_all(message.as_bytes()).unwrap();
        self.answer(client, b'>')
    }

    fn raw_client(&mut self, address: SocketAddr) -> TcpStream {
        let mut client = self.connect(address);
        assert_eq!(self.answer(&mut client, b'>'), "< hi >");
        assert_eq!(self.ask(&mut client, "< open vcan0 >"), "< ok >");
        assert_eq!(self.ask(&mut client, "< rawmode >"), "< ok >");
        client
    }
}

#[test]
fn clients_of_both_protocols_hear_each_other() {
    let mut bench = Bench::new();
    let (socketcand, slcan) = (bench.serve(Protocol::Socketcand), bench.serve(Protocol::Slcan));
    let mut one = bench.raw_client(socketcand);
    let mut two = bench.raw_client(socketcand);
    let mut three = bench.connect(slcan);
    three.write_all(b"S8\rO\r").unwrap();
    assert_eq!(bench.answer(&mut three, b'\r') + &bench.answer(&mut three, b'\r'), "\r\r");

    one.write_all(b"< send 123 2 AB C >").unwrap();
    let heard = bench.answer(&mut two, b'>');
    assert!(heard.starts_with("< frame 123 ") && heard.ends_with(" AB0C >"), "{heard}");
    assert_eq!(bench.answer(&mut three, b'\r'), "t1232AB0C\r");

    three.write_all(b"T1ABCDEF00\r").unwrap();
    assert_eq!(bench.answer(&mut three, b'\r'), "Z\r");
    for client in [&mut one, &mut two] {
        let heard = bench.answer(client, b'>');
        assert!(heard.starts_with("< frame 1ABCDEF0 "), "its own frame is not reported: {heard}");
    }
}

#[test]
fn an_active_client_at_the_wrong_bit_rate_disturbs_and_a_silent_one_does_not() {
    let mut bench = Bench::new();
    let (socketcand, slcan) = (bench.serve(Protocol::Socketcand), bench.serve(Protocol::Slcan));
    let mut one = bench.raw_client(socketcand);
    let mut two = bench.raw_client(socketcand);
    let mut wrong = bench.connect(slcan);
    wrong.write_all(b"S6\rL\r").unwrap();
    bench.answer(&mut wrong, b'\r');
    bench.answer(&mut wrong, b'\r');
    one.write_all(b"< send 055 1 55 >").unwrap();
    assert!(bench.answer(&mut two, b'>').starts_with("< frame 055 "));
    assert_eq!(bench.world.summary(1.0, 0).bus.errors, 0);
    wrong.write_all(b"C\rO\r").unwrap();
    bench.answer(&mut wrong, b'\r');
    bench.answer(&mut wrong, b'\r');
    one.write_all(b"< send 055 1 55 >").unwrap();
    bench.answer(&mut two, b'>');
    assert!(bench.world.summary(1.0, 0).bus.errors > 0);
}

#[test]
fn a_client_that_leaves_gives_its_place_to_the_next() {
    let mut bench = Bench::new();
    let address = bench.serve(Protocol::Socketcand);
    let mut stays = bench.raw_client(address);
    for id in 1..=3 {
        let mut guest = bench.raw_client(address);
        guest.write_all(format!("< send {id:03X} 0 >").as_bytes()).unwrap();
        let heard = bench.answer(&mut stays, b'>');
        assert!(heard.starts_with(&format!("< frame {id:03X} ")), "{heard}");
    }
}

/// Any web page can make a browser send a request to a port of this machine, with text of its choice in the body (a "no-cors"
/// POST). Neither port takes a frame from it, and the connection is closed.
#[test]
fn a_browser_sends_no_frames() {
    let mut bench = Bench::new();
    let [socketcand, slcan] = [Protocol::Socketcand, Protocol::Slcan].map(|protocol| bench.serve(protocol));
    let page = bench.serve(Protocol::Page);
    let mut other = bench.raw_client(socketcand);
    let commands = "< open vcan0 >< rawmode >< send 000 2 2 0 >\r\rC\rS8\rO\rt00020200\r";
    for address in [socketcand, page, slcan] {
        for request in [
            format!("POST / HTTP/1.1\r\nHost: {address}\r\nContent-Type: text/plain\r\n\r\n{commands}"),
            format!("GET /%3C HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\n\r\n{commands}"),
            format!("\u{16}\u{3}\u{1}\u{2}\0{commands}"),
        ] {
            let mut browser = bench.connect(address);
            browser.write_all(request.as_bytes()).unwrap();
            bench.run(50);
            assert!(bench.world.take_frames().is_empty(), "{request}");
            let end = std::iter::from_fn(|| Some(browser.read(&mut [0; 256])))
                .find(|read| !matches!(read, Ok(1..)));
            assert!(
                !matches!(&end, Some(Err(error)) if error.kind() == ErrorKind::WouldBlock),
                "still open: {request}"
            );
        }
    }
    assert_eq!(bench.gateway.clients(), 1);
    assert_eq!(bench.ask(&mut other, "< echo >"), "< echo >");
}

/// Frames that a client has sent before it closed its connection reach the bus, over both protocols: six times `nmt
/// start`.
#[test]
fn frames_sent_before_the_end_reach_the_bus() {
    let mut bench = Bench::new();
    let (socketcand, slcan) = (bench.serve(Protocol::Socketcand), bench.serve(Protocol::Slcan));
    let mut client = bench.raw_client(socketcand);
    client.write_all("< send 000 2 1 5 >".repeat(6).as_bytes()).unwrap();
    drop(client);
    bench.run(20);
    assert_eq!(bench.world.take_frames().len(), 6);

    // A client of slcan closes the channel before it leaves, or opens the channel again.
    for (end, expected) in [("", 6), ("C\r", 6), ("C\rO\rC\r", 6), ("C\rO\rt00020105\rC\r", 7)] {
        let mut client = bench.connect(slcan);
        client.write_all(&[b"S8\rO\r", "t00020105\r".repeat(6).as_bytes(), end.as_bytes()].concat()).unwrap();
        drop(client);
        bench.run(20);
        assert_eq!(bench.world.take_frames().len(), expected, "{end:?}");
        assert_eq!(bench.gateway.clients(), 0, "and then it is gone");
    }
}

/// A closed channel reports no frames, and sends none later.
#[test]
fn a_closed_slcan_channel_is_off_the_bus_once_its_frames_are_sent() {
    let mut bench = Bench::new();
    let (socketcand, slcan) = (bench.serve(Protocol::Socketcand), bench.serve(Protocol::Slcan));
    let mut client = bench.connect(slcan);
    client.write_all(b"S8\rO\rt1230\rC\r").unwrap();
    let answers: String = (0..4).map(|_| bench.answer(&mut client, b'\r')).collect();
    assert_eq!(answers, "\r\rz\r\r");
    bench.run(20);
    assert_eq!(bench.world.take_frames().len(), 1);
    let mut other = bench.raw_client(socketcand);
    other.write_all(b"< send 124 0 >").unwrap();
    bench.run(20);
    client.write_all(b"t1250\r").unwrap();
    assert_eq!(bench.answer(&mut client, b'\x07'), "\x07", "neither a frame nor a success");
}

/// More frames than a client's queue holds.
#[test]
fn a_thousand_frames_before_the_end_reach_the_bus() {
    let mut bench = Bench::new();
    let address = bench.serve(Protocol::Socketcand);
    let mut client = bench.raw_client(address);
    client.write_all("< send 7FF 0 >".repeat(1000).as_bytes()).unwrap();
    drop(client);
    bench.run(200);
    assert_eq!(bench.world.take_frames().len(), 1000);
    assert_eq!((bench.gateway.clients(), bench.gateway.lost()), (0, 0));
}

/// Frames that the bus does not take at this bit rate are dropped: the client can leave, and later clients are served.
#[test]
fn frames_that_the_bus_does_not_take_are_given_up() {
    let mut bench = Bench::new();
    let slcan = bench.serve(Protocol::Slcan);
    let mut wrong = bench.connect(slcan);
    wrong.write_all(&[b"S6\rO\r", "t7FF0\r".repeat(10).as_bytes()].concat()).unwrap();
    drop(wrong);
    bench.run(1100);
    assert_eq!((bench.gateway.clients(), bench.gateway.lost()), (0, 10));
    assert!(bench.world.take_frames().is_empty());
}

#[test]
fn a_port_in_use_is_an_error_that_names_it() {
    let mut bench = Bench::new();
    let address = bench.serve(Protocol::Socketcand);
    let error = bench.gateway.listen(address, Protocol::Slcan).unwrap_err();
    let message = format!("{error:#}");
    assert!(message.contains(&address.to_string()) && !message.contains('\n'), "{message}");
}

#[test]
fn an_interface_that_the_host_has_not_is_an_error_that_names_it() {
    let mut bench = Bench::new();
    let error = bench.gateway.attach_interface("nocan7", &mut bench.world).unwrap_err();
    let message = format!("{error:#}");
    assert!(message.contains("nocan7") && !message.contains('\n'), "{message}");
}
