//! Connections of the pins on the board, apart from levels that a test drives:
//!
//! | pins | connection |
//! |---|---|
//! | PB5, PB6, PB7 | index, A and B of the incremental encoder: TIM3 channel 2, TIM4 channels 1 and 2 |
//! | PB13, PB14 | clock and data of the absolute encoder: SPI2 |
//! | those of the board | buttons: [`crate::Board::buttons`] |

use canbus::Time;

use crate::gpio::Outside;
use crate::map::TIM3_CHANNEL_2;
use crate::plant::first_change;
use crate::stm32f4::Stm32f4;

const PORT_B: usize = 1;
const INDEX: u32 = 5;
const PHASE_A: u32 = 6;
const PHASE_B: u32 = 7;
const SSI_CLOCK: u32 = 13;
const SSI_DATA: u32 = 14;
/// AF2 is TIM3 on PB5 and TIM4 on PB6 and PB7 (DS10693 table 11).
const TIMER_FUNCTION: u32 = 2;
/// AF5 is SPI2 on PB13 and PB14.
const SPI_FUNCTION: u32 = 5;
const SPI2: usize = 1;
const TIM3: usize = 1;
const TIM4: usize = 2;
/// How far the search for edges looks ahead.
const HORIZON: Time = Time::from_millis(1);

impl Stm32f4 {
    /// The levels that the outside world drives on the pins of a port.
    pub(crate) fn outside(&self, port: usize, now: Time) -> Outside {
        let mut outside = self.outside[port];
        if port == PORT_B {
            let (a, b) = self.plant.phases(now);
            outside.set(INDEX, Some(self.plant.index(now)));
            outside.set(PHASE_A, Some(a));
            outside.set(PHASE_B, Some(b));
        }
        self.press(port, &mut outside, now);
        outside
    }

    /// Applies the pressed buttons. A level that a test drives has priority.
    fn press(&self, port: usize, outside: &mut Outside, now: Time) {
        for (button, closed) in self.board.buttons.into_iter().zip(self.plant.closed(now)) {
            if button.port == port && outside.level(button.pin).is_none() {
                outside.set(button.pin, if closed { Some(button.pressed) } else { button.released });
            }
        }
    }

    /// Whether the absolute encoder is connected to this SPI: only to SPI2, while both of its pins are switched to SPI2
    /// and the SPI is in the mode that SSI needs.
    pub(crate) fn ssi_is_wired(&self, spi: usize) -> bool {
        spi == SPI2
            && self.spis[spi].fits_ssi()
            && [SSI_CLOCK, SSI_DATA].iter().all(|&pin| self.ports[PORT_B].alternate(pin, SPI_FUNCTION))
    }

    /// The level that an SPI reads from an undriven line.
    pub(crate) fn open_input(&self, spi: usize) -> bool {
        spi == SPI2 && self.ports[PORT_B].level(SSI_DATA, self.outside[PORT_B])
    }

    /// The encoder's position as a timer sees it, in quarter periods; `None` when no encoder is connected to the timer.
    /// Only TIM4 is wired, and only while both of its pins are switched to TIM4.
    pub(crate) fn encoder_position(&self, timer: usize, now: Time) -> Option<i64> {
        let wired = timer == TIM4
            && [PHASE_A, PHASE_B].iter().all(|&pin| self.ports[PORT_B].alternate(pin, TIMER_FUNCTION));
        wired.then(|| self.plant.quarter(now))
    }

    /// Drives a pin from outside, or releases it (port `'A'` to `'I'`, pin 0 to 15). The pins of the encoder cannot be
    /// driven.
    pub fn drive(&mut self, port: char, pin: u32, level: Option<bool>, now: Time) {
        let Some(index) =
            (port as usize).checked_sub('A' as usize).filter(|&index| index < self.outside.len())
        else {
            return;
        };
        let before = self.ports[index].level(pin, self.outside(index, now));
        self.outside[index].set(pin, level);
        let after = self.ports[index].level(pin, self.outside(index, now));
        if before != after && self.syscfg.port_of_line(pin) == index {
            self.exti.edge(pin, after);
        }
        self.settle(now);
    }

    /// Whether EXTI or TIM3 waits for edges of the index.
    fn index_is_watched(&self) -> bool {
        let by_exti = self.exti.listens(INDEX) && self.syscfg.port_of_line(INDEX) == PORT_B;
        by_exti || self.index_is_captured()
    }

    fn index_is_captured(&self) -> bool {
        self.ports[PORT_B].alternate(INDEX, TIMER_FUNCTION) && self.timers[TIM3].listens(1)
    }

    /// Passes on an edge of the index that is due. Each edge is a deadline, so edges come one at a time.
    pub(crate) fn watch_index(&mut self, now: Time) {
        let level = self.plant.index(now);
        let changed = level != self.index_level;
        self.index_level = level;
        if !changed || !self.index_is_watched() {
            return;
        }
        if self.syscfg.port_of_line(INDEX) == PORT_B {
            self.exti.edge(INDEX, level);
        }
        if self.index_is_captured() {
            self.run_timer(TIM3, now);
            if self.timers[TIM3].capture(1, level) {
                self.copy_count(&TIM3_CHANNEL_2, now);
            }
        }
    }

    /// The next instant at which the encoder has a visible effect, or at which the search for one must go on.
    pub(crate) fn encoder_deadline(&self, now: Time) -> Time {
        let horizon = now + HORIZON;
        let index =
            self.index_is_watched().then(|| self.plant.next_index_edge(now, horizon).unwrap_or(horizon));
        let count = self.timers[TIM4]
            .watches_encoder()
            .then(|| self.next_count_event(now, horizon).unwrap_or(horizon));
        index.unwrap_or(Time::NEVER).min(count.unwrap_or(Time::NEVER))
    }

    fn next_count_event(&self, now: Time, horizon: Time) -> Option<Time> {
        first_change(now, horizon, |at| self.timers[TIM4].rises_at(self.encoder_position(TIM4, at)))
    }
}
