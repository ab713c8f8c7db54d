//! The barriers and the read-back of the images, taken out one after the other: what the emulated board says without
//! each.
//! Stores take their time to the peripherals only with `--interleave`.

use canbus::Time;
use emulator::{Access, Bug, Exception};
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use sim::world::World;

use crate::support::{Master, START_ALL, SYNC, firmware, images, unwatched};

/// The interrupts of the tasks (RM0390, table 38).
const TASKS: [(&str, u8); 6] =
    [("CAN1_RX0", 20), ("CAN1_RX1", 21), ("DMA2_STREAM0", 56), ("CAN1_TX", 19), ("TIM2", 28), ("SDIO", 49)];
const PWR_CR: u32 = 0x4000_7000;
/// The instant at which the application is running, and the questions that it then answers.
const STARTED: Time = Time::from_millis(600);
const ROUNDS: u8 = 10;

/// The result of a run: the entries of each task, and every deviation that an engineer would notice.
#[derive(Debug)]
struct Said {
    entries: [u64; TASKS.len()],
    told: Vec<String>,
}

impl Said {
    /// Without a barrier the tasks begin some cycles earlier, so the end of the run may come one entry later or earlier. A
    /// flag that is cleared too late enters its task twice each time.
    fn is_like(&self, right: &Said) -> bool {
        let mut pairs = self.entries.iter().zip(&right.entries);
        self.told == right.told && pairs.all(|(entries, right)| entries.abs_diff(*right) <= 1)
    }
}

/// An encoder that answers, is synchronised, and writes its backup memory.
fn run(change: impl FnOnce(&mut World)) -> Said {
    let mut world = unwatched("bootloader", "--bitrate 1000 --node 1:encoder --shaft rpm:60 --interleave 3");
    world.enforce_rules(false);
    change(&mut world);
    let master = Master::join(&mut world);
    world.run_until(STARTED);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    for round in 0..ROUNDS {
        master.send(&mut world, SYNC, &[]);
        master.send(&mut world, 0x601, &[0x40, 0x18, 0x10, 1 + round % 4, 0, 0, 0, 0]);
        world.run_until(world.now() + Time::from_millis(10));
    }
    let answers = master.heard(&mut world, 0x581).len();
    let summary = world.summary(1.0, 0);
    let node = &summary.nodes[0];
    let mut told = [&node.broken_rules[..], &node.incidents[..]].concat();
    if answers != usize::from(ROUNDS) {
        told.push(format!("{answers} answers instead of {ROUNDS}"));
    }
    let stats = world.machine(0).stats();
    Said { entries: TASKS.map(|(_, irq)| stats.of(Exception::irq(irq)).entries), told }
}

/// The addresses of all DSB and DMB of an image, each with its function.
fn barriers(elf: &[u8]) -> Vec<(u32, String)> {
    let file = object::File::parse(elf).unwrap();
    let functions: Vec<(u32, u32, String)> = file
        .symbols()
        .filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0)
        .map(|symbol| {
            (symbol.address() as u32 & !1, symbol.size() as u32, symbol.name().unwrap_or("?").to_owned())
        })
        .collect();
    let mut found = Vec::new();
    for section in file.sections().filter(|section| section.kind() == object::SectionKind::Text) {
        let bytes = section.data().unwrap();
        for at in (0..bytes.len().saturating_sub(3)).step_by(2) {
            let address = section.address() as u32 + at as u32;
            let function =
                functions.iter().find(|(start, size, _)| (*start..start + size).contains(&address));
            if let ([0xBF, 0xF3, 0x40..=0x5F, 0x8F], Some((_, _, name))) = (&bytes[at..at + 4], function) {
                found.push((address, name.clone()));
            }
        }
    }
    found.sort();
    found.dedup();
    found
}

/// None of them alone is what the images stand on: the flags of a task are cleared at its begin, so its last store has arrived
/// long before it returns.
#[test]
fn without_one_barrier_the_images_still_run() {
    let right = run(|_| ());
    assert_eq!(right.told, [""; 0], "with all barriers");
    let bootloader = std::fs::read(images().join("bootloader")).unwrap();
    let all = [barriers(&firmware()), barriers(&bootloader)].concat();
    assert!(all.len() > 40, "{} barriers", all.len());
    let mut names: Vec<&String> = all.iter().map(|(_, name)| name).collect();
    names.sort();
    names.dedup();
    for name in names {
        let places = all.iter().filter(|(_, function)| function == name).map(|(address, _)| *address);
        let said = run(|world| places.clone().for_each(|address| world.machine(0).omit_barrier(address)));
        println!("without {} of {name}: {:?} {:?}", places.clone().count(), said.entries, said.told);
        assert!(said.is_like(&right), "without the barriers of {name}: {said:?} instead of {right:?}");
    }
}

/// DBP is set on a slow bus, and the memory is on a fast one.
#[test]
fn the_read_back_of_pwr_keeps_the_backup_memory_waiting() {
    let said = run(|world| world.machine(0).seed(Bug { register: PWR_CR, access: Access::Unordered }));
    println!("without the read-back: {said:?}");
    let rule = "is written while the backup domain is protected";
    assert!(said.told.iter().any(|told| told.contains(rule)), "{:?}", said.told);
}
