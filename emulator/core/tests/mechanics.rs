//! The mechanics of the core. A program of `mechanics-images` shows each mechanism, and a negative control switches the
//! mechanism off: the same program must notice.

mod bench;

use bench::{Bench, Verdict};
use canbus::Time;
use emulator::{Estimate, Exception, Mechanism};

/// The program passes with the mechanism, and fails or hangs without it.
fn shows(program: &str, mechanism: Mechanism) {
    assert_eq!(Bench::new(program).run(), Verdict::Passed, "{program}");
    let mut crippled = Bench::new(program);
    crippled.machine.without(mechanism);
    assert_ne!(crippled.run(), Verdict::Passed, "{program} does not notice that {mechanism:?} is missing");
}

#[test]
fn a_higher_priority_interrupts_a_lower_one() {
    shows("preemption", Mechanism::Preemption);
}

#[test]
fn basepri_holds_back_its_level_and_below() {
    shows("basepri", Mechanism::Basepri);
}

#[test]
fn locks_of_rtic_keep_others_out() {
    shows("rtic_tasks", Mechanism::Basepri);
}

#[test]
fn software_tasks_of_rtic_preempt_each_other() {
    shows("rtic_tasks", Mechanism::Preemption);
}

#[test]
fn four_contexts_keep_their_floating_point_registers() {
    shows("float_contexts", Mechanism::FloatFrame);
}

#[test]
fn an_it_block_continues_after_an_exception() {
    shows("it_block", Mechanism::ItState);
}

#[test]
fn an_interrupt_breaks_exclusive_access() {
    shows("exclusive", Mechanism::ExclusiveMonitor);
}

#[test]
fn code_runs_where_the_protection_unit_allows_it() {
    shows("execute_never", Mechanism::ExecuteNever);
}

#[test]
fn code_programmed_into_flash_runs() {
    shows("self_modified", Mechanism::Retranslation);
}

/// In all modes: between blocks, between instructions, and with the most cycles.
#[test]
fn no_bit_of_flash_is_set_without_an_erase() {
    for (mode, change) in [
        ("the usual one", None::<fn(&mut Bench)>),
        ("interleaved", Some(|bench| bench.machine.interleave(Some(1)).unwrap())),
        ("the most cycles", Some(|bench| bench.machine.set_estimate(Estimate::Worst).unwrap())),
    ] {
        let mut bench = Bench::new("programmed_twice");
        change.into_iter().for_each(|change| change(&mut bench));
        assert_eq!(bench.run(), Verdict::Passed, "{mode}");
    }
}

#[test]
fn a_load_from_busy_flash_waits() {
    shows("busy_flash", Mechanism::FlashLoads);
}

#[test]
fn wfi_sleeps_until_the_next_tick() {
    shows("systick", Mechanism::Sleep);
}

#[test]
fn a_second_interrupt_is_chained() {
    shows("tail_chain", Mechanism::TailChain);
}

/// The measure of the response: an activation begins when its request is set, also if the same handler runs at this time.
#[test]
fn a_request_while_the_handler_runs_waits_for_its_end() {
    let mut bench = Bench::new("requested_again");
    assert_eq!(bench.run(), Verdict::Passed);
    let activity = *bench.machine.stats().of(Exception::irq(28));
    assert_eq!((activity.entries, bench.machine.stats().tail_chained), (2, 1));
    assert!(activity.worst_cycles < activity.cycles * 6 / 10, "the runs are two activations: {activity:?}");
    let run = Time::of_cycle(16_000_000).0 * activity.worst_cycles;
    let (latency, response) = (activity.worst_latency.0, activity.worst_response.0);
    assert!((run * 9 / 10..=run * 11 / 10).contains(&latency), "{activity:?}");
    assert!((run * 19 / 10..=run * 21 / 10).contains(&response), "{activity:?}");
}

#[test]
fn faults_escalate() {
    shows("escalation", Mechanism::Escalation);
}

#[test]
fn a_stack_overflow_reaches_the_fault_handler() {
    shows("stack_overflow", Mechanism::Escalation);
}

#[test]
fn system_registers_are_as_the_architecture_says() {
    let mut bench = Bench::new("system_registers");
    let verdict = bench.run();
    assert_eq!(verdict, Verdict::Passed, "{:x?}", bench.machine.incidents().first());
}

#[test]
fn a_store_to_nowhere_is_not_waited_for() {
    assert_eq!(Bench::new("lost_store").run(), Verdict::Passed);
}

#[test]
fn an_it_block_that_touches_a_new_page_ends_where_it_ends() {
    assert_eq!(Bench::new("it_miss").run(), Verdict::Passed);
}

#[test]
fn hints_do_nothing() {
    assert_eq!(Bench::new("hints").run(), Verdict::Passed);
}

#[test]
fn a_reset_keeps_ram_and_clears_the_core() {
    let mut bench = Bench::new("restart");
    assert_eq!(bench.run(), Verdict::Passed);
    assert_eq!(bench.machine.incidents().len(), 1);
}

#[test]
fn sleeping_takes_virtual_time_but_no_cycles() {
    let mut bench = Bench::new("systick");
    assert_eq!(bench.run(), Verdict::Passed);
    let asleep = bench.machine.stats().asleep;
    assert!(asleep > Time::from_millis(9) && asleep < Time::from_millis(12), "{asleep}");
}

#[test]
fn tail_chaining_is_shorter_than_unstacking() {
    let gap = |bench: &mut Bench| {
        bench.run();
        bench.note(0)
    };
    let chained = gap(&mut Bench::new("tail_chain"));
    let mut bench = Bench::new("tail_chain");
    bench.machine.without(Mechanism::TailChain);
    assert!(chained < gap(&mut bench));
}

#[test]
fn the_same_run_has_the_same_trace_however_it_is_sliced() {
    let trace = |slice: Time| {
        let mut bench = Bench::new("rtic_tasks");
        bench.run_in_slices(slice);
        let stats = bench.machine.stats();
        (stats.trace, stats.instructions)
    };
    let whole = trace(Time::from_millis(1));
    assert_eq!(whole, trace(Time::from_millis(1)));
    assert_eq!(whole, trace(Time::from_micros(1)));
    assert_eq!(whole, trace(Time(12_345)));
}
