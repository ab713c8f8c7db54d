//! The client of the library, connected to a device under test, for objects of up to 256 bytes.

use canopen::client::sdo::{Buffer, Download, Error, Options, Upload};
use canopen::client::{Service, Step};
use canopen::sdo::{BlockSize, Multiplexer};
use canopen::{Duration, Frame, Instant, NodeId};

const MEMORY: usize = 256;
/// Options for sending every request once.
const ONCE: Options = Options {
    timeout: Duration::from_millis(100),
    limit: Duration::from_millis(1000),
    retries: 0,
    block_size: BlockSize::MAX,
};

/// Reads a value by any transfer that the server chooses; the abort code if the device refuses. `ask` gives a request
/// to the device and returns the frames that the device sends at once.
pub(crate) fn read(node: u8, at: Multiplexer, ask: impl FnMut(Frame) -> Vec<Frame>) -> Result<Vec<u8>, u32> {
    let mut memory = [0; MEMORY];
    let mut upload = Upload::new(NodeId::new(node).unwrap(), at, Buffer::new(&mut memory), ONCE);
    run(&mut upload, ask)?;
    Ok(upload.into_sink().as_slice().to_vec())
}

/// Writes a value, expedited if it has up to four bytes.
pub(crate) fn write(
    node: u8,
    at: Multiplexer,
    value: &[u8],
    ask: impl FnMut(Frame) -> Vec<Frame>,
) -> Result<(), u32> {
    run(&mut Download::new(NodeId::new(node).unwrap(), at, value, ONCE), ask)
}

fn run<S: Service<Output = Result<(), Error>>>(
    service: &mut S,
    mut ask: impl FnMut(Frame) -> Vec<Frame>,
) -> Result<(), u32> {
    loop {
        match service.next(Instant(0)) {
            Step::Send(request) => {
                for answer in ask(request) {
                    service.on_frame(&answer, Instant(0));
                }
            }
            Step::Wait(_) => panic!("no answer"),
            Step::Done(Ok(())) => return Ok(()),
            Step::Done(Err(Error::Abort(code))) => return Err(code.0),
            Step::Done(Err(error)) => panic!("{error}"),
        }
    }
}
