//! Interrupts between any two instructions: the mode finds races, and programs without races pass in it.

mod bench;

use bench::{Bench, Verdict};
use emulator::{Exception, Incident};

/// The interrupt of TIM2.
const INTERRUPT: Exception = Exception::irq(28);

/// The seeds to try; all of them with THOROUGH set.
fn seeds() -> std::ops::Range<u64> {
    0..if std::env::var_os("THOROUGH").is_some() { 200 } else { 5 }
}

/// The notes of `lost_update`: counts lost without the program's own interrupt, number of interrupts, counts lost to
/// them, cycles of 100 NOPs.
fn notes(bench: &mut Bench) -> [u32; 4] {
    assert_eq!(bench.run_long(), Verdict::Passed);
    std::array::from_fn(|index| bench.note(index as u32))
}

#[test]
fn an_increment_against_an_interrupt_loses_counts() {
    let [_, interrupts, lost, _] = notes(&mut Bench::new("lost_update"));
    assert!(interrupts > 100);
    assert_eq!(lost, 0, "between blocks nothing is lost: that is why there is the other mode");
    for seed in seeds() {
        let mut bench = Bench::new("lost_update");
        bench.machine.interleave(Some(seed)).unwrap();
        let [quiet, interrupts, lost, _] = notes(&mut bench);
        assert_eq!(quiet, 0, "without interrupts nothing is lost");
        assert!(lost > interrupts / 100 && lost < interrupts, "seed {seed}: {lost} lost of {interrupts}");
    }
}

/// An interrupt at each instruction of `x++`: a count is lost if the interrupt comes after the load and before the end
/// of the store.
#[test]
fn every_place_of_an_increment_is_tried() {
    let (start, size) = Bench::function("lost_update", "bump");
    let lost: Vec<u32> = (start..start + size)
        .step_by(2)
        .map(|address| {
            let mut bench = Bench::new("lost_update");
            bench.machine.interleave(None).unwrap();
            bench.machine.interrupt_before(address, INTERRUPT);
            notes(&mut bench)[0]
        })
        .collect();
    assert_eq!(lost.first(), Some(&0), "before the load: {lost:?}");
    assert_eq!(lost.last(), Some(&0), "after the store: {lost:?}");
    assert_eq!(lost.iter().sum::<u32>(), 2, "before the addition and before the store: {lost:?}");
}

#[test]
fn time_advances_within_a_block() {
    let nops = |interleaved: bool| {
        let mut bench = Bench::new("lost_update");
        if interleaved {
            bench.machine.interleave(None).unwrap();
        }
        notes(&mut bench)[3]
    };
    assert!(nops(true) >= 100 && nops(true) < 110, "{}", nops(true));
    assert!(nops(false) < 100, "a block is charged before it runs");
}

/// The programs that show a mechanism pass in this mode too: preemption, locks, floats, IT blocks, exclusive accesses.
#[test]
fn programs_without_races_pass_with_every_seed() {
    for program in [
        "preemption",
        "basepri",
        "rtic_tasks",
        "float_contexts",
        "it_block",
        "exclusive",
        "self_modified",
        "execute_never",
        "escalation",
        "hints",
    ] {
        for seed in seeds() {
            let mut bench = Bench::new(program);
            bench.machine.interleave(Some(seed)).unwrap();
            assert_eq!(bench.run(), Verdict::Passed, "{program}, seed {seed}");
        }
    }
}

/// Instructions that silicon refuses. The usual mode only detects use of the disabled floating-point unit.
#[test]
fn instructions_that_silicon_refuses_fault() {
    let mut bench = Bench::new("traps");
    assert_eq!(bench.run(), Verdict::Failed(2), "the first unaligned access");
    let breaches = bench.machine.incidents().iter();
    let breaches = breaches.filter(|(_, incident)| matches!(incident, Incident::Breach { .. }));
    assert_eq!(breaches.count(), 2, "each of the two traps that would not come is reported once");
    let mut bench = Bench::new("traps");
    bench.machine.interleave(None).unwrap();
    assert_eq!(bench.run(), Verdict::Passed);
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let trace = |seed| {
        let mut bench = Bench::new("rtic_tasks");
        bench.machine.interleave(Some(seed)).unwrap();
        bench.run();
        bench.machine.stats().trace
    };
    assert_eq!(trace(1), trace(1));
    assert_ne!(trace(1), trace(2));
}

/// The notes of `posted_stores`, without and with a barrier or a read in between: entries of a handler that lowers its line
/// last; whether an interrupt is pending again after its line was lowered; what a register takes behind its clock.
fn posted(bench: &mut Bench) -> [u32; 6] {
    assert_eq!(bench.run_long(), Verdict::Passed);
    std::array::from_fn(|index| bench.note(index as u32))
}

#[test]
fn a_store_takes_its_time_to_a_peripheral() {
    assert_eq!(posted(&mut Bench::new("posted_stores")), [1, 1, 0, 0, 7, 7], "at once in the usual mode");
    let mut bench = Bench::new("posted_stores");
    bench.machine.interleave(None).unwrap();
    assert_eq!(posted(&mut bench), [2, 1, 1, 0, 0, 7]);
    for seed in seeds() {
        let mut bench = Bench::new("posted_stores");
        bench.machine.interleave(Some(seed)).unwrap();
        let [_, with_barrier, _, with_read, _, behind] = posted(&mut bench);
        assert_eq!((with_barrier, with_read, behind), (1, 0, 7), "seed {seed}");
    }
}

/// Without its barriers the program sees the same as where it has none.
#[test]
fn a_barrier_that_is_taken_out_is_missing() {
    let (start, size) = Bench::function("posted_stores", "TIM2");
    let mut bench = Bench::new("posted_stores");
    bench.machine.interleave(None).unwrap();
    (start..start + size).step_by(2).for_each(|address| bench.machine.omit_barrier(address));
    assert_eq!(posted(&mut bench)[..2], [2, 2]);
}
