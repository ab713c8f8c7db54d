//! The command line.

use std::net::{IpAddr, Ipv4Addr, SocketAddr, ToSocketAddrs};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use canbus::Time;
use chip::Variant;
use clap::{Parser, ValueEnum};
use emulator::Estimate;
use storage::DeviceRecord;

use crate::oscillator::{Lsi, Oscillator};
use crate::personality::Personality;
use crate::stimuli::{Flags, Targeted};

/// Runs the firmware on emulated boards that share a CAN bus with your programs.
#[derive(Debug, Parser)]
#[command(name = "cargo sim", bin_name = "cargo sim", version, max_term_width = 100)]
#[command(override_usage = "cargo sim [OPTIONS]")]
pub struct Options {
    /// ELF file of the firmware.
    #[arg(long, value_name = "PATH", hide = true)]
    pub firmware: PathBuf,

    /// ELF file of the bootloader; without one the firmware starts at once.
    #[arg(long, value_name = "PATH", hide = true)]
    pub bootloader: Option<PathBuf>,

    /// The chip of the boards: stm32f446, stm32f405 or stm32f407. `cargo sim` builds the images for it.
    #[arg(long, value_name = "CHIP", default_value = "stm32f446")]
    pub chip: Variant,

    /// A board with this node-ID and personality; may be given up to 127 times. 201 to 254 are boards that have no
    /// node-ID and wait for LSS; @auto is a board that finds the bit rate by listening.
    #[arg(long = "node", value_name = "ID:PERSONALITY[@auto]", default_value = "1:pressure")]
    pub nodes: Vec<Node>,

    /// Serve socketcand here, with the bus name vcan0. Port 0 takes a free one.
    #[arg(long, value_name = "ADDR:PORT", default_value = "127.0.0.1:29536", value_parser = address)]
    pub socketcand: SocketAddr,

    /// Serve slcan (LAWICEL) here. Port 0 takes a free one.
    #[arg(long, value_name = "ADDR:PORT", value_parser = address)]
    pub slcan: Option<SocketAddr>,

    /// Attach to this SocketCAN interface of the host (Linux).
    #[arg(long, value_name = "IFACE")]
    pub socketcan: Option<String>,

    /// Bit rate of the bus in kbit/s: 10, 20, 50, 125, 250, 500, 800 or 1000.
    #[arg(long, value_name = "KBIT/S", default_value = "250", value_parser = bit_rate)]
    pub bitrate: u16,

    /// As fast as a real board, or as fast as this machine can.
    #[arg(long, value_enum, default_value = "real")]
    pub speed: Speed,

    /// Run the boards on at most this many threads; the default is one for each core of the host. The run is the same
    /// with any number.
    #[arg(long, value_name = "COUNT")]
    pub threads: Option<NonZeroUsize>,

    /// Stop after this much virtual time.
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    pub duration: Option<Time>,

    /// Keep the boards' flash in this directory between runs, one file a node, and beside it what the battery keeps.
    /// Firmware and bootloader are written into a flash that is not there yet.
    #[arg(long, value_name = "DIR")]
    pub flash: Option<PathBuf>,

    /// Write firmware and bootloader also into a flash that --flash has kept; parameters stay.
    #[arg(long, requires = "flash")]
    pub reflash: bool,

    /// Let interrupts come between any two instructions; the number selects one of the possible interleavings. Several
    /// times slower.
    #[arg(long, value_name = "SEED")]
    pub interleave: Option<u64>,

    /// The cycle counts of the cores within the published range: best, modelled or worst. With worst, a core waits for
    /// the flash at each miss of its caches. Silicon lies between best and worst.
    #[arg(long, value_name = "ESTIMATE", default_value = "modelled")]
    pub cycles: Estimate,

    /// Write every frame to this file in the format of candump -l.
    #[arg(long, value_name = "FILE")]
    pub candump: Option<PathBuf>,

    /// Show log lines of this level and above.
    #[arg(long, value_enum, default_value = "info")]
    pub log: LogLevel,

    /// The stimuli from the start on.
    #[command(flatten)]
    pub stimuli: Flags,

    /// Error of the board's oscillator in ppm; the bit time of the CAN controller follows to within 100 ppm at 1
    /// Mbit/s.
    #[arg(long, value_name = "[ID=]PPM", allow_negative_numbers = true)]
    pub oscillator: Vec<Targeted<Oscillator>>,

    /// Frequency of the board's LSI in Hz, from which the watchdog counts.
    #[arg(long, value_name = "[ID=]HERTZ")]
    pub lsi: Vec<Targeted<Lsi>>,

    /// Load the bus with foreign frames of the lowest priority, in percent of its time.
    #[arg(long, value_name = "PERCENT", default_value = "0", value_parser = clap::value_parser!(u8).range(0..=100))]
    pub load: u8,

    /// Serve the page for a browser here, or on the next free port if this one is in use; the default is
    /// 127.0.0.1:8301. With --speed max there is a page only with this flag, because virtual time is then too fast to
    /// watch.
    #[arg(long, value_name = "ADDR:PORT", value_parser = address)]
    pub page: Option<SocketAddr>,

    /// Show no page.
    #[arg(long, conflicts_with = "page")]
    pub no_page: bool,

    /// The program that serves the page (nodectl).
    #[arg(long, value_name = "PATH", hide = true)]
    pub page_program: Option<PathBuf>,

    /// Take commands for the stimuli here, for scripts (docs/page.md). Port 0 takes a free one.
    #[arg(long, value_name = "ADDR:PORT", value_parser = address)]
    pub control: Option<SocketAddr>,

    /// Print JSON only: one line with the served addresses as soon as they are served, and the summary as the last
    /// line. The log goes to the standard error output.
    #[arg(long)]
    pub json: bool,
}

/// A board from the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    /// Node-ID, 1 to 127, or a number from [`UNCONFIGURED`] on for a board without a node-ID.
    pub id: u8,
    /// The personality of the board.
    pub personality: Personality,
    /// Whether the board detects the bit rate.
    pub auto: bool,
}

/// The valid numbers of boards, for messages.
pub(crate) const BOARD_NUMBERS: &str =
    "a node-ID is a number from 1 to 127, and boards without a node-ID have 201 to 254";

/// The default address of the page.
const PAGE: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 8301);

/// The first number of a board without a node-ID.
pub const UNCONFIGURED: u8 = 201;

impl FromStr for Node {
    type Err = String;

    fn from_str(text: &str) -> Result<Node, String> {
        let (id, personality) = text.split_once(':').unwrap_or((text, "pressure"));
        let id = board_number(id).ok_or_else(|| format!("{id:?} is no board: {BOARD_NUMBERS}"))?;
        let (personality, auto) = match personality.split_once('@') {
            Some((personality, "auto")) => (personality, true),
            Some((_, other)) => return Err(format!("{other:?} is no way to get a bit rate; auto is")),
            None => (personality, false),
        };
        Ok(Node { id, personality: personality.parse()?, auto })
    }
}

impl Options {
    /// The address for the page and the program that serves it; `None` when no page is wanted.
    pub(crate) fn page(&self) -> Option<(SocketAddr, &Path)> {
        let program = self.page_program.as_deref().filter(|_| !self.no_page)?;
        let usual = (self.speed == Speed::Real).then_some(PAGE);
        Some((self.page.or(usual)?, program))
    }
}

/// The speed of virtual time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Speed {
    /// One virtual second takes one second.
    Real,
    /// As fast as possible.
    Max,
}

/// Levels of the firmware's log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum LogLevel {
    /// All messages.
    Trace,
    /// Messages for developers.
    Debug,
    /// Normal events.
    Info,
    /// Unexpected events.
    Warn,
    /// Errors.
    Error,
    /// No messages.
    Off,
}

/// Parses a node-ID of CiA 301, or the number of a board without a node-ID.
pub(crate) fn board_number(text: &str) -> Option<u8> {
    text.parse().ok().filter(|id| matches!(id, 1..=127 | UNCONFIGURED..=254))
}

fn bit_rate(text: &str) -> Result<u16, String> {
    let rate = text.parse().ok().filter(|rate| DeviceRecord::BIT_RATES.contains(rate));
    rate.ok_or_else(|| format!("CANopen has these bit rates in kbit/s: {:?}", DeviceRecord::BIT_RATES))
}

/// Parses an address, which may be a name such as localhost.
fn address(text: &str) -> Result<SocketAddr, String> {
    let mut addresses = text.to_socket_addrs().map_err(|_| "it is not of the form ADDR:PORT".to_owned())?;
    addresses.next().ok_or_else(|| "no such host".to_owned())
}

/// Parses virtual seconds; the limit of ten years serves as "for ever".
fn seconds(text: &str) -> Result<Time, String> {
    const MOST: f64 = 315_360_000.0;
    let seconds = text.parse::<f64>().ok().filter(|seconds| (0.0..=MOST).contains(seconds));
    let seconds = seconds.ok_or_else(|| format!("{text:?} is not a number of seconds"))?;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    Ok(Time::from_micros((seconds * 1e6).round() as u64))
}

/// The first paragraph of clap's message, which describes the error; the usage text after it is left out.
pub fn one_line(message: &str) -> String {
    let words = message.lines().take_while(|line| !line.trim().is_empty()).flat_map(str::split_whitespace);
    words.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(flags: &str) -> Result<Options, String> {
        let words = ["sim", "--firmware", "f"].into_iter().chain(flags.split_whitespace());
        Options::try_parse_from(words).map_err(|error| one_line(&error.to_string()))
    }

    #[test]
    fn the_defaults() {
        let options = read("").unwrap();
        assert_eq!(options.nodes, [Node { id: 1, personality: Personality::Pressure, auto: false }]);
        assert_eq!(options.socketcand.to_string(), "127.0.0.1:29536");
        assert_eq!((options.bitrate, options.speed, options.duration), (250, Speed::Real, None));
    }

    #[test]
    fn every_flag_of_the_manual() {
        let flags = "--node 1:pressure@auto --node 201:pressure --socketcand localhost:0 --slcan 127.0.0.1:0 --bitrate 1000 \
             --speed max --threads 2 --for 2.5 --flash d --candump f --log debug --pressure const:250000 --temperature 1=const:298.15 --thermistor const:310 \
             --reflash --interleave 7 --cycles worst --shaft 2=rpm:6000 --button 1=2:down --fault open-sensor@2.5 --oscillator 1=-50 --lsi 2=17000 --load 50 --json --socketcan vcan0 --no-page --control 127.0.0.1:0";
        let options = read(flags).unwrap();
        assert_eq!(options.nodes.len(), 2);
        assert_eq!(options.duration, Some(Time::from_millis(2500)));
        assert_eq!((options.stimuli.shaft[0].node, options.stimuli.pressure[0].node), (Some(2), None));
    }

    #[test]
    fn a_page_is_served_where_a_user_can_watch() {
        let page = |flags: &str| read(flags).unwrap().page().map(|(address, _)| address.to_string());
        let usual = Some("127.0.0.1:8301".to_owned());
        assert_eq!(page("--page-program p"), usual);
        assert_eq!(page("--page-program p --page 127.0.0.1:1"), Some("127.0.0.1:1".to_owned()));
        assert_eq!(page("--page-program p --page 127.0.0.1:1 --speed max"), Some("127.0.0.1:1".to_owned()));
        for flags in ["", "--page-program p --no-page", "--page-program p --speed max"] {
            assert_eq!(page(flags), None, "{flags}");
        }
    }

    #[test]
    fn mistakes_are_reported_in_one_line() {
        let wrong = [
            ("--node 0:pressure", "0"),
            ("--node 128:pressure", "128"),
            ("--node 1:pressure@fast", "auto"),
            ("--node 255:pressure", "boards without a node-ID have 201 to 254"),
            ("--pressure 200=const:1", "boards without a node-ID have 201 to 254"),
            ("--node 1:toaster", "it has: pressure"),
            ("--bitrate 251", "250"),
            ("--for -1", "-1"),
            ("--for x", "not a number of seconds"),
            ("--socketcand nowhere", "nowhere"),
            ("--load 101", "101"),
            ("--reflash", "--flash"),
            ("--temperature const:25", "temperatures are in K"),
            ("--pressure 1=nonsense", "nonsense"),
            ("--oscillator 1=30000", "20000 ppm"),
            ("--lsi 10000", "17000 to 47000 Hz"),
            ("--speed warp", "real, max"),
            ("--threads 0", "--threads"),
            ("--wings", "--wings"),
        ];
        for (flags, reason) in wrong {
            let message = read(flags).unwrap_err();
            assert!(message.starts_with("error: ") && message.contains(reason), "{flags}: {message}");
            assert!(!message.contains('\n'));
        }
    }
}
