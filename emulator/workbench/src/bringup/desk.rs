//! The desk with an emulated board.

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

use anyhow::{Context, Result, bail};
use bringup::{Action, Desk};
use canbus::Time;
use canopen::Duration;
use chip::FrontEnd;
use nodectl::Network;
use nodectl::update::Image;
use programmer::flash::{Content, Part};
use sim::stimuli::Stimulus;
use sim::world::World;

use crate::bringup::adapter::{Adapter, Shared};

/// AIRCR with VECTKEY and SYSRESETREQ: the reset of a debug probe (ARMv7-M, B3.2.6).
const AIRCR: (u32, u32) = (0xE000_ED0C, 0x05FA_0004);
/// The seed of the noise on a bus that is short-circuited.
const NOISE_SEED: u64 = 1;

/// An emulated board, its probe, its adapter, and hands that do what they are asked to do.
pub struct EmulatedDesk {
    world: Shared,
    network: Network,
    programs: Vec<Part>,
    image: Image,
    /// A mistake of the operator, or of the wiring.
    pub mistake: Option<Mistake>,
}

/// A mistake that shows when hands act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mistake {
    /// The shaft turns the other way.
    Backwards,
    /// The shaft does not move the encoder.
    Loose,
    /// The pressure input is not connected.
    NoInput,
    /// The probe is not connected.
    NoProbe,
    /// The bus stays short-circuited.
    BusStaysShort,
}

impl EmulatedDesk {
    /// A desk with the first board of a world, whose images are in this directory.
    ///
    /// # Errors
    /// The images cannot be read.
    pub fn new(world: World, images: &Path) -> Result<EmulatedDesk> {
        let read =
            |name: &str| std::fs::read(images.join(name)).with_context(|| format!("cannot read {name}"));
        let content = Content::new(
            &read("bootloader")?,
            &read("firmware")?,
            programmer::sign::key::development(),
            Vec::new(),
        )?;
        let world = Rc::new(RefCell::new(world));
        let network = open(&world)?;
        let image = Image::parse(content.image().to_bytes())?;
        Ok(EmulatedDesk { world, network, programs: content.parts().collect(), image, mistake: None })
    }

    /// The world, for a fault.
    pub fn with<R>(&self, act: impl FnOnce(&mut World) -> R) -> R {
        act(&mut self.world.borrow_mut())
    }

    /// Resets the board, and lets it start.
    pub(crate) fn restart(&mut self) {
        // Nothing of the core can be missing.
        let _ = self.write(AIRCR.0, AIRCR.1);
        self.run(Duration::from_millis(2000));
    }

    fn run(&self, span: Duration) {
        let mut world = self.world.borrow_mut();
        let end = world.now() + Time::from_micros(span.0);
        world.run_until(end);
    }

    fn stimulate(&self, kind: &str, spec: &str) -> Result<()> {
        let stimulus = Stimulus::parse(kind, spec).map_err(|error| anyhow::anyhow!(error))?;
        Ok(self.with(|world| world.apply(&stimulus))?)
    }

    fn power_cycle(&self, seconds: f64) {
        let off =
            Duration(std::time::Duration::from_secs_f64(seconds).as_micros().try_into().unwrap_or(u64::MAX));
        self.with(|world| world.machine(0).power_off());
        self.run(off);
        self.with(|world| {
            let now = world.now();
            world.machine(0).power_on(now);
        });
    }

    /// PA0 is at VDDA itself: the transducer at its upper rail, with a supply that the divider brings to VDDA.
    fn lift_input(&self, is_direct: bool) {
        self.with(|world| {
            let now = world.now();
            let plant = world.machine(0).peripherals_mut().plant_mut(now);
            let FrontEnd { supply, divider, .. } = *plant.front_end();
            plant.rails.transducer = if is_direct { plant.rails.vdda / divider } else { supply };
        });
    }

    fn turn(&self) -> Result<()> {
        let step = match self.mistake {
            Some(Mistake::Loose) => return Ok(()),
            Some(Mistake::Backwards) => -1.0,
            _ => 1.0,
        };
        let from = self.with(|world| {
            let now = world.now();
            world.machine(0).peripherals().plant().revolutions(now)
        });
        self.stimulate("shaft", &format!("ramp:{from},{},2", from + step))?;
        self.run(Duration::from_millis(2500));
        Ok(())
    }
}

fn open(world: &Shared) -> Result<Network> {
    let world = Rc::clone(world);
    Ok(Network::open(move || Ok(Box::new(Adapter::join(&world, |_| ()))))?)
}

impl Desk for EmulatedDesk {
    fn words(&mut self, address: u32, count: usize) -> Result<Vec<u32>> {
        if self.mistake == Some(Mistake::NoProbe) {
            bail!("`probe-rs read` failed: no debug probes were found");
        }
        let read = |world: &mut World, address| {
            world.machine(0).debug_read(address).with_context(|| nothing_at(address))
        };
        self.with(|world| (address..).step_by(4).take(count).map(|address| read(world, address)).collect())
    }

    fn write(&mut self, address: u32, value: u32) -> Result<()> {
        self.with(|world| world.machine(0).debug_write(address, value).with_context(|| nothing_at(address)))
    }

    fn reset(&mut self) -> Result<()> {
        self.write(AIRCR.0, AIRCR.1)
    }

    fn log(&mut self, span: Duration) -> Result<Vec<String>> {
        self.run(span);
        Ok(self.with(|world| world.take_log().into_iter().map(|line| line.text).collect()))
    }

    fn network(&mut self) -> &mut Network {
        &mut self.network
    }

    /// The emulated adapters follow a change of the bit rate by LSS.
    fn set_bit_rate(&mut self, _: u16) -> Result<()> {
        self.network = open(&self.world)?;
        Ok(())
    }

    fn by_hand(&mut self, action: Action) -> Result<bool> {
        match action {
            Action::PowerCycle { seconds } => self.power_cycle(seconds),
            Action::HoldReceive { seconds } => {
                self.with(|world| world.bus().faults.noise(NOISE_SEED, 1.0));
                self.run(Duration::from_millis(u64::from(seconds) * 1000));
                self.with(|world| world.bus().faults.quiet());
                self.run(Duration::from_millis(1000));
            }
            Action::ShortBus => {
                self.with(|world| world.bus().faults.noise(NOISE_SEED, 1.0));
                self.run(Duration::from_millis(5000));
                if self.mistake != Some(Mistake::BusStaysShort) {
                    self.with(|world| world.bus().faults.quiet());
                }
            }
            Action::Input { .. } if self.mistake == Some(Mistake::NoInput) => {}
            Action::Input { percent: 0 } => {
                self.stimulate("fault", "rail-low:on")?;
                self.run(Duration::from_millis(100));
            }
            Action::Input { .. } => {
                self.stimulate("fault", "rail-low:off")?;
                self.stimulate("fault", "rail-high:on")?;
                self.lift_input(true);
                self.run(Duration::from_millis(100));
            }
            Action::Transducer => {
                self.lift_input(false);
                self.stimulate("fault", "rail-high:off")?;
            }
            Action::Turn => self.turn()?,
        }
        Ok(true)
    }

    fn programs(&self) -> &[Part] {
        &self.programs
    }

    fn image(&self) -> &Image {
        &self.image
    }
}

fn nothing_at(address: u32) -> String {
    format!("nothing is at {address:#010x}")
}
