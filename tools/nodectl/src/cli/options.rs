//! The options of every command.

use std::fs;
use std::path::PathBuf;

use canopen::Duration;
use clap::Args;
use wire::slcan::BIT_RATES;

use super::Failure;
use super::node_set::NodeSet;
use crate::bus::Address;
use crate::sdo;
use crate::update::AuthorisationKey;

/// The options of every command.
#[derive(Clone, Debug, Args)]
pub struct Options {
    /// The bus: socketcan:IFACE, socketcand://HOST:PORT/BUS, slcan:DEVICE or slcan://HOST:PORT.
    #[arg(long, global = true, env = "NODECTL_BUS", default_value = "socketcand://127.0.0.1:29536/vcan0")]
    pub bus: Address,

    /// Bit rate in kbit/s, for slcan adapters and for the files of `dump`. Without it, an slcan adapter gets 250.
    #[arg(long, global = true, env = "NODECTL_BIT_RATE", value_name = "KBIT/S", value_parser = parse_bit_rate)]
    pub bit_rate: Option<u16>,

    /// Node-ID, for read, update and info several (1,2,5-8), for nmt also "all".
    #[arg(long, short, global = true, env = "NODECTL_NODE", default_value = "1")]
    pub node: NodeSet,

    /// Data sheet of the node, or a folder of data sheets from which each node gets the one with its vendor-ID and product
    /// code; else the folder nodectl/eds in the configuration of the user, and the data sheets of this project.
    #[arg(long, global = true, env = "NODECTL_EDS", value_name = "FILE")]
    pub eds: Option<PathBuf>,

    /// Results as JSON: one value, or one a line where there are many.
    #[arg(long, global = true)]
    pub json: bool,

    /// How long a node may take to answer, in milliseconds. A block has 30 ms more for each of its segments.
    #[arg(long, global = true, value_name = "MS", default_value_t = 1000)]
    pub timeout: u32,

    /// How long a transfer may take in all, in seconds, whatever the node does.
    #[arg(long, global = true, value_name = "SECONDS", default_value_t = 10)]
    pub limit: u32,

    /// The number of retries of a transfer without an answer.
    #[arg(long, global = true, value_name = "N", default_value_t = 1)]
    pub retries: u8,

    /// File with the key that authorises updates, for nodes that demand one: 64 hexadecimal digits.
    #[arg(long, global = true, env = "NODECTL_AUTHORISATION_KEY", value_name = "FILE")]
    pub authorisation_key: Option<PathBuf>,
}

/// A bit rate of CANopen or of slcan.
pub(super) fn parse_bit_rate(text: &str) -> Result<u16, String> {
    let rate = text.trim().parse().ok().filter(|rate| BIT_RATES.contains(rate));
    rate.ok_or_else(|| format!("\"{text}\" is no bit rate of CAN in kbit/s, {BIT_RATES:?}"))
}

/// The bit rate of an slcan adapter without `--bit-rate`, in kbit/s.
const BIT_RATE: u16 = 250;

impl Options {
    /// The bit rate for an adapter and for numbers that need one, in kbit/s.
    pub(super) fn bit_rate(&self) -> u16 {
        self.bit_rate.unwrap_or(BIT_RATE)
    }

    /// The bit rate of the bus in kbit/s: that of the user, or that of the adapter. `None` where it is set elsewhere.
    pub(super) fn known_bit_rate(&self) -> Option<u16> {
        self.bit_rate.or_else(|| self.bus.needs_bit_rate().then_some(BIT_RATE))
    }

    /// The options of SDO transfers.
    pub(super) fn sdo(&self) -> sdo::Options {
        let limit = Duration::from_millis(u64::from(self.limit) * 1000);
        sdo::Options { timeout: self.timeout(), limit, retries: self.retries, ..sdo::Options::default() }
    }

    /// The key for nodes that change their program only for its holder.
    pub(super) fn authorisation_key(&self) -> Result<Option<AuthorisationKey>, Failure> {
        let Some(file) = &self.authorisation_key else { return Ok(None) };
        let text = fs::read_to_string(file).map_err(|error| Failure::file(file, error))?;
        text.parse().map(Some).map_err(|reason| Failure::file(file, reason))
    }

    /// How long to wait for an answer.
    pub(super) fn timeout(&self) -> Duration {
        Duration::from_millis(self.timeout.into())
    }
}
