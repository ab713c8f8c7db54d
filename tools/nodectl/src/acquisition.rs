//! Live values of a node: from TPDOs where a TPDO carries the object, else by periodic SDO reads.

use std::collections::VecDeque;
use std::sync::Arc;

use canopen::emcy::Message;
use canopen::nmt::{Command, State};
use canopen::sdo::Multiplexer;
use canopen::{Duration, Frame, Instant, NodeId};
use eds::{Class, DataType};
use thiserror::Error;

use crate::bus::{BusError, Received};
use crate::heartbeat::{self, Heartbeat};
use crate::object::at;
use crate::quantity::Quantity;
use crate::sdo::{self, Client, Options};
use crate::tpdo::{self, Tpdo};
use crate::trace::{Knowledge, Transfers};
use crate::value::{Value, guess};
use crate::{Catalogue, Network, meaning, nmt};

/// An object whose value is followed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signal {
    /// The object.
    pub at: Multiplexer,
    /// The name of the object; empty where none is known.
    pub name: String,
    /// The name of the object with the name of its record; `None` where none is known.
    pub path: Option<String>,
    /// The unit; empty where none is known.
    pub unit: String,
    /// The number of the TPDO that carries the object, from 1; `None` for an object that is read by SDO.
    pub tpdo: Option<u16>,
    data_type: Option<DataType>,
    quantity: Quantity,
}

/// A value and its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Time of the frame on the bus, by the clock of the adapter where it has one. Only differences have a meaning.
    pub at: Instant,
    /// The position of the signal in [`Acquisition::signals`].
    pub signal: usize,
    /// The value.
    pub value: Value,
}

/// The kind of values of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Integers of up to 64 bits with a sign.
    Signed,
    /// Integers of up to 64 bits without a sign; BOOLEAN is 0 or 1.
    Unsigned,
    /// Numbers with a fraction: of a REAL type, or integers with decimal digits or a measuring step.
    Number,
    /// Texts, bytes, and values of an unknown type.
    Text,
}

/// Settings of an acquisition.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// The node whose values are acquired.
    pub node: NodeId,
    /// Time-outs and retries of the transfers.
    pub options: Options,
    /// Period of reading the objects that no TPDO carries.
    pub period: Duration,
    /// Whether to start the node after its PDO parameters are read: TPDOs are sent in the state Operational only.
    pub start: bool,
}

/// Why an acquisition ends.
#[derive(Debug, Error)]
pub enum Interruption {
    /// A value could not be read.
    #[error(transparent)]
    Sdo(#[from] sdo::Error),
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
}

/// Mapping and units are read again this long after a boot-up of the node, or after the last write to its PDO
/// parameters: a master configures the node first.
const SETTLED: Duration = Duration::from_millis(500);
/// The time between two tries to read mapping and units.
const AGAIN: Duration = Duration::from_millis(1000);

/// The content of the frames, in their order.
enum News {
    /// The bytes of a signal.
    Value { at: Instant, signal: usize, bytes: Vec<u8> },
    /// The bytes of an object that a client has read or written.
    Told { object: Multiplexer, bytes: Vec<u8> },
}

/// An acquisition under way.
pub struct Acquisition<'n> {
    network: &'n mut Network,
    setup: Setup,
    tpdos: Vec<Tpdo>,
    signals: Vec<Signal>,
    /// The numbers that the units of the signals depend on.
    knowledge: Knowledge,
    /// The transfers of other clients: on the default channel, and on the additional one.
    transfers: [Transfers; 2],
    news: VecDeque<News>,
    /// When the mapping and the numbers for the units are read again; `None` while they are known.
    refresh: Option<Instant>,
    /// When the polled signals are read next.
    due: Instant,
    /// The NMT state of the node, once a heartbeat has told it.
    state: Option<State>,
    /// The newest emergency of the node, in words.
    emergency: Option<String>,
    /// Whether the node is one of this project, whose errors have names of their own.
    is_own: bool,
    /// The number of frames of all nodes.
    frames: u64,
    /// Whether a value has come.
    has_values: bool,
}

impl<'n> Acquisition<'n> {
    /// Follows these objects; without objects, all objects in TPDOs.
    ///
    /// # Errors
    /// SDO errors, and a bus that is lost.
    pub fn open(
        network: &'n mut Network,
        setup: Setup,
        catalogue: &Arc<Catalogue>,
        objects: &[Multiplexer],
    ) -> Result<Acquisition<'n>, Interruption> {
        let deadline = network.own_time() + setup.options.limit;
        let mut client = Client::new(network, setup.node, setup.options).by(deadline);
        let mut knowledge = Knowledge::new(Arc::clone(catalogue));
        let (tpdos, signals) = survey_with(&mut client, &mut knowledge, objects)?;
        network.forget();
        if setup.start {
            nmt::send(network, Command::Start, Some(setup.node))?;
        }
        let due = network.now();
        Ok(Acquisition {
            network,
            setup,
            tpdos,
            signals,
            knowledge,
            transfers: Default::default(),
            news: VecDeque::new(),
            refresh: None,
            due,
            state: None,
            emergency: None,
            is_own: catalogue.is_of_this_project(),
            frames: 0,
            has_values: false,
        })
    }

    /// The signals that are followed, with the units of the newest sample.
    #[must_use]
    pub fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// A reason why values are missing: the node sends no TPDOs in its state. `None` where no reason is known.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        let state = self.state.filter(|state| !state.has_pdos())?;
        let has_mapped = self.signals.iter().any(|signal| signal.tpdo.is_some());
        let (node, state) = (self.setup.node.get(), heartbeat::words(state));
        has_mapped.then(|| format!("node {node} is {state} and sends no TPDOs; --start starts it"))
    }

    /// The TPDOs that are awaited: `waiting for TPDO 1 (181h), TPDO 2 (281h) of node 1`. `None` once a value has come.
    #[must_use]
    pub fn awaited(&self) -> Option<String> {
        let is_followed = |tpdo: &&Tpdo| self.signals.iter().any(|signal| signal.tpdo == Some(tpdo.number));
        let tpdos = self.tpdos.iter().filter(is_followed);
        let names: Vec<String> =
            tpdos.map(|tpdo| format!("TPDO {} ({:03X}h)", tpdo.number, tpdo.id)).collect();
        let node = self.setup.node.get();
        let text = match names[..] {
            [] => format!("node {node} has no TPDO that is switched on and maps a value"),
            _ => format!("waiting for {} of node {node}", names.join(", ")),
        };
        (!self.has_values).then_some(text)
    }

    /// The node that is followed.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.setup.node
    }

    /// The NMT state of the node; `None` before its first heartbeat.
    #[must_use]
    pub fn state(&self) -> Option<State> {
        self.state
    }

    /// The newest emergency of the node, in words; `None` before the first.
    #[must_use]
    pub fn emergency(&self) -> Option<&str> {
        self.emergency.as_deref()
    }

    /// The number of frames heard from all nodes.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The time of this computer, for [`next`](Acquisition::next).
    #[must_use]
    pub fn now(&self) -> Instant {
        self.network.now()
    }

    /// The time on the bus, the same as in samples. `None` before the first frame.
    #[must_use]
    pub fn bus_time(&self) -> Option<Instant> {
        self.network.bus_time()
    }

    /// The next sample; `None` when none has come until then.
    ///
    /// # Errors
    /// SDO errors, and a bus that is lost.
    pub fn next(&mut self, until: Instant) -> Result<Option<Sample>, Interruption> {
        loop {
            if let Some(sample) = self.ready() {
                self.has_values = true;
                return Ok(Some(sample));
            }
            let now = self.network.now();
            if self.refresh.is_some_and(|due| now >= due) {
                self.read_again()?;
                continue;
            }
            let has_polled = self.signals.iter().any(|signal| signal.tpdo.is_none());
            if has_polled && now >= self.due {
                self.poll()?;
                continue;
            }
            let wake = until.min(self.refresh.unwrap_or(Instant::NEVER));
            let wake = if has_polled { wake.min(self.due) } else { wake };
            match self.network.receive(wake)? {
                Some(received) => self.take(&received),
                None if self.network.now() >= until => return Ok(None),
                None => (),
            }
        }
    }

    /// The next sample of the frames that were taken, in the unit that was valid before it.
    fn ready(&mut self) -> Option<Sample> {
        loop {
            match self.news.pop_front()? {
                News::Told { object, bytes } => self.hear(object, &bytes),
                News::Value { at, signal, bytes } => {
                    let value = self.signals[signal].decode(&bytes);
                    return Some(Sample { at, signal, value });
                }
            }
        }
    }

    /// The objects that the units of the signals depend on.
    fn sources(&self) -> Vec<Multiplexer> {
        let catalogue = self.knowledge.catalogue();
        self.signals.iter().flat_map(|signal| Quantity::sources(catalogue, signal.at)).collect()
    }

    /// Takes a number that the node has told or taken. Units that depend on it change.
    fn hear(&mut self, object: Multiplexer, bytes: &[u8]) {
        if !self.sources().contains(&object) {
            return;
        }
        self.knowledge.tell(object, bytes);
        for signal in &mut self.signals {
            if let Some(quantity) = self.knowledge.measured(signal.at) {
                signal.measure(quantity);
            }
        }
    }

    /// Reads the mapping and the numbers for the units again: values that are not saved are lost with a restart. While
    /// another client keeps the node from answering, the next try is later.
    fn read_again(&mut self) -> Result<(), sdo::Error> {
        self.refresh = None;
        match self.read_mapping().and_then(|()| self.read_units()) {
            Err(error) if error.may_pass() && !error.is_bus_lost() => {
                self.refresh = Some(self.network.now() + AGAIN);
                Ok(())
            }
            result => result,
        }
    }

    /// A signal that no TPDO carries any more is read by SDO.
    fn read_mapping(&mut self) -> Result<(), sdo::Error> {
        let mut client = Client::new(self.network, self.setup.node, self.setup.options);
        self.tpdos = tpdo::read(&mut client, self.knowledge.catalogue())?;
        for signal in &mut self.signals {
            signal.tpdo = carrier(&self.tpdos, signal.at);
        }
        Ok(())
    }

    fn read_units(&mut self) -> Result<(), sdo::Error> {
        let mut sources = self.sources();
        sources.dedup();
        for object in sources {
            match Client::new(self.network, self.setup.node, self.setup.options).upload(object) {
                Ok(bytes) => self.hear(object, &bytes),
                Err(error) if error.abort().is_some() && !error.may_pass() => (),
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Takes the values out of a frame.
    fn take(&mut self, received: &Received) {
        let frame = &received.frame;
        self.frames += 1;
        if frame.id() == 0x80 + u16::from(self.setup.node.get())
            && let Ok(data) = frame.data().try_into()
        {
            self.emergency = Some(meaning::emergency(Message::parse(data), self.is_own));
        }
        if let Some(heard) = Heartbeat::parse(frame).filter(|heard| heard.node == self.setup.node) {
            self.state = Some(heard.state);
            if heard.state == State::Initialising {
                self.refresh = Some(self.network.now() + SETTLED);
            }
        }
        if let Some((node, is_additional, frame)) = self.network.sdo(frame)
            && node == self.setup.node
        {
            self.overhear(is_additional, &frame, received.at);
        }
        for tpdo in self.tpdos.iter().filter(|tpdo| tpdo.id == frame.id()) {
            for (at, bytes) in tpdo.values(frame.data()) {
                let is_it = |signal: &Signal| signal.at == at && signal.tpdo == Some(tpdo.number);
                let Some(signal) = self.signals.iter().position(is_it) else { continue };
                self.news.push_back(News::Value { at: received.at, signal, bytes });
            }
        }
    }

    /// Takes an SDO frame of another client, or an answer.
    fn overhear(&mut self, is_additional: bool, frame: &Frame, at: Instant) {
        let transfers = &mut self.transfers[usize::from(is_additional)];
        for ended in transfers.on_frame(self.setup.node, frame, at) {
            let Some(bytes) = ended.value() else { continue };
            if let Some(tpdo) = remapped(ended.at).filter(|_| ended.is_write) {
                self.tpdos.retain(|known| known.number != tpdo);
                self.refresh = Some(self.network.now() + SETTLED);
            }
            self.news.push_back(News::Told { object: ended.at, bytes: bytes.to_vec() });
        }
    }

    /// Reads all signals that no TPDO carries.
    fn poll(&mut self) -> Result<(), sdo::Error> {
        // On a slow bus the period becomes longer; readings do not pile up.
        self.due = self.network.now().max(self.due) + self.setup.period;
        for number in 0..self.signals.len() {
            let signal = &self.signals[number];
            if signal.tpdo.is_some() {
                continue;
            }
            let bytes = Client::new(self.network, self.setup.node, self.setup.options).upload(signal.at)?;
            // The answer is the newest frame. The frames before it are taken first, so that times do not go backwards.
            let at = self.network.newest_stamp().unwrap_or(self.network.now());
            while let Some(received) = self.network.take_kept() {
                self.take(&received);
            }
            self.news.push_back(News::Value { at, signal: number, bytes });
        }
        Ok(())
    }
}

impl Signal {
    /// A signal that is read by SDO.
    #[must_use]
    pub fn polled(at: Multiplexer, name: &str, unit: &str) -> Signal {
        let quantity = Quantity::plain(unit);
        let path = Some(name.to_owned()).filter(|name| !name.is_empty());
        Signal {
            at,
            name: name.to_owned(),
            path,
            unit: unit.to_owned(),
            tpdo: None,
            data_type: None,
            quantity,
        }
    }

    /// A signal that is read by SDO, with the name of its data sheet.
    pub(crate) fn read(at: Multiplexer, catalogue: &Catalogue) -> Signal {
        let name = catalogue.entry(at).map(|entry| entry.name.clone()).unwrap_or_default();
        // The address of the object with the unit is no unit.
        let unit = Some(catalogue.unit(at)).filter(|unit| eds::address(unit).is_none());
        let signal = Signal::polled(at, &name, unit.unwrap_or_default());
        Signal { path: catalogue.name(at), data_type: catalogue.data_type(at), ..signal }
    }

    /// Sets the unit and the scale. Returns whether they are new.
    pub(crate) fn measure(&mut self, quantity: Quantity) -> bool {
        let is_new = self.quantity != quantity;
        self.unit.clone_from(&quantity.unit);
        self.quantity = quantity;
        is_new
    }

    /// The name of the data type; empty where none is known.
    #[must_use]
    pub fn type_name(&self) -> String {
        self.data_type.map(|data_type| data_type.to_string()).unwrap_or_default()
    }

    /// The name of the data type; where none is known, a name for the bytes of the value.
    #[must_use]
    pub fn data_type(&self, value: &Value) -> String {
        let guessed = || match value {
            Value::Bytes(_) => DataType::DOMAIN,
            _ => DataType(0x07),
        };
        self.data_type.unwrap_or_else(guessed).to_string()
    }

    /// The kind of values.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self.data_type.map(DataType::class) {
            Some(Class::Signed(_) | Class::Unsigned(_)) if self.quantity.is_scaled() => Kind::Number,
            Some(Class::Signed(_)) => Kind::Signed,
            Some(Class::Unsigned(_)) => Kind::Unsigned,
            Some(Class::Real(_)) => Kind::Number,
            Some(Class::Text | Class::Bytes) | None => Kind::Text,
        }
    }

    /// The value in these bytes.
    pub(crate) fn decode(&self, bytes: &[u8]) -> Value {
        self.quantity.apply(Value::decode(bytes, self.data_type.unwrap_or_else(|| guess(bytes))))
    }
}

/// The TPDOs of a node, and these objects as signals. Without objects, all objects in TPDOs become signals.
///
/// # Errors
/// SDO errors.
pub fn survey(
    client: &mut Client,
    catalogue: &Arc<Catalogue>,
    objects: &[Multiplexer],
) -> Result<(Vec<Tpdo>, Vec<Signal>), sdo::Error> {
    survey_with(client, &mut Knowledge::new(Arc::clone(catalogue)), objects)
}

/// The same; the numbers that the units depend on are kept.
fn survey_with(
    client: &mut Client,
    knowledge: &mut Knowledge,
    objects: &[Multiplexer],
) -> Result<(Vec<Tpdo>, Vec<Signal>), sdo::Error> {
    let tpdos = tpdo::read(client, knowledge.catalogue())?;
    let objects = if objects.is_empty() { mapped(&tpdos) } else { objects.to_vec() };
    let mut signals = Vec::new();
    for at in objects {
        signals.push(signal(client, knowledge, &tpdos, at)?);
    }
    Ok((tpdos, signals))
}

/// The objects in TPDOs, each once. Indices below 1000h are data types: they fill a gap in a PDO.
fn mapped(tpdos: &[Tpdo]) -> Vec<Multiplexer> {
    let mut objects = Vec::new();
    for mapped in tpdos.iter().flat_map(|tpdo| &tpdo.mapping).filter(|mapped| mapped.index >= 0x1000) {
        let object = at(mapped.index, mapped.sub);
        if !objects.contains(&object) {
            objects.push(object);
        }
    }
    objects
}

/// The number of the TPDO, from 1, whose CAN-ID or mapping an object is. CiA 301: 1800h to 19FFh, 1A00h to 1BFFh.
fn remapped(object: Multiplexer) -> Option<u16> {
    match (object.index, object.sub) {
        (0x1800..=0x19FF, 1) | (0x1A00..=0x1BFF, _) => Some((object.index & 0x1FF) + 1),
        _ => None,
    }
}

/// The number of the TPDO that carries an object.
fn carrier(tpdos: &[Tpdo], object: Multiplexer) -> Option<u16> {
    let is_in = |tpdo: &&Tpdo| {
        tpdo.mapping.iter().any(|mapped| (mapped.index, mapped.sub) == (object.index, object.sub))
    };
    tpdos.iter().find(is_in).map(|tpdo| tpdo.number)
}

fn signal(
    client: &mut Client,
    knowledge: &mut Knowledge,
    tpdos: &[Tpdo],
    at: Multiplexer,
) -> Result<Signal, sdo::Error> {
    let quantity = knowledge.ask_quantity(client, at)?;
    let catalogue = knowledge.catalogue();
    Ok(Signal {
        at,
        name: catalogue.entry(at).map(|entry| entry.name.clone()).unwrap_or_default(),
        path: catalogue.name(at),
        unit: quantity.unit.clone(),
        tpdo: carrier(tpdos, at),
        data_type: catalogue.data_type(at),
        quantity,
    })
}
