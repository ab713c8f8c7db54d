//! Jobs: work that takes several frames. Each job runs on a thread of its own, with the same session as the commands of
//! the command line.

mod configuration;
mod lss;
mod objects;
mod overview;
mod pdo;
mod update;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::thread;

use canopen::NodeId;
use canopen::sdo::Multiplexer;
use serde_json::{Value as Json, json};

pub(super) use overview::{identify, scan};
pub(super) use pdo::{poll, survey};

use super::live::Survey;
use super::nodes::Identity;
use super::order::{Order, Refusal};
use super::port::{self, Interest};
use super::request::{What, Whom};
use super::schedule::Lane;
use super::stimuli;
use super::turn::Turn;
use crate::cli::store;
use crate::cli::{Failure, Options, Output, Session};
use crate::sdo::Channel;
use crate::{Catalogue, Network};

type Work = Box<dyn FnOnce(&mut Context) -> Result<Json, Failure> + Send>;

/// Work that takes several frames.
pub(super) struct Job {
    interest: Interest,
    pub(super) is_update: bool,
    work: Work,
}

/// A request that has become a job.
pub(super) struct Task {
    pub(super) lane: Lane,
    pub(super) job: Job,
    /// A file that later requests of the page may name, with its number.
    pub(super) keeps: Option<(u64, Vec<u8>)>,
}

/// Further data that a request may need.
#[derive(Default)]
pub(super) struct Means {
    pub(super) control: Option<SocketAddr>,
    /// The file that the request names.
    pub(super) file: Option<Vec<u8>>,
    /// The number of the next file.
    pub(super) number: u64,
}

/// Knowledge of earlier jobs about the node of a job.
pub(super) struct Known {
    pub(super) node: NodeId,
    pub(super) channel: Channel,
    pub(super) catalogue: Arc<Catalogue>,
}

/// Facts that a job reports to the pump, for all pages.
pub(super) enum Learned {
    /// The node exists.
    Present,
    Identity(Identity, Arc<Catalogue>),
    Catalogue(Arc<Catalogue>),
    /// The SDO channel for the node.
    Channel(Channel),
    Survey(Survey),
    Reading(Multiplexer, Vec<u8>),
    /// A number that a unit depends on; `None` where the node refuses the object.
    Number(Multiplexer, Option<Vec<u8>>),
}

/// The environment of a job.
pub(super) struct Context {
    pub(super) session: Session,
    orders: Sender<Order>,
    number: u64,
}

impl Context {
    pub(super) fn progress(&self, progress: Json) {
        let _ = self.orders.send(Order::Progress(self.number, progress));
    }

    /// A function that sends an event to all pages.
    fn teller(&self) -> impl Fn(Json) + use<> {
        let orders = self.orders.clone();
        move |event| drop(orders.send(Order::Tell(event)))
    }

    /// A function that reports the number of questions that have been asked, out of `all`.
    fn progress_of(&self, all: u32) -> impl FnMut(u8) + use<> {
        let (orders, number) = (self.orders.clone(), self.number);
        let mut told = None;
        move |done| {
            if told != Some(done) {
                told = Some(done);
                let _ = orders.send(Order::Progress(number, json!({ "done": done, "all": all })));
            }
        }
    }

    pub(super) fn learned(&self, node: NodeId, learned: Learned) {
        let _ = self.orders.send(Order::Learned(node, learned));
    }

    /// The catalogue of a node. A catalogue that the session did not have yet is reported to the pump.
    pub(super) fn catalogue(&mut self, node: NodeId) -> Result<Arc<Catalogue>, Failure> {
        let is_new = !self.session.knows(node);
        let catalogue = self.session.catalogue(node)?;
        if is_new {
            self.learned(node, Learned::Channel(self.session.network.channel(node)));
            self.learned(node, Learned::Catalogue(Arc::clone(&catalogue)));
        }
        Ok(catalogue)
    }

    /// A function that reports the number of finished items.
    fn counter(&self) -> impl FnMut(usize, usize) + use<> {
        let (orders, number) = (self.orders.clone(), self.number);
        let mut told = 0;
        move |done, all| {
            // A bar of twenty steps is fine enough.
            if all > 0 && (done * 20 / all != told || done == 0) {
                told = done * 20 / all;
                let _ = orders.send(Order::Progress(number, json!({ "done": done, "all": all })));
            }
        }
    }
}

impl Job {
    fn of_node(
        node: NodeId,
        work: impl FnOnce(&mut Context) -> Result<Json, Failure> + Send + 'static,
    ) -> Job {
        let interest = Interest::Node(node, Channel::default_of(node));
        Job { interest, is_update: false, work: Box::new(work) }
    }

    fn of_services(work: impl FnOnce(&mut Context) -> Result<Json, Failure> + Send + 'static) -> Job {
        Job { interest: Interest::Services, is_update: false, work: Box::new(work) }
    }
}

/// Begins a job. The pump receives the result in any case, also after a panic.
pub(super) fn begin(
    job: Job,
    number: u64,
    known: Option<Known>,
    turn: Arc<Turn>,
    options: &Options,
    orders: &Sender<Order>,
) {
    let (options, orders) = (options.clone(), orders.clone());
    let told = orders.clone();
    let run = move || {
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            work(job, number, known, turn, &options, &orders)
        }));
        let result = result
            .unwrap_or_else(|_| Err(Refusal::new("an error of this program: the request was given up")));
        let _ = orders.send(Order::Done(number, result));
    };
    if thread::Builder::new().name("job".to_owned()).spawn(run).is_err() {
        let _ =
            told.send(Order::Done(number, Err(Refusal::new("this machine has no room for another thread"))));
    }
}

fn work(
    job: Job,
    number: u64,
    known: Option<Known>,
    turn: Arc<Turn>,
    options: &Options,
    orders: &Sender<Order>,
) -> Result<Json, Refusal> {
    let for_port = orders.clone();
    let interest = known.as_ref().map_or(job.interest, |known| Interest::Node(known.node, known.channel));
    let network = Network::open(move || Ok(port::open(&for_port, interest)));
    let mut network = network.map_err(|error| Refusal::new(error.to_string()))?;
    let parked = orders.clone();
    network.set_gate(move || turn.pass(|| drop(parked.send(Order::Parked(number)))));
    let mut session = Session::with(network, options, Output::new(io::sink(), true));
    session.has_many_nodes = true;
    if let Some(Known { node, channel, catalogue }) = known {
        session
            .network
            .set_channel(node, Some(channel).filter(|channel| *channel != Channel::default_of(node)));
        session.know(node, catalogue);
    }
    let mut context = Context { session, orders: orders.clone(), number };
    (job.work)(&mut context).map_err(refusal)
}

fn refusal(failure: Failure) -> Refusal {
    let abort = match &failure {
        Failure::Sdo(error) => error.abort().map(|code| code.0),
        _ => None,
    };
    Refusal { text: failure.to_string(), abort }
}

/// Makes a job of a request.
///
/// # Errors
/// The error in the request.
pub(super) fn task(what: What, means: Means) -> Result<Task, String> {
    let of = |node: super::request::Node, job: Job| Task { lane: Lane::Node(node.0), job, keeps: None };
    let with = |lane, job| Task { lane, job, keeps: None };
    Ok(match what {
        What::Scan => with(Lane::Everything, scan()),
        What::Nmt { node, command } => {
            let node = if let Whom::Node(node) = node { Some(node.0) } else { None };
            with(Lane::Nothing, overview::nmt(node, command))
        }
        What::Save { node, group } => of(node, overview::store(node.0, store::Order::Save, group)),
        What::Restore { node, group } => of(node, overview::store(node.0, store::Order::Restore, group)),
        What::Signals { node } => of(node, survey(node.0)),
        What::Dictionary { node } => of(node, objects::dictionary(node.0)),
        What::Read { node, objects } => {
            of(node, objects::read(node.0, objects.into_iter().map(Into::into).collect()))
        }
        What::Values { node } => of(node, objects::values(node.0)),
        What::Write { node, index, sub, value } => {
            of(node, objects::write(node.0, crate::object::at(index, sub), &value)?)
        }
        What::Differences { node } => of(node, configuration::differences(node.0)),
        What::Dcf { node, all } => of(node, configuration::dcf(node.0, all)),
        What::Apply { node, text, how } => of(node, configuration::apply(node.0, &text, how)?),
        What::LssScan => with(Lane::Lss, lss::scan()),
        What::LssAssign { identity, node_id, store } => {
            with(Lane::Everything, lss::assign(identity.into(), node_id.0, store))
        }
        What::LssBitRate { kbit, identity, store, activate } => {
            with(Lane::Everything, lss::bit_rate(kbit, identity.map(Into::into), store, activate)?)
        }
        What::Pdos { node } => of(node, pdo::pdos(node.0)),
        What::Map { node, mapping } => of(node, pdo::map(node.0, mapping)),
        What::UpdateInspect { node, name, data } => {
            let bytes = update::decode(&data)?;
            let job = update::inspect(node.0, name, bytes.clone(), means.number);
            Task { keeps: Some((means.number, bytes)), ..of(node, job) }
        }
        What::UpdateStart { node, force, .. } => {
            let file = means.file.ok_or("there is no such file any more; choose it again")?;
            of(node, update::start(node.0, file, force)?)
        }
        What::Stimulate { board, kind, spec } => {
            let control = means.control.ok_or("stimuli are for a simulator")?;
            let command = stimuli::command(board, &kind, &spec)?;
            with(
                Lane::Nothing,
                Job::of_services(move |_| {
                    stimuli::ask(control, &command).map(|_| json!({})).map_err(Failure::Usage)
                }),
            )
        }
        // These need no job.
        What::Follow { .. } | What::Trace { .. } | What::Stimuli => return Err("not now".to_owned()),
    })
}
