//! One lost event has no lasting effect: the chip loses an event that the program waits for, and the node recovers
//! without a reset and counts the loss (2001h).

use canbus::Time;
use chip::Loss;
use emulator::Exception;
use host_tests::watch::expects;
use monitor::Rule;
use sim::world::World;

use crate::chip_faults::{peek, poke};
use crate::encoder::{
    COUNTS, NO_SIGNAL, POSITION, POSITION_ERROR, SENSOR_STATE, STEPS, ages, cycle_power, start,
    start_absolute, stimulate, wait,
};
use crate::support::{
    Master, SDO_RESPONSE, SECOND, START_ALL, SYNC, TPDO1, frame, read, run, running, world, write,
};

/// Sub-indexes of 2001h.
const MILLISECONDS: u8 = 2;
const SAMPLING: u8 = 3;
const SSI_WORDS: u8 = 4;
const INDEX: u8 = 5;
const ALARMS: u8 = 6;
const BACKUP_WRITES: u8 = 7;
const FLASH: u8 = 8;

/// Data register of SPI2; control registers of the DMA streams of the count, the absolute encoder, the index and the
/// ADC (RM0390, 26.7.4 and 9.5.5), of the converter, and of the timer that starts the conversions.
const SPI2_DR: u32 = 0x4000_380C;
const DMA1_S5CR: u32 = 0x4002_6088;
const DMA1_S2CR: u32 = 0x4002_6040;
const DMA1_S3CR: u32 = 0x4002_6058;
const DMA1_S4CR: u32 = 0x4002_6070;
const DMA2_S0CR: u32 = 0x4002_6410;
const ADC1_CR2: u32 = 0x4001_2008;
const TIM3_CR1: u32 = 0x4000_0400;
const ENABLED: u32 = 1;

/// DMA2 stream 0 (RM0390, table 38).
const SAMPLING_TASK: Exception = Exception::irq(56);

const RPM: u32 = 6000;
/// TPDO 2 of the encoder, sent with every SYNC.
const TPDO2: u16 = 0x281;
/// EMCY of a sensor that does not answer.
const SENSOR_BREAK: u16 = 0x5006;

fn lose(world: &mut World, loss: Loss, times: usize) {
    world.machine(0).peripherals_mut().lose(loss, times);
}

/// The node's count of events of this kind; the node updates the object every 20 ms.
fn counted(world: &mut World, master: &Master, kind: u8) -> u32 {
    wait(world, 25);
    read(world, master, (0x2001, kind))
}

/// Checks that the node has neither reset nor sent an EMCY.
fn assert_silent(world: &mut World) {
    let summary = run(world, Time::ZERO);
    let node = &summary.nodes[0];
    assert!(node.incidents.is_empty() && node.unmodelled.is_empty(), "{summary}");
    assert_eq!((node.heard.boot_ups, node.heard.emcys), (1, 0), "{summary}");
}

/// A node with an encoder that turns, operational; its TPDO 2 comes with every SYNC.
fn turning(absolute: bool) -> (World, Master) {
    let (mut world, master) = if absolute { start_absolute("") } else { start("") };
    stimulate(&mut world, "shaft", &format!("rpm:{RPM}"));
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    wait(&mut world, 20);
    master.heard(&mut world, TPDO2);
    (world, master)
}

/// The greatest age of the positions in the next second, in microseconds.
fn oldest(world: &mut World, master: &Master, absolute: bool) -> f64 {
    let (steps, range) = if absolute { (STEPS, 1 << 25) } else { (COUNTS, 1 << 24) };
    master.heard(world, TPDO2);
    let (least, most) = ages(world, master, steps, range, steps * f64::from(RPM) / 60.0);
    assert!(least > 0.0, "{least}");
    most
}

/// A word without one of its bytes is a missing reading: the position is a millisecond older, once.
#[test]
fn a_lost_byte_of_the_absolute_encoder_costs_one_reading() {
    let (mut world, master) = turning(true);
    for number in 1..=20 {
        // At each byte of the word, at each phase of the millisecond.
        world.run_until(world.now() + Time::from_micros(10_137));
        lose(&mut world, Loss::SpiByte, 1);
        assert_eq!(counted(&mut world, &master, SSI_WORDS), number);
    }
    lose(&mut world, Loss::SpiByte, 1);
    let most = oldest(&mut world, &master, true);
    assert!(most < 3200.0, "a reading is missing: {most} us");
    let most = oldest(&mut world, &master, true);
    assert!(most < 2200.0, "and no other one: {most} us");
    assert_silent(&mut world);
}

/// A surplus byte, which could be taken for the first byte of the next word.
#[test]
fn a_byte_that_is_left_over_is_not_taken_for_the_next_word() {
    let (mut world, master) = turning(true);
    poke(&mut world, SPI2_DR, 0);
    assert_eq!(counted(&mut world, &master, SSI_WORDS), 1);
    assert!(oldest(&mut world, &master, true) < 2200.0);
    assert_eq!(read(&mut world, &master, SENSOR_STATE), 0);
    assert_silent(&mut world);
}

/// If bytes are lost again and again, the node reports a missing signal, as for an open line; the report ends with the
/// loss.
#[test]
fn bytes_lost_for_more_than_two_milliseconds_are_reported() {
    let (mut world, master) = start_absolute("--shaft const:2.25");
    let expected = read(&mut world, &master, POSITION);
    lose(&mut world, Loss::SpiByte, 1000);
    wait(&mut world, 50);
    assert_eq!(read(&mut world, &master, SENSOR_STATE), NO_SIGNAL | POSITION_ERROR);
    assert_eq!(world.traffic().node(1).last_emcy, Some(SENSOR_BREAK));
    wait(&mut world, 1000);
    assert_eq!(read(&mut world, &master, SENSOR_STATE), 0);
    assert_eq!(read(&mut world, &master, POSITION), expected);
    assert_eq!(world.traffic().node(1).last_emcy, Some(0));
}

/// After a lost copy, the copies of the count lag one scan behind the conversions: each position would be two
/// milliseconds old.
#[test]
fn a_lost_copy_of_the_count_is_noticed() {
    let (mut world, master) = turning(false);
    for number in 1..=20 {
        world.run_until(world.now() + Time::from_micros(10_137));
        lose(&mut world, Loss::DmaRequest { controller: 1, stream: 2 }, 1);
        let most = oldest(&mut world, &master, false);
        assert!(most < 1200.0, "{most} us");
        assert_eq!(counted(&mut world, &master, SAMPLING), number);
    }
    assert_silent(&mut world);
}

/// A stopped sampling is restarted within milliseconds; the counter of the encoder continues.
#[test]
fn a_sampling_that_stands_still_is_started_again() {
    let (mut world, master) = turning(false);
    let breaks: [fn(&mut World); 5] = [
        // The ADC has an overrun, and makes no more DMA requests.
        |world| lose(world, Loss::DmaRequest { controller: 2, stream: 0 }, 1),
        |world| poke(world, DMA2_S0CR, 0),
        |world| poke(world, DMA1_S2CR, 0),
        |world| poke(world, ADC1_CR2, 0),
        |world| poke(world, TIM3_CR1, 0),
    ];
    for (number, broken) in (1..).zip(breaks) {
        let before = run(&mut world, Time::ZERO).nodes[0].sampling.samples;
        broken(&mut world);
        let after = run(&mut world, Time::from_millis(100)).nodes[0].sampling.samples;
        assert!((94..=102).contains(&(after - before)), "{} samples in 100 ms", after - before);
        assert!(oldest(&mut world, &master, false) < 1200.0);
        assert_eq!(counted(&mut world, &master, SAMPLING), number);
    }
    assert_silent(&mut world);
}

#[test]
fn an_index_capture_that_is_switched_off_is_switched_on_again() {
    let (mut world, master) = turning(false);
    poke(&mut world, DMA1_S5CR, 0);
    assert_eq!(counted(&mut world, &master, INDEX), 1);
    assert_eq!(peek(&mut world, DMA1_S5CR) & ENABLED, ENABLED);
    assert!(oldest(&mut world, &master, false) < 1200.0);
    assert_silent(&mut world);
}

/// The compare match of the services is lost: without a remedy they would sleep for 71 minutes. A match that is lost
/// just before the check of a millisecond is not counted, because the check is in time: this may happen once in ten.
#[test]
fn a_lost_alarm_is_noticed_by_the_time() {
    let mut world = running();
    let master = Master::join(&mut world);
    let before = run(&mut world, Time::ZERO).nodes[0].heard.heartbeats;
    for number in 1..=10 {
        lose(&mut world, Loss::Compare { channel: 1 }, 1);
        lose(&mut world, Loss::Compare { channel: 2 }, 1);
        world.run_until(world.now() + Time::from_millis(100));
        assert!(counted(&mut world, &master, ALARMS) + 1 >= number);
    }
    let after = run(&mut world, SECOND * 4).nodes[0].heard.heartbeats;
    assert!(after - before >= 5, "{}", after - before);
    assert_silent(&mut world);
}

/// The time base passes its half and its end without the interrupts for them.
#[test]
fn timers_continue_without_the_interrupt_of_the_wrap() {
    let mut world = running();
    let master = Master::join(&mut world);
    for before in [0x7FFF_0000, 0xFFFF_0000] {
        lose(&mut world, Loss::Compare { channel: 3 }, 1);
        poke(&mut world, 0x4000_0024, before);
        master.send(&mut world, 0x000, &[0x80, 1]);
        run(&mut world, SECOND);
        let before = run(&mut world, SECOND).nodes[0].heard.heartbeats;
        assert_eq!(run(&mut world, SECOND * 5).nodes[0].heard.heartbeats - before, 5);
    }
}

/// Every interrupt at the end of a transmission is lost: the waiting frames are sent a millisecond later.
#[test]
fn a_lost_end_of_a_transmission_holds_nothing_up() {
    const REQUESTS: usize = 100;
    let mut world = world("--bitrate 1000");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    write(&mut world, &master, (0x1800, 2), 1, 1);
    lose(&mut world, Loss::TransmitComplete, 100_000);
    world.take_frames();
    let (mut answers, mut tpdos) = (0, 0);
    for _ in 0..REQUESTS {
        master.send(&mut world, SYNC, &[]);
        master.send(&mut world, 0x601, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
        world.run_until(world.now() + Time::from_micros(2997));
        let frames = world.take_frames();
        let of = |id| frames.iter().filter(|stamped| stamped.frame.id() == frame(id, &[]).id()).count();
        answers += of(SDO_RESPONSE);
        tpdos += of(TPDO1);
    }
    assert_eq!((answers, tpdos), (REQUESTS, REQUESTS));
    assert_silent(&mut world);
}

/// A frame is to be replaced by more urgent ones, but its transmission begins at that very moment. The frame is sent
/// once, whether or not this transmission succeeds.
#[test]
fn a_frame_that_makes_way_too_late_is_sent_once() {
    const MORE_URGENT: u16 = 0x001;
    const HEARTBEAT: u16 = 0x701;
    const EVENT_TIMER: (u16, u8) = (0x6200, 0);
    const HEARTBEAT_TIME: (u16, u8) = (0x1017, 0);
    for (seed, noise) in [(1, 0.0), (1, 0.4), (2, 0.4), (3, 0.4), (4, 0.4)] {
        let (mut world, master) = start("");
        write(&mut world, &master, EVENT_TIMER, 2, 1700);
        // The heartbeat period begins with the write: two heartbeats become due on the full bus, and none in the half
        // second after it.
        write(&mut world, &master, HEARTBEAT_TIME, 2, 1000);
        master.send(&mut world, START_ALL.0, &START_ALL.1);
        wait(&mut world, 50);
        lose(&mut world, Loss::Abort, 1);
        world.take_frames();
        // No gap for two seconds. Meanwhile heartbeat, SDO response, TPDO 2 and TPDO 1 are queued, each more urgent
        // than the ones before.
        for step in 0..20 {
            (0..if step == 0 { 1000 } else { 900 })
                .for_each(|_| master.send(&mut world, MORE_URGENT, &[0x55; 8]));
            if step == 10 {
                master.send(&mut world, 0x601, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
            }
            if step == 12 {
                master.send(&mut world, SYNC, &[]);
            }
            wait(&mut world, 100);
        }
        assert_eq!(world.machine(0).peripherals().late_aborts(), 0, "a frame was to make way");
        world.bus().faults.noise(seed, noise);
        let silent = world.take_frames();
        let of = |frames: &[canbus::Stamped], id| {
            frames.iter().filter(|stamped| stamped.frame.id() == frame(id, &[]).id()).count()
        };
        assert_eq!(of(&silent, HEARTBEAT), 0, "the bus was full");
        wait(&mut world, 500);
        world.bus().faults.quiet();
        wait(&mut world, 20);
        let told = world.take_frames();
        assert_eq!((of(&told, SDO_RESPONSE), of(&told, TPDO2)), (1, 1));
        // The heartbeat in the mailbox and the newest one.
        assert_eq!(of(&told, HEARTBEAT), 2, "noise {seed} {noise}");
        let summary = run(&mut world, Time::ZERO);
        assert!(summary.nodes[0].incidents.is_empty(), "{summary}");
    }
}

/// Stores into the backup memory are lost: the next millisecond repeats them.
#[test]
fn a_lost_write_to_the_backup_memory_is_made_good() {
    let (mut world, master) = start("--shaft rpm:600");
    lose(&mut world, Loss::BackupStore, 100);
    assert!(counted(&mut world, &master, BACKUP_WRITES) >= 2);
    let now = world.now();
    let here = world.machine(0).peripherals().plant().revolutions(now);
    stimulate(&mut world, "shaft", &format!("const:{here}"));
    wait(&mut world, 10);
    let expected = read(&mut world, &master, POSITION);
    assert_silent(&mut world);
    cycle_power(&mut world);
    assert_eq!(read(&mut world, &master, POSITION), expected);
}

/// The flash controller is busy for a second: a save in that time is refused, and the next save succeeds.
#[test]
fn a_flash_that_hangs_refuses_a_save_and_takes_the_next() {
    const SAVE: [u8; 8] = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
    let mut world = running();
    let master = Master::join(&mut world);
    write(&mut world, &master, (0x4000, 1), 4, 0x0403_0201);
    let until = world.now() + SECOND;
    world.machine(0).peripherals_mut().flash_mut().hang(until);
    let answer = master.ask(&mut world, 1, &SAVE);
    let code = u32::from_le_bytes(answer[4..].try_into().unwrap());
    assert_eq!((answer[0], code), (0x80, 0x0606_0000), "{answer:02x?}");
    assert!(world.now() < until, "it is told soon");
    assert!(counted(&mut world, &master, FLASH) >= 1);
    world.run_until(until);
    assert_eq!(master.ask(&mut world, 1, &SAVE)[0], 0x60);
    assert_silent(&mut world);
}

/// Runs until the sampling task starts again.
fn to_the_next_sample(world: &mut World) {
    let before = world.machine(0).stats().of(SAMPLING_TASK).entries;
    while world.machine(0).stats().of(SAMPLING_TASK).entries == before {
        world.run_until(world.now() + Time::from_micros(10));
    }
}

/// One of the two DMA streams of the absolute encoder stops in the middle of a word; without the receiving stream, the
/// SPI has an overrun.
#[test]
fn a_stream_of_the_absolute_encoder_that_stops_is_started_again() {
    let (mut world, master) = turning(true);
    for (number, stream) in (1..).zip([DMA1_S3CR, DMA1_S4CR, DMA1_S3CR, DMA1_S4CR]) {
        // In the middle of a word, which lasts 57 us.
        to_the_next_sample(&mut world);
        world.run_until(world.now() + Time::from_micros(20));
        poke(&mut world, stream, 0);
        assert_eq!(counted(&mut world, &master, SSI_WORDS), number);
        assert!(oldest(&mut world, &master, true) < 2200.0);
    }
    assert_eq!(read(&mut world, &master, SENSOR_STATE), 0);
    assert_silent(&mut world);
}

/// The sampling interrupts are blocked for two milliseconds: of the two waiting samples, the newer one counts.
#[test]
fn uncollected_milliseconds_are_counted() {
    const INTERRUPTS: u32 = 0x18;
    let (mut world, master) = turning(false);
    to_the_next_sample(&mut world);
    world.run_until(world.now() + Time::from_micros(500));
    let control = peek(&mut world, DMA2_S0CR);
    poke(&mut world, DMA2_S0CR, control & !INTERRUPTS);
    world.run_until(world.now() + Time::from_micros(1900));
    poke(&mut world, DMA2_S0CR, control);
    assert_eq!(counted(&mut world, &master, MILLISECONDS), 1);
    assert!(oldest(&mut world, &master, false) < 1200.0);
    assert_eq!(read(&mut world, &master, (0x2001, SAMPLING)), 0);
    assert_silent(&mut world);
}

/// The interrupt for bus-off is lost: the node also polls the state every 20 ms.
#[test]
fn a_bus_off_without_its_interrupt_is_noticed() {
    let _expected = expects([Rule::HeartbeatLate]);
    const CAN1_IER: u32 = 0x4000_6414;
    const ERRIE: u32 = 1 << 15;
    let mut world = running();
    let enabled = peek(&mut world, CAN1_IER);
    poke(&mut world, CAN1_IER, enabled & !ERRIE);
    world.bus().faults.noise(1, 1.0);
    world.run_until(world.now() + SECOND);
    world.bus().faults.quiet();
    let silent = world.traffic().node(1);
    let after = run(&mut world, SECOND * 3);
    let node = &after.nodes[0];
    assert!(node.heard.heartbeats > silent.heartbeats && node.heard.emcys > silent.emcys, "{after}");
    assert!(node.incidents.is_empty() && node.heard.boot_ups == 1, "{after}");
}
