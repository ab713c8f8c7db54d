//! EXTI: interrupts at edges on pins and other lines (RM0390 section 10.3, RM0090 section 12.3).

const IMR: u32 = 0x00;
const EMR: u32 = 0x04;
const RTSR: u32 = 0x08;
const FTSR: u32 = 0x0C;
const SWIER: u32 = 0x10;
const PR: u32 = 0x14;

const LINES: u32 = 0x007F_FFFF;

/// The interrupts: a mask of EXTI lines, and their common IRQ.
const IRQS: [(u32, u8); 13] = [
    (1 << 0, 6),
    (1 << 1, 7),
    (1 << 2, 8),
    (1 << 3, 9),
    (1 << 4, 10),
    (0x1F << 5, 23),
    (0x3F << 10, 40),
    (1 << 16, 1),
    (1 << 17, 41),
    (1 << 18, 42),
    (1 << 20, 76),
    (1 << 21, 2),
    (1 << 22, 3),
];

#[derive(Clone, Debug, Default)]
pub(crate) struct Exti {
    interrupt: u32,
    event: u32,
    rising: u32,
    falling: u32,
    software: u32,
    pending: u32,
}

impl Exti {
    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            IMR => Some(self.interrupt),
            EMR => Some(self.event),
            RTSR => Some(self.rising),
            FTSR => Some(self.falling),
            SWIER => Some(self.software),
            PR => Some(self.pending),
            _ => None,
        }
    }

    /// `None` for an unknown register and for EMR: an event would only wake a core that sleeps in WFE.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        let value = value & LINES;
        match offset {
            IMR => self.interrupt = value,
            EMR => {
                self.event = value;
                return (value == 0).then_some(());
            }
            RTSR => self.rising = value,
            FTSR => self.falling = value,
            SWIER => {
                self.pending |= value & !self.software & self.interrupt;
                self.software |= value;
            }
            PR => {
                self.pending &= !value;
                self.software &= !value;
            }
            _ => return None,
        }
        Some(())
    }

    /// An edge on a line.
    pub(crate) fn edge(&mut self, line: u32, rising: bool) {
        let selected = if rising { self.rising } else { self.falling };
        self.pending |= 1 << line & selected & self.interrupt;
    }

    /// Whether an edge on a line would raise an interrupt.
    pub(crate) fn listens(&self, line: u32) -> bool {
        (self.interrupt & (self.rising | self.falling)) >> line & 1 != 0
    }

    /// Levels of the interrupt lines.
    pub(crate) fn interrupts(&self) -> impl Iterator<Item = (u8, bool)> {
        let raised = self.pending & self.interrupt;
        IRQS.iter().map(move |(lines, irq)| (*irq, raised & lines != 0))
    }
}
