//! Jobs: LSS for nodes that are known by their identity (CiA 305).

use canopen::client::lss::Fastscan;
use canopen::lss::Identity;
use canopen::{Duration, NodeId};
use serde_json::{Value as Json, json};

use super::{Context, Job};
use crate::cli::Failure;
use crate::cli::lss::{self as command, scan::find};
use crate::lss::{Master, Selection};

/// The duration of a step of a search.
const STEP: Duration = Duration::from_millis(100);

/// Searches for a node without a node-ID.
pub(super) fn scan() -> Job {
    Job::of_services(|context| {
        let number = context.progress_of(Fastscan::QUESTIONS.into());
        let found = find(&mut context.session, STEP, number);
        // Release all slaves in any case, also after an error.
        let released = master(context).release();
        let found = found?;
        released?;
        Ok(json!({ "found": found.map(shape) }))
    })
}

fn master(context: &mut Context) -> Master<'_> {
    let timeout = context.session.options.timeout();
    Master::new(&mut context.session.network, timeout)
}

fn shape(Identity { vendor, product, revision, serial }: Identity) -> Json {
    json!({ "vendor": vendor, "product": product, "revision": revision, "serial": serial })
}

/// Gives a node a free node-ID, and waits until the node has booted with it.
pub(super) fn assign(identity: Identity, node: NodeId, store: bool) -> Job {
    Job::of_services(move |context| {
        command::free(&mut context.session, node, &identity)?;
        let mut master = master(context);
        master.select(Selection::One(identity))?;
        let had_one = (|| {
            let had_one = master.node_id()?.is_some();
            master.set_node_id(Some(node))?;
            if store {
                master.store()?;
            }
            Ok::<_, Failure>(had_one)
        })();
        let released = master.release();
        let had_one = had_one?;
        released?;
        // A node that had a node-ID already uses the new one only after a reset of communication.
        if !had_one {
            command::booted(&mut context.session, node)?;
        }
        Ok(json!({ "node": node.get(), "after_reset": had_one }))
    })
}

/// Sets another bit rate for one node or all nodes. Ends when the nodes may send with it.
pub(super) fn bit_rate(
    kbit: u16,
    identity: Option<Identity>,
    store: bool,
    delay: u16,
) -> Result<Job, String> {
    let rate = command::bit_rate(kbit).map_err(|failure| failure.to_string())?;
    Ok(Job::of_services(move |context| {
        let mut master = master(context);
        master.select(identity.map_or(Selection::All, Selection::One))?;
        let done = (|| {
            master.set_bit_rate(rate)?;
            if store {
                master.store()?;
            }
            if delay > 0 {
                master.activate(delay)?;
            }
            Ok::<_, Failure>(())
        })();
        let released = master.release();
        done?;
        released?;
        context.session.network.pause(Duration::from_millis(2 * u64::from(delay)))?;
        Ok(json!({}))
    }))
}
