//! GPIO, EXTI, SPI, CRC and the signature.

use canbus::Time;
use chip::plant::{Motion, Signal};
use chip::{Board, Peripherals, SsiFormat, Stm32f4, Variant};

use crate::support::{AHB1ENR, APB1ENR, APB2ENR, Rig};

const GPIOA: u32 = 0x4002_0000;
const GPIOB: u32 = 0x4002_0400;
const GPIOC: u32 = 0x4002_0800;
const EXTI: u32 = 0x4001_3C00;
const SYSCFG: u32 = 0x4001_3800;
const SPI2: u32 = 0x4000_3800;
const SPI2_IRQ: u8 = 36;
const DMA1: u32 = 0x4002_6000;
const CRC: u32 = 0x4002_3000;

#[test]
fn an_output_is_seen_outside_and_read_back() {
    let mut rig = Rig::new();
    rig.set(AHB1ENR, 1);
    assert_eq!(rig.chip.output('A', 5), None, "an input after reset");
    rig.set(GPIOA, 1 << 10);
    rig.write(GPIOA + 0x18, 1 << 5);
    assert_eq!(rig.chip.output('A', 5), Some(true));
    assert_eq!(rig.read(GPIOA + 0x10) >> 5 & 1, 1);
    rig.write(GPIOA + 0x18, 1 << 21);
    assert_eq!(rig.chip.output('A', 5), Some(false));
    rig.write(GPIOA + 0x04, 1 << 5);
    rig.write(GPIOA + 0x18, 1 << 5);
    assert_eq!(rig.chip.output('A', 5), None, "open drain lets go");
}

#[test]
fn an_input_is_driven_from_outside_or_pulled() {
    let mut rig = Rig::new();
    rig.set(AHB1ENR, 1 << 2);
    rig.write(GPIOC + 0x0C, 1 << 26);
    assert_eq!(rig.read(GPIOC + 0x10) >> 13 & 1, 1, "pulled up");
    rig.chip.drive('C', 13, Some(false), rig.now);
    assert_eq!(rig.read(GPIOC + 0x10) >> 13 & 1, 0);
    rig.write(GPIOC, 3 << 26);
    rig.chip.drive('C', 13, Some(true), rig.now);
    assert_eq!(rig.read(GPIOC + 0x10) >> 13 & 1, 0, "analogue");
}

#[test]
fn a_button_pulls_its_pin_to_ground() {
    let mut rig = Rig::new();
    rig.set(AHB1ENR, 1 << 2);
    let pins = |rig: &mut Rig| (rig.read(GPIOC + 0x10) >> 13 & 1, rig.read(GPIOC + 0x10) >> 10 & 1);
    assert_eq!(pins(&mut rig), (1, 0), "the first one has a resistor, the second one floats");
    rig.write(GPIOC + 0x0C, 1 << 20);
    assert_eq!(pins(&mut rig), (1, 1));
    for (push, expected) in [("1:down", (0, 1)), ("2:down", (0, 0)), ("1:up", (1, 0))] {
        let now = rig.now;
        rig.chip.plant_mut(now).push(push.parse().expect("a push"), now);
        rig.wait(Time::from_millis(5));
        assert_eq!(pins(&mut rig), expected, "{push}");
    }
}

#[test]
fn an_edge_on_the_selected_port_is_an_interrupt() {
    let mut rig = Rig::new();
    rig.set(AHB1ENR, 0b111);
    rig.set(APB2ENR, 1 << 14);
    rig.write(SYSCFG + 0x14, 2 << 4);
    rig.write(EXTI + 0x0C, 1 << 13);
    rig.write(EXTI, 1 << 13);
    rig.chip.drive('C', 13, Some(true), rig.now);
    rig.chip.drive('A', 13, Some(true), rig.now);
    rig.chip.drive('A', 13, Some(false), rig.now);
    assert!(!rig.irq(40), "a rising edge, and another port");
    rig.chip.drive('C', 13, Some(false), rig.now);
    assert!(rig.irq(40));
    rig.write(EXTI + 0x14, 1 << 13);
    assert!(!rig.irq(40));
    rig.write(EXTI + 0x10, 1 << 13);
    assert!(rig.irq(40), "by software");
}

fn with_ssi() -> Rig {
    let mut rig = Rig::new();
    let ssi = SsiFormat { gray: false, ..SsiFormat::default() };
    rig.chip = Stm32f4::new(Variant::F446, Board { ssi, ..Board::default() });
    rig.set(AHB1ENR, 1 << 21 | 1 << 1);
    rig.set(APB1ENR, 1 << 14);
    // PB13 and PB14 to SPI2, a pull-up at the data.
    rig.set(GPIOB, 0b10 << 26 | 0b10 << 28);
    rig.set(GPIOB + 0x0C, 1 << 28);
    rig.write(GPIOB + 0x24, 5 << 20 | 5 << 24);
    let motion = Motion::Angle(Signal::Constant(3.5));
    rig.chip.plant_mut(rig.now).set_shaft(motion, rig.now);
    rig
}

/// Master, software NSS high, PCLK / 16 = 1 MHz, CPOL and CPHA.
const MASTER: u32 = 1 << 9 | 1 << 8 | 3 << 3 | 1 << 2 | 0b11;
const SPE: u32 = 1 << 6;
const FRAMES_OF_16: u32 = 1 << 11;
/// The expected bits: rest level, 12 bits with 3 revolutions, 13 bits with half a turn, 6 zeros.
const WORD: u32 = 1 << 31 | (3 << 13 | 4096) << 6;

#[test]
fn an_absolute_encoder_is_read_in_frames_of_16_bits() {
    let mut rig = with_ssi();
    rig.write(SPI2, MASTER | SPE | FRAMES_OF_16);
    rig.write(SPI2 + 4, 1 << 6);
    let mut word = 0;
    for _ in 0..2 {
        let start = rig.now;
        rig.write(SPI2 + 0x0C, 0xFFFF);
        assert_eq!(rig.read(SPI2 + 8), 1 << 7 | 1 << 1, "BSY and TXE");
        assert_eq!(rig.run_to_irq(SPI2_IRQ, Time::from_millis(1)), Some(start + Time::from_micros(16)));
        assert_eq!(rig.read(SPI2 + 8), 1 << 1 | 1, "TXE and RXNE");
        word = word << 16 | rig.read(SPI2 + 0x0C);
        assert!(!rig.irq(SPI2_IRQ));
    }
    assert_eq!(word, WORD);
}

/// A whole word, as two frames of 16 bits.
fn exchange(rig: &mut Rig) -> u32 {
    let halves = [(); 2].map(|()| {
        rig.write(SPI2 + 0x0C, 0);
        rig.wait(Time::from_micros(16));
        rig.read(SPI2 + 0x0C)
    });
    rig.wait(Time::from_micros(50));
    halves[0] << 16 | halves[1]
}

#[test]
fn faults_of_the_absolute_encoder() {
    let mut rig = with_ssi();
    rig.write(SPI2, MASTER | SPE | FRAMES_OF_16);
    let fault = |rig: &mut Rig, name: &str| {
        let now = rig.now;
        rig.chip.plant_mut(now).clear_faults();
        rig.chip.plant_mut(now).add_fault(format!("{name}@0").parse().expect("a fault"));
    };
    assert_eq!(exchange(&mut rig), WORD);
    fault(&mut rig, "wrong-code");
    assert_eq!(exchange(&mut rig), 1 << 31 | (4 << 13) << 6, "half a revolution off");
    fault(&mut rig, "open-ssi");
    assert_eq!(exchange(&mut rig), u32::MAX, "pulled up");
    rig.write(GPIOB + 0x0C, 0);
    assert_eq!(exchange(&mut rig), 0);
    rig.chip.plant_mut(rig.now).clear_faults();
    assert_eq!(exchange(&mut rig), WORD);
}

#[test]
fn without_its_pins_the_spi_reads_no_encoder() {
    let mut rig = with_ssi();
    rig.write(SPI2, MASTER | SPE | FRAMES_OF_16);
    rig.write(GPIOB + 0x24, 5 << 24);
    assert_eq!(exchange(&mut rig), u32::MAX, "no clock");
}

#[test]
fn frames_of_8_bits_follow_each_other_without_a_gap() {
    let mut rig = with_ssi();
    rig.write(SPI2, MASTER | SPE);
    let mut word = 0;
    rig.chip.write(SPI2 + 0x0C, 1, 0xFF, rig.now).unwrap();
    for n in 0..4 {
        if n < 3 {
            rig.chip.write(SPI2 + 0x0C, 1, 0xFF, rig.now).unwrap();
            assert_eq!(rig.read(SPI2 + 8) & 0b10, 0, "one on the wire, one waiting");
        }
        rig.wait(Time::from_micros(8));
        word = word << 8 | rig.chip.read(SPI2 + 0x0C, 1, rig.now).unwrap();
    }
    assert_eq!(word, WORD);
}

#[test]
fn a_frame_that_finds_the_register_full_is_an_overrun() {
    let mut rig = with_ssi();
    rig.write(SPI2, MASTER | SPE | FRAMES_OF_16);
    for _ in 0..2 {
        rig.write(SPI2 + 0x0C, 0);
        rig.wait(Time::from_micros(16));
    }
    assert_eq!(rig.read(SPI2 + 8) >> 6 & 1, 1);
    assert_eq!(rig.read(SPI2 + 0x0C), WORD >> 16, "the first one stays");
    rig.read(SPI2 + 8);
    assert_eq!(rig.read(SPI2 + 8) >> 6 & 1, 0, "DR and then SR clear it");
}

#[test]
fn dma_runs_a_whole_exchange() {
    let mut rig = with_ssi();
    let (received, sent) = (0x2000_1000, 0x2000_2000);
    rig.memory.0.extend((sent..sent + 4).map(|address| (address, 0xFF)));
    let item = 1 << 11 | 1 << 13 | 1 << 10;
    // Stream 3 receives, stream 4 transmits; both on channel 0.
    for (stream, memory, direction) in [(3, received, 0), (4, sent, 1 << 6)] {
        let base = DMA1 + 0x10 + 0x18 * stream;
        rig.write(base + 4, 2);
        rig.write(base + 8, SPI2 + 0x0C);
        rig.write(base + 0x0C, memory);
        rig.write(base, item | direction | 1 << 4 | 1);
    }
    rig.write(SPI2 + 4, 0b11);
    rig.write(SPI2, MASTER | SPE | FRAMES_OF_16);
    let start = rig.now;
    assert_eq!(rig.run_to_irq(14, Time::from_millis(1)), Some(start + Time::from_micros(32)));
    let word = u32::from(rig.half_word(received)) << 16 | u32::from(rig.half_word(received + 2));
    assert_eq!(word, WORD);
}

#[test]
fn the_crc_unit_has_the_ethernet_polynomial() {
    let mut rig = Rig::new();
    rig.set(AHB1ENR, 1 << 12);
    assert_eq!(rig.read(CRC), u32::MAX);
    rig.write(CRC, 0x3132_3334);
    rig.write(CRC, 0x3536_3738);
    // CRC-32/MPEG-2 of "12345678", from an independent implementation.
    assert_eq!(rig.read(CRC), mpeg2(b"12345678"));
    rig.write(CRC + 8, 1);
    assert_eq!(rig.read(CRC), u32::MAX);
}

/// The CRC bit by bit, as the reference manual describes the unit.
fn mpeg2(bytes: &[u8]) -> u32 {
    bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte) << 24, |crc, _| {
            if crc >> 31 == 1 { crc << 1 ^ 0x04C1_1DB7 } else { crc << 1 }
        })
    })
}

#[test]
fn the_signature_names_the_chip() {
    let mut rig = Rig::new();
    rig.chip = Stm32f4::new(Variant::F446, Board { unique_id: [1, 2, 3], ..Board::default() });
    assert_eq!([0, 4, 8].map(|n| rig.read(0x1FFF_7A10 + n)), [1, 2, 3]);
    let half_word = |rig: &mut Rig, address| rig.chip.read(address, 2, rig.now).unwrap();
    assert_eq!(half_word(&mut rig, 0x1FFF_7A22), 512);
    assert_eq!(half_word(&mut rig, 0x1FFF_7A2A), 1502, "VREFIN_CAL");
    assert_eq!(half_word(&mut rig, 0x1FFF_7A2C), 959, "TS_CAL1");
    assert_eq!(half_word(&mut rig, 0x1FFF_7A2E), 1207, "TS_CAL2");
    assert!(rig.chip.unmodelled().is_empty());
}

#[test]
fn time_stamps_of_the_can_controller_are_on_record() {
    const CAN1_MCR: u32 = 0x4000_6400;
    let mut rig = Rig::new();
    rig.set(APB1ENR, 1 << 25);
    rig.write(CAN1_MCR, 1);
    assert!(rig.chip.unmodelled().is_empty());
    rig.write(CAN1_MCR, 1 | 1 << 7);
    let names: Vec<String> = rig.chip.unmodelled().into_iter().map(|entry| entry.name).collect();
    assert_eq!(names, ["CAN1+0x00"]);
}
