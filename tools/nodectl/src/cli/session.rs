//! The state that all commands share: the bus, and the catalogues of the nodes.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;

use canopen::nmt::State;
use canopen::sdo::Multiplexer;
use canopen::{Duration, Instant, NodeId};
use eds::Eds;
use indicatif::ProgressBar;
use serde::Serialize;

use super::sheets::{Device, Sheets, misfit};
use super::{Failure, Options, Output};
use crate::bus::NoBus;
use crate::configuration::Configuration;
use crate::network::Heard;
use crate::object::at;
use crate::sdo::{self, Cause, Channel, Client};
use crate::text::{note, visible_lines};
use crate::value;
use crate::{Catalogue, Network, heartbeat, update};

/// The greatest size of a data sheet in bytes. The data sheets of the largest devices have a quarter of this size.
const LARGEST_SHEET: u64 = 4 << 20;

/// How many mistakes of a data sheet are printed.
const WARNINGS: usize = 5;

/// How long to listen before the first request. The frames of a running transfer come more often.
const LISTEN: Duration = Duration::from_millis(50);

/// A client counts as present for this time after its last request.
const RECENT: Duration = Duration::from_millis(5000);

/// A factor on the time limit for reading a whole dictionary. A slow bus needs 20 s for 400 objects; this limit is
/// three times as long.
const MANY: u64 = 6;

/// An open bus, and the catalogues of the nodes on it.
pub struct Session {
    pub(super) network: Network,
    pub(super) options: Options,
    pub(super) output: Output,
    /// The data sheets of the options, once they have been read.
    sheets: Option<Sheets>,
    /// Whether a data sheet is used only for a node whose identity it has: there are many nodes, of which the user has
    /// named none.
    pub(super) has_many_nodes: bool,
    catalogues: BTreeMap<NodeId, Arc<Catalogue>>,
    /// The devices whose identity was read.
    devices: BTreeMap<NodeId, Device>,
    /// The deadline of all transfers that belong together.
    deadline: Instant,
}

impl Session {
    /// Opens the bus of the options.
    ///
    /// # Errors
    /// The bus cannot be opened.
    pub fn open(options: &Options, output: Output) -> Result<Session, Failure> {
        // Read the data sheet first, so that a wrong one is reported before the bus is opened.
        let sheets = Some(Sheets::read(options.eds.as_deref())?);
        let (address, bit_rate) = (options.bus.clone(), options.bit_rate());
        let mut network = Network::open(move || address.open(bit_rate))?;
        // Another client's transfer may run already.
        network.pause(LISTEN)?;
        Ok(Session { sheets, ..Session::with(network, options, output) })
    }

    /// A session without a bus, for a command that works on files.
    ///
    /// # Errors
    /// The data sheet of the options cannot be used.
    pub fn without_a_bus(options: &Options, output: Output) -> Result<Session, Failure> {
        let sheets = Some(Sheets::read(options.eds.as_deref())?);
        let network = Network::open(|| Ok(Box::new(NoBus)))?;
        Ok(Session { sheets, ..Session::with(network, options, output) })
    }

    /// A session on an open bus.
    #[must_use]
    pub fn with(network: Network, options: &Options, output: Output) -> Session {
        Session {
            network,
            options: options.clone(),
            output,
            sheets: None,
            has_many_nodes: false,
            catalogues: BTreeMap::new(),
            devices: BTreeMap::new(),
            deadline: Instant::NEVER,
        }
    }

    /// The client of a node.
    pub(super) fn client(&mut self, node: NodeId) -> Client<'_> {
        let deadline = self.deadline;
        Client::new(&mut self.network, node, self.options.sdo()).by(deadline)
    }

    /// Starts a group of transfers with one node, which together have the time limit of one transfer. So a node that
    /// answers slowly on purpose cannot hold up the command longer, whatever the number of objects.
    pub(super) fn begin(&mut self) {
        self.deadline = self.network.own_time() + self.options.sdo().limit;
    }

    /// Starts a group of transfers for all objects of a node, which together have the time limit of [`MANY`] transfers.
    pub(super) fn begin_all(&mut self) {
        let limit = Duration(self.options.sdo().limit.0.saturating_mul(MANY));
        self.deadline = self.network.own_time() + limit;
    }

    /// The data sheets of the options.
    pub(super) fn sheets(&mut self) -> Result<&Sheets, Failure> {
        if self.sheets.is_none() {
            self.sheets = Some(Sheets::read(self.options.eds.as_deref())?);
        }
        Ok(self.sheets.get_or_insert_default())
    }

    /// The catalogue of a node: the data sheet of the options, else the built-in data sheet for its identity.
    pub(super) fn catalogue(&mut self, node: NodeId) -> Result<Arc<Catalogue>, Failure> {
        if let Some(known) = self.catalogues.get(&node) {
            return Ok(Arc::clone(known));
        }
        let device = self.device(node)?;
        let catalogue = self.catalogue_of(node, device)?;
        self.choose_channel(node, &catalogue)?;
        Ok(Arc::clone(self.catalogues.entry(node).or_insert(Arc::new(catalogue))))
    }

    /// Uses the second SDO server of a node (1201h) where the node has one that is switched on: the first one may have
    /// another client.
    fn choose_channel(&mut self, node: NodeId, catalogue: &Catalogue) -> Result<(), Failure> {
        let [request, response] = [at(0x1201, 1), at(0x1201, 2)];
        if catalogue.entry(request).is_none() {
            return Ok(());
        }
        let cob_ids = self.word(node, request)?.zip(self.word(node, response)?);
        let channel = cob_ids.and_then(|(request, response)| Channel::of_cob_ids(request, response));
        self.network.set_channel(node, channel);
        Ok(())
    }

    /// Whether the catalogue of a node is known already.
    pub(super) fn knows(&self, node: NodeId) -> bool {
        self.catalogues.contains_key(&node)
    }

    /// Sets the catalogue of a node.
    pub(super) fn know(&mut self, node: NodeId, catalogue: Arc<Catalogue>) {
        self.catalogues.insert(node, catalogue);
    }

    /// The data sheet of a node; an error where none is known.
    pub(super) fn sheet_of(&mut self, node: NodeId) -> Result<Eds, Failure> {
        let catalogue = self.catalogue(node)?;
        if !catalogue.is_of_a_device() {
            let node = node.get();
            return Err(Failure::Usage(format!(
                "no data sheet is known for node {node}: give it with --eds"
            )));
        }
        Ok(catalogue.sheet().clone())
    }

    /// The values of all parameters of a node.
    pub(super) fn configuration(&mut self, node: NodeId, sheet: &Eds) -> Result<Configuration, Failure> {
        let bar = ProgressBar::new(0).with_message(format!("reading node {}", node.get()));
        let values = self.configuration_with(node, sheet, |done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        });
        bar.finish_and_clear();
        values
    }

    /// The values of all parameters of a node. `progress` is called with the number of parameters read and the total.
    pub(super) fn configuration_with(
        &mut self,
        node: NodeId,
        sheet: &Eds,
        progress: impl FnMut(usize, usize),
    ) -> Result<Configuration, Failure> {
        self.catalogue(node)?;
        self.begin_all();
        let values = Configuration::of_node(|at| self.client(node).upload(at), sheet, progress);
        values.map_err(|error| self.named(error))
    }

    /// Vendor-ID and product code of a node. They are read once.
    pub(super) fn device(&mut self, node: NodeId) -> Result<Device, Failure> {
        if let Some(device) = self.devices.get(&node) {
            return Ok(*device);
        }
        let device = (self.word(node, at(0x1018, 1))?, self.word(node, at(0x1018, 2))?);
        Ok(*self.devices.entry(node).or_insert(device))
    }

    /// Forgets the identity and the catalogue of a node: another device may have its node-ID.
    pub(super) fn forget(&mut self, node: NodeId) {
        self.devices.remove(&node);
        self.catalogues.remove(&node);
    }

    /// The catalogue of a node with this identity. A file that the user has named for one node is used for it, and the
    /// user is warned when it is for another device.
    pub(super) fn catalogue_of(&mut self, node: NodeId, device: Device) -> Result<Catalogue, Failure> {
        let is_for_all = !self.has_many_nodes;
        let sheets = self.sheets()?;
        if let Some(sheet) = sheets.of(device) {
            return Ok(Catalogue::new(sheet.clone()));
        }
        if let Some(sheet) = sheets.file().filter(|_| is_for_all) {
            note(format_args!("node {}: {}", node.get(), misfit(sheet, device)));
            return Ok(Catalogue::new(sheet.clone()));
        }
        let built_in =
            device.0.zip(device.1).and_then(|(vendor, product)| Catalogue::built_in(vendor, product));
        Ok(built_in.unwrap_or_else(Catalogue::unknown))
    }

    /// The value of an UNSIGNED32 object; `None` where the node has no such object.
    pub(super) fn word(&mut self, node: NodeId, at: Multiplexer) -> Result<Option<u32>, Failure> {
        Ok(self.optional(node, at)?.and_then(|bytes| bytes.try_into().ok()).map(u32::from_le_bytes))
    }

    /// The value of a VISIBLE_STRING object; `None` where the node has no such object.
    pub(super) fn text(&mut self, node: NodeId, index: u16) -> Result<Option<String>, Failure> {
        Ok(self.optional(node, at(index, 0))?.map(|bytes| value::text(&bytes)))
    }

    /// The bytes of an object; `None` where the node does not have the object, or does not let us read it.
    pub(super) fn optional(&mut self, node: NodeId, at: Multiplexer) -> Result<Option<Vec<u8>>, Failure> {
        match self.client(node).upload(at) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.abort().is_some() => Ok(None),
            Err(error) => Err(self.named(error)),
        }
    }

    /// The object that a person means.
    pub(super) fn find(&mut self, node: NodeId, query: &str) -> Result<Multiplexer, Failure> {
        let found = self.catalogue(node)?.find(query);
        found.map_err(|error| Failure::Usage(error.to_string()))
    }

    /// The failure of a transfer, with the name of the object and a hint.
    pub(super) fn named(&self, error: sdo::Error) -> Failure {
        self.explained(error).into()
    }

    /// The error of a transfer, with the name of the object and a hint.
    pub(super) fn explained(&self, error: sdo::Error) -> sdo::Error {
        let name = self.catalogues.get(&error.node).and_then(|catalogue| catalogue.name(error.at));
        let hint = self.hint(&error);
        sdo::Error { name: error.name.clone().or(name), hint, ..error }
    }

    /// The error of an update, with a hint where it is that of a transfer.
    pub(super) fn explained_update(&self, error: update::Error) -> update::Error {
        match error {
            update::Error::Sdo(error) | update::Error::Mixed(error) => self.explained(error).into(),
            other => other,
        }
    }

    /// A hint for the user on an error.
    fn hint(&self, error: &sdo::Error) -> Option<String> {
        if matches!(error.cause, Cause::Bus(_)) {
            return self.options.bus.lost_hint();
        }
        if error.is_silence() {
            return Some(self.silence(error.node));
        }
        let code = error.abort()?.0;
        let catalogue = self.catalogues.get(&error.node);
        match (code, error.at.index) {
            (0x0609_0030, 0x1800..=0x19FF) if error.at.sub == 3 => Some(format!(
                "the inhibit time is changed while the PDO is switched off (bit 31 of {:04X}h:1)",
                error.at.index
            )),
            (0x0609_0030..=0x0609_0032, _) => {
                catalogue?.range(error.at, error.node).map(|range| format!("it takes {range}"))
            }
            (0x0601_0000 | 0x0800_0022, 0x1400..=0x1BFF) => {
                let communication = error.at.index & !0x0200;
                Some(format!(
                    "a PDO is changed while it is switched off (bit 31 of {communication:04X}h:1) and its mapping is \
                     empty (sub-index 0 is 0)"
                ))
            }
            (0x0800_0022, 0x6125 | 0x6925 | 0x6139 | 0x6939) => {
                let status = 0x6150 | (error.at.index & 0x0800);
                Some(format!(
                    "the process value is not valid (see the status, {status:04X}h:{}), or a parameter of its samples has \
                     changed within 3 ms: repeat",
                    error.at.sub
                ))
            }
            (0x0800_0022, 0x2200..=0x2202) if catalogue?.is_of_this_project() => Some(
                "the calibration is locked; `nodectl write 2203 cali` opens it until the next reset"
                    .to_owned(),
            ),
            (0x0800_0022, 0x2107) if catalogue?.is_of_this_project() => Some(
                "the factory data are locked; `nodectl write 2108 fact` opens them until the next reset"
                    .to_owned(),
            ),
            (0x0609_0011, 0x1010 | 0x1011) => Some("the node has no such group of parameters".to_owned()),
            _ => None,
        }
    }

    /// Whether another client uses the SDO server of a node.
    pub(super) fn has_other_client(&self, node: NodeId) -> bool {
        let since = Instant(self.network.now().0.saturating_sub(RECENT.0));
        self.network.has_other_request_since(node, since)
    }

    /// Why a node may not answer, and what the user can do.
    pub(super) fn silence(&self, node: NodeId) -> String {
        if self.has_other_client(node) {
            return "another client uses the SDO server of the node: try again when it has finished"
                .to_owned();
        }
        silence(node, self.network.heard(node))
    }

    /// Prints a failure that does not end the command.
    pub(super) fn tell(&mut self, failure: &Failure) -> Result<(), Failure> {
        if self.options.json {
            return Ok(self.output.json(&failure.to_json())?);
        }
        note(format_args!("nodectl: {}", visible_lines(&failure.to_string())));
        Ok(())
    }

    /// Prints a result.
    pub(super) fn print(&mut self, result: &(impl Serialize + Display)) -> Result<(), Failure> {
        Ok(self.output.print(result)?)
    }
}

/// Why a node may not answer, and what the user can do.
fn silence(node: NodeId, heard: Option<Heard>) -> String {
    let node = node.get();
    match heard {
        Some(Heard { state: Some(State::Stopped), .. }) => {
            format!(
                "the node is stopped and answers no request: `nodectl --node {node} nmt preop` ends this state"
            )
        }
        Some(Heard { state, .. }) => {
            let state =
                state.map(|state| format!(" (it is {})", heartbeat::words(state))).unwrap_or_default();
            format!(
                "the node sends{state} and does not answer. A node that has just started answers the next request. Or its \
                 PDOs leave no room on the bus: `nodectl --node {node} nmt preop` ends them, then longer event timers and \
                 inhibit times help (1800h:5, 1800h:3)"
            )
        }
        None => format!(
            "node {node} is silent: is it on, with this node-ID and the bit rate of the bus? `nodectl scan` \
             lists the nodes, `nodectl lss scan` those without a node-ID"
        ),
    }
}

/// A data sheet or a configuration file.
pub(super) fn sheet(path: &Path) -> Result<Eds, Failure> {
    let bytes = wire::input::read(path, LARGEST_SHEET).map_err(|error| match error.kind() {
        ErrorKind::FileTooLarge => Failure::file(path, "it is larger than any data sheet (4 MiB)"),
        _ => Failure::file(path, error),
    })?;
    let sheet = Eds::from_bytes(&bytes).map_err(|error| Failure::file(path, error))?;
    if sheet.objects.is_empty() {
        return Err(Failure::file(path, "it is no data sheet: there is no object in it"));
    }
    warn(path, &sheet);
    Ok(sheet)
}

/// Why the values of a file cannot all be written: a part of it is missing, or a value cannot be read.
pub(super) fn loss(sheet: &Eds) -> Option<String> {
    let loss = sheet.warnings.iter().find(|warning| warning.is_loss())?;
    Some(format!("nothing was written: {}", visible_lines(&loss.to_string())))
}

/// A configuration file whose values can all be written.
pub(super) fn whole(path: &Path) -> Result<Eds, Failure> {
    let sheet = sheet(path)?;
    loss(&sheet).map_or(Ok(sheet), |words| Err(Failure::file(path, words)))
}

/// Prints the first mistakes of a data sheet.
fn warn(path: &Path, sheet: &Eds) {
    for warning in sheet.warnings.iter().take(WARNINGS) {
        note(format_args!("warning: {}: {}", path.display(), visible_lines(&warning.to_string())));
    }
    let more = sheet.warnings.len().saturating_sub(WARNINGS);
    if more > 0 {
        note(format_args!("warning: {}: and {more} more", path.display()));
    }
}
