//! The application `cargo sim`: builds the world from the command line, runs and displays it, and returns the summary.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::thread;
use std::time::Instant;

use anyhow::{Context, Result};
use canbus::{Record, Stamped, Time};

use crate::cli::{Options, Speed};
use crate::console::{self, Command};
use crate::control::Control;
use crate::display::Display;
use crate::gateway::{BUS_NAME, Gateway, Protocol};
use crate::greeting::Greeting;
use crate::host_time::{HostTime, Work};
use crate::keeper::Keeper;
use crate::pace::Pace;
use crate::page::{Connections, Page};
use crate::setup;
use crate::summary::Summary;
use crate::world::World;

/// The address for a socketcand port that only this machine can reach; the port is any free one.
const ANY_PORT: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0);

/// Period of serving clients, commands and the display, in virtual time.
const STEP: Time = Time::from_millis(1);

/// The standard output cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write the standard output: {0}")]
pub struct Output(io::Error);

impl Output {
    /// Whether the reader has closed its end, as `head` does.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.0.kind() == io::ErrorKind::BrokenPipe
    }
}

/// A running simulation.
struct App {
    world: World,
    gateway: Gateway,
    display: Display,
    commands: Option<Receiver<String>>,
    keeper: Option<Keeper>,
    control: Option<Control>,
    /// The program that serves the page; it ends when this value is dropped.
    _page: Option<Page>,
    candump: Option<BufWriter<File>>,
    interrupted: Arc<AtomicBool>,
    options: Options,
    host_time: HostTime,
}

/// Runs for the requested duration or until the user ends the run, and returns the summary.
pub fn run(options: Options) -> Result<Summary> {
    let mut app = App::open(options)?;
    let started = Instant::now();
    let outcome = app.run();
    let host = started.elapsed().as_secs_f64();
    app.close()?;
    outcome?;
    let mut summary = app.world.summary(host, app.gateway.lost());
    summary.host_time = summary.host_time.map(|world| world.and(&app.host_time));
    Ok(summary)
}

impl App {
    fn open(options: Options) -> Result<App> {
        let mut gateway = Gateway::new()?;
        let socketcand = gateway.listen(options.socketcand, Protocol::Socketcand)?;
        let slcan = options.slcan.map(|address| gateway.listen(address, Protocol::Slcan)).transpose()?;
        let mut world = setup::world(&options)?;
        if options.threads.is_none() {
            world.set_threads(thread::available_parallelism().unwrap_or(NonZeroUsize::MIN));
        }
        if let Some(interface) = &options.socketcan {
            gateway.attach_interface(interface, &mut world)?;
        }
        let candump = options.candump.as_ref().map(|path| {
            File::create(path).map(BufWriter::new).with_context(|| format!("cannot write {}", path.display()))
        });
        let candump = candump.transpose()?;
        let interrupted = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&interrupted);
        ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).context("cannot catch Ctrl-C")?;
        let asked = options.page();
        // The page needs a control connection, even if the user has requested none.
        let control = options.control.or(asked.map(|_| ANY_PORT)).map(Control::listen).transpose()?;
        let control_address = control.as_ref().map(Control::address).transpose()?;
        let page = match (asked, control_address) {
            (Some((page, program)), Some(control)) => {
                let socketcand = gateway.listen(ANY_PORT, Protocol::Page)?;
                Some(Page::start(program, &Connections { socketcand, control, page }))
            }
            _ => None,
        };
        let greeting = Greeting {
            options: &options,
            socketcand,
            slcan,
            control: control_address,
            page: page.as_ref().map(Page::address),
            boards: world.boards(),
        };
        let display = if options.json {
            writeln!(io::stdout(), "{}", greeting.json()).map_err(Output)?;
            Display::quiet()
        } else {
            Display::open(&greeting.lines()).map_err(Output)?
        };
        if options.speed == Speed::Max {
            world.measure_host_time();
        }
        let keeper = options.flash.clone().map(Keeper::new);
        let commands = (!display.takes_commands()).then(console::lines);
        Ok(App {
            world,
            gateway,
            display,
            commands,
            keeper,
            control,
            _page: page,
            candump,
            interrupted,
            options,
            host_time: HostTime::default(),
        })
    }

    fn run(&mut self) -> Result<()> {
        let end = self.options.duration.unwrap_or(Time::NEVER);
        let mut pace = (self.options.speed == Speed::Real).then(Pace::new);
        while self.world.now() < end && !self.interrupted.load(Ordering::Relaxed) {
            self.step(end)?;
            if let Some(pace) = &mut pace {
                pace.wait(self.world.now());
            }
        }
        Ok(())
    }

    /// One step of a millisecond: clients, world and display.
    fn step(&mut self, end: Time) -> Result<()> {
        let start = Instant::now();
        self.gateway.poll(&mut self.world);
        if self.control.as_mut().is_some_and(|control| control.poll(&mut self.world)) {
            self.obey(Command::Quit);
        }
        self.host_time.count(Work::Clients, start);
        self.world.run_until(end.min(self.world.now() + STEP));
        let start = Instant::now();
        self.gateway.deliver(&mut self.world);
        let start = self.host_time.count(Work::Clients, start);
        self.write_candump()?;
        if let Some(keeper) = &mut self.keeper {
            keeper.look(self.world.boards(), Instant::now())?;
        }
        self.show()?;
        self.host_time.count(Work::Output, start);
        Ok(())
    }

    fn write_candump(&mut self) -> Result<()> {
        let frames = self.world.take_frames();
        let Some(candump) = &mut self.candump else { return Ok(()) };
        for Stamped { at, frame } in frames {
            let record = Record { at, interface: BUS_NAME.to_owned(), frame };
            writeln!(candump, "{record}").context("cannot write the candump file")?;
        }
        Ok(())
    }

    fn show(&mut self) -> Result<()> {
        for line in self.world.take_log() {
            if line.level >= self.options.log {
                self.display.log(&line).map_err(Output)?;
            }
        }
        let typed = self.display.update(self.world.now(), || self.world.status()).map_err(Output)?;
        if let Some(command) = typed {
            self.obey(command);
        }
        while let Some(line) = self.commands.as_ref().and_then(|lines| lines.try_recv().ok()) {
            match console::parse(&line, &[]) {
                Some(Ok(command)) => self.obey(command),
                Some(Err(error)) => self.display.say(error),
                None => {}
            }
        }
        Ok(())
    }

    fn obey(&mut self, command: Command) {
        match command {
            Command::Quit => self.interrupted.store(true, Ordering::Relaxed),
            Command::Stimulus(stimulus) => {
                if let Err(error) = self.world.apply(&stimulus) {
                    self.display.say(error.to_string());
                }
            }
        }
    }

    /// Writes the files that outlive the run.
    fn close(&mut self) -> Result<()> {
        if let Some(candump) = &mut self.candump {
            candump.flush().context("cannot write the candump file")?;
        }
        self.keeper.as_ref().map_or(Ok(()), |keeper| keeper.close(self.world.boards()))
    }
}
