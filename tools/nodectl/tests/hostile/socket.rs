//! A client that works on bytes, so that it can also send what a browser never sends.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// The time-out for an answer of the server. It is long enough for a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_mins(1);

/// An answer to a request.
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: String,
}

pub(crate) fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

/// Sends a request with these header lines on a connection of its own.
pub(crate) fn request(address: SocketAddr, line: &str, headers: &[&str]) -> Answer {
    let mut stream = connect(address);
    let headers: String = headers.iter().map(|header| format!("{header}\r\n")).collect();
    stream.write_all(format!("{line} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n").as_bytes()).unwrap();
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).unwrap();
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
    Answer { status, head: head.to_lowercase(), body: body.to_owned() }
}

/// A WebSocket. Client frames are masked with zeros, which leaves the data unchanged.
pub(crate) struct Socket(TcpStream);

impl Socket {
    /// Connects like a page of this server; `Err` with the status when the connection is refused.
    pub(crate) fn open(address: SocketAddr, query: &str) -> Result<Socket, u16> {
        Socket::open_from(address, query, &format!("http://{address}"))
    }

    pub(crate) fn open_from(address: SocketAddr, query: &str, origin: &str) -> Result<Socket, u16> {
        let mut stream = connect(address);
        let head = format!(
            "GET /ws{query} HTTP/1.1\r\nHost: {address}\r\nOrigin: {origin}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        );
        stream.write_all(head.as_bytes()).unwrap();
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            head.push(byte[0]);
        }
        let head = String::from_utf8_lossy(&head).into_owned();
        let status: u16 = head.split(' ').nth(1).unwrap().parse().unwrap();
        if status == 101 { Ok(Socket(stream)) } else { Err(status) }
    }

    /// Sends a frame: 1 is text, 2 binary, 8 close. Returns whether the other side still accepts frames.
    pub(crate) fn send(&mut self, kind: u8, data: &[u8]) -> bool {
        let mut frame = vec![0x80 | kind];
        match data.len() {
            length @ 0..126 => frame.push(0x80 | u8::try_from(length).unwrap()),
            length => {
                frame.push(0x80 | 127);
                frame.extend((length as u64).to_be_bytes());
            }
        }
        frame.extend([0; 4]);
        frame.extend(data);
        self.0.write_all(&frame).is_ok()
    }

    /// Sends bytes without a frame around them.
    pub(crate) fn send_raw(&mut self, bytes: &[u8]) -> bool {
        self.0.write_all(bytes).is_ok()
    }

    /// The next text; `None` when the connection is closed.
    pub(crate) fn text(&mut self) -> Option<String> {
        loop {
            let (kind, data) = self.frame()?;
            match kind {
                1 => return Some(String::from_utf8(data).unwrap()),
                8 => return None,
                _ => {}
            }
        }
    }

    fn frame(&mut self) -> Option<(u8, Vec<u8>)> {
        let [kind, length] = self.read()?;
        let length = match length & 0x7F {
            126 => u16::from_be_bytes(self.read()?).into(),
            127 => u64::from_be_bytes(self.read()?),
            length => length.into(),
        };
        let mut data = vec![0; usize::try_from(length).unwrap()];
        self.0.read_exact(&mut data).ok()?;
        Some((kind & 0x0F, data))
    }

    fn read<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut bytes = [0; N];
        match self.0.read_exact(&mut bytes) {
            Ok(()) => Some(bytes),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                panic!("nothing comes")
            }
            Err(_) => None,
        }
    }
}
