//! Streams of bytes over TCP or a serial port, with deadlines.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use canopen::Instant;
use serialport::SerialPort;

use super::BusError;
use super::clock;

/// How long a host may take to accept a connection.
const CONNECT: Duration = Duration::from_secs(3);
/// The shortest time-out of a read; 0 would mean no time-out.
const SHORTEST: Duration = Duration::from_millis(1);

/// The error of the C library for a file that is no serial port.
const NO_TERMINAL: &str = "Not a typewriter";

/// A source of bytes that can be read with a time-out.
trait Port: Read + Write {
    /// Reads some bytes within this time. With a time of 0, bytes that are there already.
    fn read_within(&mut self, time: Duration, buffer: &mut [u8]) -> io::Result<usize>;
}

impl Port for TcpStream {
    fn read_within(&mut self, time: Duration, buffer: &mut [u8]) -> io::Result<usize> {
        if !time.is_zero() {
            self.set_read_timeout(Some(time.max(SHORTEST)))?;
            return self.read(buffer);
        }
        self.set_nonblocking(true)?;
        let result = self.read(buffer);
        self.set_nonblocking(false)?;
        result
    }
}

impl Port for Box<dyn SerialPort> {
    fn read_within(&mut self, time: Duration, buffer: &mut [u8]) -> io::Result<usize> {
        if time.is_zero() && self.bytes_to_read()? == 0 {
            return Err(ErrorKind::TimedOut.into());
        }
        self.set_timeout(time.max(SHORTEST))?;
        self.read(buffer)
    }
}

/// An open connection.
pub(super) struct Stream {
    port: Box<dyn Port>,
}

impl Stream {
    /// Connects to the first address of a host that accepts the connection.
    pub(super) fn connect(host: impl ToSocketAddrs) -> io::Result<Stream> {
        let mut failure = io::Error::new(ErrorKind::NotFound, "no such host");
        for address in host.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, CONNECT) {
                Ok(stream) => {
                    // A request is one small write that must be sent at once.
                    stream.set_nodelay(true)?;
                    return Ok(Stream { port: Box::new(stream) });
                }
                Err(error) => failure = error,
            }
        }
        Err(failure)
    }

    /// Opens a serial port. The common USB adapters ignore the line speed.
    pub(super) fn serial(device: &str) -> io::Result<Stream> {
        let port = serialport::new(device, 115_200).timeout(SHORTEST).open().map_err(|error| {
            // The operating system: "not a typewriter".
            let is_other =
                error.description == NO_TERMINAL || error.description.starts_with("Inappropriate ioctl");
            if is_other {
                io::Error::new(ErrorKind::InvalidInput, "it is no serial port")
            } else {
                error.into()
            }
        })?;
        Ok(Stream { port: Box::new(port) })
    }

    pub(super) fn write(&mut self, text: &str) -> Result<(), BusError> {
        self.port.write_all(text.as_bytes()).and_then(|()| self.port.flush()).map_err(BusError::Lost)
    }

    /// Reads some bytes; none at the deadline. With a deadline in the past, the function does not wait.
    pub(super) fn read(&mut self, until: Instant) -> Result<Vec<u8>, BusError> {
        let mut buffer = [0; 4096];
        match self.port.read_within(clock::left(until), &mut buffer) {
            Ok(0) => Err(BusError::Lost(ErrorKind::UnexpectedEof.into())),
            Ok(count) => Ok(buffer[..count].to_vec()),
            Err(error) if is_time_out(&error) => Ok(Vec::new()),
            Err(error) => Err(BusError::Lost(error)),
        }
    }
}

/// Whether an error is a time-out. The kind of error depends on the operating system.
pub(super) fn is_time_out(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
