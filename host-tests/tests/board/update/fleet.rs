//! The command `nodectl update` on the bus of the emulated boards, in virtual time.

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use std::sync::atomic::{AtomicU32, Ordering};

use canbus::Time;
use clap::Parser;
use host_tests::thorough::either;
use nodectl::cli::Cli;
use programmer::sign::image::Image;
use serde_json::{Value, json};
use sim::world::World;

use super::bench::{Bench, VERSION_B, signed, version_a, version_b};
pub(super) use crate::adapter::Shared;
use crate::adapter::run;
use crate::support::{SECOND, world};

/// A power failure of a board in one operation of its flash, and the return of the power.
pub(super) struct Outage {
    board: usize,
    /// The number of the flash operation.
    operation: u64,
    /// The instant at which the power returns.
    until: Option<Time>,
}

impl Outage {
    const LENGTH: Time = Time::from_millis(12_000);

    /// A failure halfway through the flash operations of an image's download.
    fn halfway(world: &Shared, board: usize, image: &Image) -> Outage {
        Outage::after(world, board, image.to_bytes().len() as u64 / 8)
    }

    /// A failure after this number of flash operations.
    pub(super) fn after(world: &Shared, board: usize, operations: u64) -> Outage {
        let done = world.borrow_mut().machine(board).peripherals_mut().flash_mut().operations();
        Outage { board, operation: done + operations, until: None }
    }

    /// Whether the power has returned.
    pub(super) fn is_over(&mut self, world: &mut World) -> bool {
        let now = world.now();
        let machine = world.machine(self.board);
        match self.until {
            None if machine.peripherals_mut().flash_mut().operations() >= self.operation => {
                machine.power_off();
                self.until = Some(now + Outage::LENGTH);
            }
            Some(until) if now >= until => {
                machine.power_on(now);
                return true;
            }
            _ => {}
        }
        false
    }
}

pub(super) const PERSONALITIES: [&str; 4] = ["pressure", "encoder", "combined", "lift"];

pub(super) fn boards(count: u8) -> Shared {
    let nodes: String = (1..=count).map(|node| format!(" --node {node}:pressure")).collect();
    share(world(&format!("--bitrate 1000{nodes}")))
}

/// A world a second after power-on.
pub(super) fn share(mut world: World) -> Shared {
    world.run_until(SECOND);
    Rc::new(RefCell::new(world))
}

fn unshare(world: Shared) -> World {
    Rc::into_inner(world).expect("no adapter is left").into_inner()
}

/// Runs `nodectl update --force` (A is the older version). Returns its reports, one for each node, in the order of the
/// updates.
pub(super) fn update(world: &Shared, nodes: &str, image: &Image, outage: Option<Outage>) -> Vec<Value> {
    try_update(world, nodes, image, outage, &[]).unwrap_or_else(|refusal| panic!("{refusal}"))
}

/// Runs the command with further arguments; returns the reports or the error.
pub(super) fn try_update(
    world: &Shared,
    nodes: &str,
    image: &Image,
    mut outage: Option<Outage>,
    more: &[&str],
) -> Result<Vec<Value>, String> {
    let happens = move |world: &mut World| {
        outage.take_if(|outage| outage.is_over(world));
    };
    update_while(world, nodes, image, happens, more)
}

/// Runs the command while something happens: `happens` is called again and again, as time passes.
pub(super) fn update_while(
    world: &Shared,
    nodes: &str,
    image: &Image,
    happens: impl FnMut(&mut World) + 'static,
    more: &[&str],
) -> Result<Vec<Value>, String> {
    // Tests may run at the same time in one process.
    static FILES: AtomicU32 = AtomicU32::new(0);
    let name = format!("{}-{}.img", std::process::id(), FILES.fetch_add(1, Ordering::Relaxed));
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&file, image.to_bytes()).unwrap();
    let line = ["nodectl", "--bus", "socketcan:emulated", "--json", "--node", nodes, "update", "--force"];
    let cli = Cli::try_parse_from(line.iter().chain(more).copied().chain(file.to_str())).unwrap();
    let (printed, result) = run(world, &cli, happens);
    std::fs::remove_file(file).unwrap();
    result.map_err(|failure| format!("{failure}: {printed}"))?;
    println!("{:6.2} s: {printed}", world.borrow().now().as_secs_f64());
    Ok(printed.lines().map(|line| serde_json::from_str(line).unwrap()).collect())
}

/// The expected report of a node.
fn updated(node: u8, [from, to]: [&Image; 2]) -> Value {
    let version = |image: &Image| image.header.description().version.to_string();
    json!({
        "node": node,
        "result": "updated",
        "old_version": version(from),
        "old_identification": from.header.code_crc(),
        "new_version": version(to),
        "new_identification": to.header.code_crc(),
        "on_trial": false,
        "error": null,
    })
}

#[test]
fn nodectl_updates_to_b_and_back() {
    let world = boards(1);
    let (a, b) = (version_a(), version_b(0));
    assert_eq!(b.header.description().version, VERSION_B);
    assert_eq!(update(&world, "1", &b, None), [updated(1, [&a, &b])]);
    assert_eq!(update(&world, "1", &a, None), [updated(1, [&b, &a])]);
}

/// Every personality at node-IDs 1, 16 and 127, at a bit rate of a sample: one image serves all of them.
#[test]
fn one_image_updates_every_personality() {
    let kbits = [1000, 500, 250, 125];
    let cases = PERSONALITIES.into_iter().zip([1, 16, 127, 1]).zip(kbits);
    for ((personality, node), kbit) in cases {
        let flags = format!("--bitrate {kbit} --node {node}:{personality}");
        let world = share(world(&flags));
        let (a, b) = (version_a(), version_b(0));
        // `nodectl_updates_to_b_and_back` has the rollback in each run.
        for [from, to] in either(vec![[&a, &b]], vec![[&a, &b], [&b, &a]]) {
            assert_eq!(update(&world, &node.to_string(), to, None), [updated(node, [from, to])], "{flags}");
        }
    }
}

/// Runs a command of `nodectl` on a node; returns its report or the error.
fn nodectl(world: &Shared, node: u8, command: &str) -> Result<Value, String> {
    let node = node.to_string();
    let line = ["nodectl", "--bus", "socketcan:emulated", "--json", "--node", &node, command];
    let (printed, result) = run(world, &Cli::try_parse_from(line).unwrap(), |_| ());
    result.map_err(|failure| failure.to_string())?;
    Ok(serde_json::from_str(&printed).unwrap())
}

#[test]
fn nodectl_confirms_or_rolls_back_a_program_on_trial() {
    let (a, b) = (version_a(), version_b(0));
    let all: Vec<_> = PERSONALITIES.into_iter().zip([1000, 125, 250, 500]).collect();
    for (personality, kbit) in either(vec![all[0], all[3]], all) {
        let world = share(world(&format!("--bitrate {kbit} --node 16:{personality}")));
        for command in ["confirm", "rollback"] {
            assert_eq!(nodectl(&world, 16, command).unwrap_err(), "node 16: its program is not on trial");
        }
        let left = ["--no-confirm"];
        for (command, result, runs) in [("rollback", "rolled back", &a), ("confirm", "confirmed", &b)] {
            let reports = try_update(&world, "16", &b, None, &left).unwrap();
            assert_eq!(reports[0]["on_trial"], true, "{personality}");
            let refusal = try_update(&world, "16", &a, None, &left).unwrap_err();
            assert!(refusal.contains("its program is on trial"), "{personality}: {refusal}");
            let report = nodectl(&world, 16, command).unwrap();
            assert_eq!(report["result"], result, "{personality}");
            assert_eq!(report["identification"], runs.header.code_crc(), "{personality}");
        }
    }
}

/// `nodectl` refuses the image before the node is touched, with `--force` too. Without the check of `nodectl` the
/// bootloader refuses it.
#[test]
fn an_image_for_another_board_is_refused_with_force_and_by_the_bootloader() {
    const BOARD: u8 = 64;
    for (personality, kbit) in PERSONALITIES.into_iter().zip([125, 250, 500, 1000]) {
        let world = share(world(&format!("--bitrate {kbit} --node 16:{personality}")));
        let other = signed(version_b(0).code, |about| about.board += 1);
        let refusal = try_update(&world, "16", &other, None, &[]).unwrap_err();
        let told = format!(
            "node 16: the image is for board {:08X}h, the node has board {:08X}h",
            profiles::product::BOARD + 1,
            profiles::product::BOARD
        );
        assert!(refusal.contains(&told), "{personality}: {refusal}");
        let refusal = try_update(&world, "16", &other, None, &["--raw"]).unwrap_err();
        assert!(refusal.contains("the image is for another board"), "{personality}: {refusal}");
        let mut bench = Bench::with(unshare(world), kbit * 1000, 16);
        assert_eq!(bench.settled().code, BOARD, "{personality}");
        assert_eq!(bench.start(), version_a().header.code_crc(), "{personality}");
    }
}

/// The failed node is updated after the others, and its download is continued. Four nodes in a thorough run, otherwise
/// two.
#[test]
fn a_node_of_several_is_switched_off_halfway_and_gone_on_with() {
    let (nodes, off) = either((2, 1), (4, 2));
    let world = boards(nodes);
    let (a, b) = (version_a(), version_b(0));
    let outage = Outage::halfway(&world, usize::from(off) - 1, &b);
    let reports = update(&world, &format!("1-{nodes}"), &b, Some(outage));
    let others = (1..=nodes).filter(|&node| node != off);
    let in_turn: Vec<Value> = others.chain([off]).map(|node| updated(node, [&a, &b])).collect();
    assert_eq!(reports, in_turn);
}

/// With `--force` the same code is installed again, with another version, counter or key list. A node that is lost in the
/// download still has the code of before, which is no sign of the new image.
#[test]
fn a_forced_update_with_the_same_code_is_repeated_after_a_loss() {
    for (personality, kbit) in
        either(vec![("encoder", 1000)], PERSONALITIES.into_iter().zip([1000, 500, 250, 125]).collect())
    {
        let world = share(world(&format!("--bitrate {kbit} --node 16:{personality}")));
        let image = signed(version_a().code, |about| about.version = VERSION_B);
        assert_eq!(image.header.code_crc(), version_a().header.code_crc());
        let outage = Outage::halfway(&world, 0, &image);
        let reports = update(&world, "16", &image, Some(outage));
        assert_eq!(reports[0]["result"], "updated", "{personality}");
        let bytes = image.to_bytes();
        let bench = Bench::with(unshare(world), kbit * 1000, 16);
        assert!(bench.application().starts_with(&bytes), "{personality}: the new image is not there");
    }
}
