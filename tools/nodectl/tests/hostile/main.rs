//! Tests with hostile clients over real sockets: clients that are no page of this server, and pages that behave badly.
//! The tests check the answers to them, and that they do not disturb other pages.

mod socket;

use std::io::Write;
use std::net::SocketAddr;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use nodectl::page::{FromPage, Hub, Options, PageId, Server};

use socket::{PATIENCE, Socket, connect, request};

/// A server, and the actions of its pages.
struct Bench {
    server: Server,
    news: Receiver<FromPage>,
}

impl Bench {
    fn new() -> Bench {
        let (sender, news) = channel();
        let address = "127.0.0.1:0".parse().unwrap();
        let server = nodectl::page::start(&Options { address }, move |said| drop(sender.send(said))).unwrap();
        Bench { server, news }
    }

    fn address(&self) -> SocketAddr {
        self.server.address
    }

    fn hub(&self) -> &Hub {
        &self.server.hub
    }

    fn next(&self) -> FromPage {
        self.news.recv_timeout(PATIENCE).unwrap()
    }

    /// The token in the page.
    fn token(&self) -> String {
        let page = request(self.address(), "GET /", &[&format!("Host: {}", self.address())]).body;
        let start = page.find("name=\"token\" content=\"").expect("a token in the page") + 22;
        page[start..start + 32].to_owned()
    }

    /// A connected page.
    fn page(&self, query: &str) -> (Socket, PageId, bool) {
        let socket = Socket::open(self.address(), query).unwrap();
        loop {
            if let FromPage::Came { page, writes } = self.next() {
                return (socket, page, writes);
            }
        }
    }
}

#[test]
fn only_this_server_s_own_page_gets_the_token_and_only_the_token_writes() {
    let bench = Bench::new();
    let address = bench.address();
    let token = bench.token();
    let (_reader, _, writes) = bench.page("");
    assert!(!writes);
    let (_writer, _, writes) = bench.page(&format!("?token={token}"));
    assert!(writes);
    assert_eq!(Socket::open(address, "?token=00000000000000000000000000000000").err(), Some(403));
    for origin in ["http://evil.example", "null", &format!("http://localhost:{}", address.port())] {
        assert_eq!(
            Socket::open_from(address, &format!("?token={token}"), origin).err(),
            Some(403),
            "{origin}"
        );
    }
}

#[test]
fn a_foreign_name_of_this_machine_gets_nothing() {
    let bench = Bench::new();
    let port = bench.address().port();
    let own = format!("Host: 127.0.0.1:{port}");
    for headers in [
        vec![format!("Host: evil.example:{port}")],
        vec!["Host: 127.0.0.1".to_owned()],
        vec![own.clone(), format!("Host: evil.example:{port}")],
        vec![own.clone(), "Origin: http://evil.example".to_owned()],
        vec![],
    ] {
        let headers: Vec<&str> = headers.iter().map(String::as_str).collect();
        let answer = request(bench.address(), "GET /", &headers);
        assert!(
            matches!(answer.status, 400 | 403) && !answer.body.contains("token\""),
            "{headers:?}: {}",
            answer.status
        );
    }
    let answer = request(bench.address(), "GET /", &[&own]);
    assert_eq!(answer.status, 200);
    for header in [
        "content-security-policy: default-src 'self'",
        "x-content-type-options: nosniff",
        "cache-control: no-store",
    ] {
        assert!(answer.head.contains(header), "{header}: {}", answer.head);
    }
    assert!(!answer.head.contains("access-control-allow"));
    for path in ["/../Cargo.toml", "/%2e%2e/Cargo.toml", "/nothing", "//"] {
        assert_eq!(request(bench.address(), &format!("GET {path}"), &[&own]).status, 404, "{path}");
    }
    assert_eq!(request(bench.address(), "POST /", &[&own]).status, 405);
}

/// Many hostile clients are connected at the same time: silent connections, half a request, half a frame, nonsense, a
/// page that floods, and pages that never read. Another page still gets all of its messages.
#[test]
fn whatever_others_do_a_page_loses_nothing() {
    let bench = Bench::new();
    let (mut good, page, _) = bench.page("");
    let silent: Vec<_> = (0..20).map(|_| connect(bench.address())).collect();
    let mut half = connect(bench.address());
    half.write_all(b"GET / HTTP/1.1\r\nHost: 127").unwrap();
    let mut nonsense = connect(bench.address());
    nonsense.write_all(&[0xFF; 4096]).unwrap();
    let mut sockets: Vec<(Socket, PageId)> =
        (0..6).map(|_| bench.page("")).map(|(s, page, _)| (s, page)).collect();
    // An unmasked frame, a reserved operation, half a frame, a frame that is too large, and two pages that do not read.
    sockets[0].0.send_raw(&[0x81, 0x01, b'x']);
    sockets[1].0.send_raw(&[0xBF, 0x80, 0, 0, 0, 0]);
    sockets[2].0.send_raw(&[0x81, 0xFE, 0x10]);
    sockets[3].0.send_raw(&[0x81, 0xFF, 0x7F, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0]);
    let flood = bench.page("").0;
    let flooding = std::thread::spawn(move || {
        let mut flood = flood;
        // The server reads at its limited rate. The other messages wait in the sender's queue, and are dropped with the
        // connection.
        (0..2000).take_while(|_| flood.send(1, b"{\"id\":1,\"do\":\"nothing\"}")).count()
    });
    let big = "x".repeat(64 * 1024);
    for number in 0..400 {
        for (_, deaf) in &sockets[4..] {
            if bench.hub().has_room(*deaf) {
                bench.hub().send(*deaf, big.clone());
            }
        }
        bench.hub().send(page, format!("event {number}"));
        assert_eq!(good.text().unwrap(), format!("event {number}"));
        assert!(good.send(1, b"heard"));
    }
    for (_, deaf) in &sockets[4..] {
        assert!(!bench.hub().has_room(*deaf), "what waits for a page that does not read is bounded");
    }
    let mut heard = 0;
    while heard < 400 {
        heard += usize::from(bench.next() == FromPage::Said { page, text: "heard".to_owned() });
    }
    drop((silent, half, nonsense, sockets));
    assert!(flooding.join().unwrap() > 0);
}

/// Connections that send requests and read no answer, with and without a valid `Host`, take every place. A page connects all
/// the same.
#[test]
fn connections_that_read_nothing_lock_no_client_out() {
    let bench = Bench::new();
    let own = bench.address().to_string();
    let deaf: Vec<_> = (0..200)
        .map(|number| {
            let host = if number % 4 == 0 { "evil.example" } else { &own };
            let request = format!("GET /lib/chart.js HTTP/1.1\r\nHost: {host}\r\n\r\n");
            let mut stream = connect(bench.address());
            stream.set_write_timeout(Some(Duration::from_millis(20))).unwrap();
            // The server closes some of them, and takes no more requests from others.
            let _ = stream.write_all(request.repeat(200).as_bytes());
            stream
        })
        .collect();
    let (_page, _, writes) = bench.page(&format!("?token={}", bench.token()));
    assert!(writes);
    drop(deaf);
}

/// Pages without the token leave places for pages with it.
#[test]
fn pages_without_the_token_leave_places() {
    let bench = Bench::new();
    let token = bench.token();
    let readers: Vec<Socket> = (0..40).filter_map(|_| Socket::open(bench.address(), "").ok()).collect();
    let _page = Socket::open(bench.address(), &format!("?token={token}")).unwrap();
    let mut writes = false;
    let came = std::iter::from_fn(|| {
        (!writes)
            .then(|| matches!(bench.next(), FromPage::Came { writes: token, .. } if { writes = token; true }))
    });
    assert!(came.filter(|came| *came).count() <= 25, "24 without the token, and one with it");
    drop(readers);
}

#[test]
fn a_released_page_gets_the_messages_before() {
    let bench = Bench::new();
    let (mut socket, page, _) = bench.page("");
    assert!(socket.send(2, &[1, 2, 3]));
    assert_eq!(bench.next(), FromPage::Said { page, text: String::new() });
    bench.hub().send(page, "no".to_owned());
    bench.hub().close(page);
    assert_eq!(socket.text().as_deref(), Some("no"));
    assert_eq!(socket.text(), None);
    assert_eq!(bench.next(), FromPage::Left { page });
}

#[test]
fn a_port_that_is_taken_is_no_error() {
    let bench = Bench::new();
    let taken = bench.address();
    let next = nodectl::page::start(&Options { address: taken }, |_| ()).unwrap();
    assert!(next.address.port() > taken.port() && next.url == format!("http://{}/", next.address));
}
