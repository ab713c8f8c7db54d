//! Live values of a node: from TPDOs where a TPDO carries the object, else by periodic SDO reads.

use std::collections::VecDeque;

use canopen::emcy::Message;
use canopen::nmt::{Command, State};
use canopen::sdo::Multiplexer;
use canopen::{Duration, Instant, NodeId};
use eds::{Class, DataType};
use thiserror::Error;

use crate::bus::{BusError, Received};
use crate::heartbeat::{self, Heartbeat};
use crate::object::at;
use crate::quantity::Quantity;
use crate::sdo::{self, Client, Options};
use crate::tpdo::{self, Tpdo};
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

/// An acquisition under way.
pub struct Acquisition<'n> {
    network: &'n mut Network,
    setup: Setup,
    tpdos: Vec<Tpdo>,
    signals: Vec<Signal>,
    ready: VecDeque<Sample>,
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
        catalogue: &Catalogue,
        objects: &[Multiplexer],
    ) -> Result<Acquisition<'n>, Interruption> {
        let deadline = network.own_time() + setup.options.limit;
        let mut client = Client::new(network, setup.node, setup.options).by(deadline);
        let (tpdos, signals) = survey(&mut client, catalogue, objects)?;
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
            ready: VecDeque::new(),
            due,
            state: None,
            emergency: None,
            is_own: catalogue.is_of_this_project(),
            frames: 0,
            has_values: false,
        })
    }

    /// The signals that are followed.
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
        let has_polled = self.signals.iter().any(|signal| signal.tpdo.is_none());
        while self.ready.is_empty() {
            if has_polled && self.network.now() >= self.due {
                self.poll()?;
                continue;
            }
            let wake = if has_polled { until.min(self.due) } else { until };
            match self.network.receive(wake)? {
                Some(received) => self.take(&received),
                None if self.network.now() >= until => break,
                None => (),
            }
        }
        self.has_values |= !self.ready.is_empty();
        Ok(self.ready.pop_front())
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
        }
        for tpdo in self.tpdos.iter().filter(|tpdo| tpdo.id == frame.id()) {
            for (at, bytes) in tpdo.values(frame.data()) {
                let is_it = |signal: &Signal| signal.at == at && signal.tpdo == Some(tpdo.number);
                let Some(signal) = self.signals.iter().position(is_it) else { continue };
                let value = self.signals[signal].decode(&bytes);
                self.ready.push_back(Sample { at: received.at, signal, value });
            }
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
            let value = signal.decode(&bytes);
            // The answer is the newest frame. The frames before it are taken first, so that times do not go backwards.
            let at = self.network.newest_stamp().unwrap_or(self.network.now());
            while let Some(received) = self.network.take_kept() {
                self.take(&received);
            }
            self.ready.push_back(Sample { at, signal: number, value });
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
    catalogue: &Catalogue,
    objects: &[Multiplexer],
) -> Result<(Vec<Tpdo>, Vec<Signal>), sdo::Error> {
    let tpdos = tpdo::read(client, catalogue)?;
    let objects = if objects.is_empty() { mapped(&tpdos) } else { objects.to_vec() };
    let mut signals = Vec::new();
    for at in objects {
        signals.push(signal(client, catalogue, &tpdos, at)?);
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

fn signal(
    client: &mut Client,
    catalogue: &Catalogue,
    tpdos: &[Tpdo],
    at: Multiplexer,
) -> Result<Signal, sdo::Error> {
    let is_in =
        |tpdo: &&Tpdo| tpdo.mapping.iter().any(|mapped| (mapped.index, mapped.sub) == (at.index, at.sub));
    let quantity = Quantity::of(client, catalogue, at)?;
    Ok(Signal {
        at,
        name: catalogue.entry(at).map(|entry| entry.name.clone()).unwrap_or_default(),
        path: catalogue.name(at),
        unit: quantity.unit.clone(),
        tpdo: tpdos.iter().find(is_in).map(|tpdo| tpdo.number),
        data_type: catalogue.data_type(at),
        quantity,
    })
}
