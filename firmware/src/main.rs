//! The application: wiring only. Every task is bound to one interrupt; a task wakes another one by pending its
//! interrupt. A task that is pended while it runs will run again, so no request is lost.
//!
//! | priority | task | why there |
//! |---|---|---|
//! | 6 | `receive_process`, `receive_services` | a FIFO of three places fills in 141 us at 1 Mbit/s |
//! | 5 | `sample` | above everything whose run time depends on the traffic, except the moving of frames |
//! | 4 | `transmit` | the mailboxes hold three frames; locking the queue delays no sample |
//! | 3 | `process` | SYNC, RPDO, TPDO: never behind an SDO transfer |
//! | 2 | `serve` | SDO, NMT, heartbeat, EMCY, errors of the bus |
//! | 1 | `store` | stores parameters; may block in flash writes, so it has the lowest priority |
//! | 0 | `idle` | sleeps |
//!
//! Log lines mask no interrupt, whatever the priority: see the features of defmt-rtt in the workspace.
#![no_std]
#![no_main]

mod bit_rate;
mod bus;
mod configuration;
mod exchange;
mod position_inputs;
mod power_on;
mod process;
mod services;
mod shared;
mod storage_task;

use bsp::pac::Interrupt;
use canopen::Duration;

/// Pended to wake the process data task.
const PROCESS: Interrupt = Interrupt::TIM2;
/// Pended to wake the services task.
const SERVICES: Interrupt = Interrupt::CAN1_SCE;
/// Pended to wake the storage task. The interrupt belongs to a peripheral that the board does not use.
const STORAGE: Interrupt = Interrupt::SDIO;
/// Pended when samples are missing.
const SAMPLING: Interrupt = Interrupt::DMA2_STREAM0;
/// Pended after a frame was put into the transmit queue.
const TRANSMIT: Interrupt = Interrupt::CAN1_TX;
/// The node joins the bus when its first sample has been taken, so that no PDO carries an older value.
const FIRST_SAMPLE: Duration = Duration::from_millis(2);

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    bsp::chip::crash::panicked(info.location())
}

defmt::timestamp!("{=u64:us}", bsp::Clock::now().0);

#[rtic::app(device = bsp::pac, peripherals = true)]
mod app {
    use core::mem::MaybeUninit;

    use bsp::can::filters::Fifo;
    use bsp::can::transmit_queue::TransmitQueue;
    use bsp::losses::Losses;
    use bsp::policy::supervision::Part;
    use bsp::power::reset_cause::ResetCause;
    use bsp::{
        BackupMemory, Board, Buttons, Clock, FrontEnd, Reading, ReceiveQueue, Receiver, TaskEnd,
        TimeInterrupt, Transmitter, Watchdog,
    };
    use node::{Measurement, Protocol, StoreJob, StoredPositionRecord};
    use profiles::board::{Board as Surroundings, Inputs, RETAINED_WORDS};

    use crate::configuration::Loaded;
    use crate::exchange::Exchange;
    use crate::position_inputs::PositionReader;
    use crate::process::Process;
    use crate::services::{Services, StartUpFaults};
    use crate::storage_task::StorageTask;
    use crate::{FIRST_SAMPLE, PROCESS, SERVICES, configuration, power_on};

    #[shared]
    struct Shared {
        protocol: &'static mut Protocol,
        transmit: TransmitQueue,
        exchange: Exchange,
        watchdog: Watchdog,
    }

    #[local]
    struct Local {
        receiver_process: Receiver,
        receiver_services: Receiver,
        front_end: FrontEnd,
        inputs: Inputs,
        position: PositionReader,
        buttons: Buttons,
        measurement: &'static mut Measurement,
        transmitter: Transmitter,
        time: TimeInterrupt,
        process: Process,
        services: Services,
        storage: StorageTask,
        backup: BackupMemory,
    }

    #[init(local = [
        process_queue: ReceiveQueue = ReceiveQueue::new(),
        services_queue: ReceiveQueue = ReceiveQueue::new(),
        lost: Losses = Losses::new(),
        // Too large to be moved through the stack.
        protocol: MaybeUninit<Protocol> = MaybeUninit::uninit(),
        measurement_place: MaybeUninit<Measurement> = MaybeUninit::uninit(),
        job: MaybeUninit<StoreJob> = MaybeUninit::uninit(),
    ])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let lost: &'static Losses = cx.local.lost;
        let board = Board::start(cx.device, lost);
        let Loaded { protocol, parameters, setup, rate, boot_data, memory, position_record } =
            configuration::load(board.parameters, cx.local.protocol);
        let job = cx.local.job.write(StoreJob::new(setup.personality));
        let storage = StorageTask::new(memory, job, StoredPositionRecord::new(position_record));
        let crashed = configuration::report_start(&setup, board.reset_cause);
        let start_up_faults = StartUpFaults { crashed, no_store: !storage.is_working(), boot_data };
        let watchdog_reset = board.reset_cause == ResetCause::IndependentWatchdog;
        let surroundings = Surroundings { watchdog_reset, ..Surroundings::default() };
        let (receiver_process, process_frames) = Receiver::new(Fifo::Process, cx.local.process_queue, lost);
        let (receiver_services, service_frames) =
            Receiver::new(Fifo::Services, cx.local.services_queue, lost);
        let [process_alarm, mut services_alarm] = board.alarms;
        services_alarm.set(Clock::now() + FIRST_SAMPLE);
        let shared = Shared {
            protocol,
            transmit: TransmitQueue::new(),
            exchange: Exchange::new(parameters),
            watchdog: board.watchdog.supervise(),
        };
        let mut local = Local {
            receiver_process,
            receiver_services,
            front_end: board.front_end,
            inputs: Inputs::default(),
            position: PositionReader::new(board.ssi, surroundings),
            buttons: board.buttons,
            measurement: power_on::make(
                cx.local.measurement_place,
                setup.personality,
                board.reset_cause,
                &board.backup_state,
                position_record,
            ),
            transmitter: board.transmitter,
            time: board.time,
            process: Process::new(process_frames, process_alarm, board.lamps, lost),
            services: Services::new(
                board.can,
                rate,
                service_frames,
                lost,
                services_alarm,
                (board.led, board.indicators),
                start_up_faults,
            ),
            storage,
            backup: board.backup,
        };
        local.front_end.start();
        (shared, local)
    }

    #[idle]
    fn idle(_: idle::Context) -> ! {
        loop {
            bsp::sleep();
        }
    }

    #[task(binds = CAN1_RX0, priority = 6, local = [receiver_process])]
    fn receive_process(cx: receive_process::Context) {
        let _end = TaskEnd;
        cx.local.receiver_process.drain();
        rtic::pend(PROCESS);
    }

    #[task(binds = CAN1_RX1, priority = 6, local = [receiver_services])]
    fn receive_services(cx: receive_services::Context) {
        let _end = TaskEnd;
        cx.local.receiver_services.drain();
        rtic::pend(SERVICES);
    }

    /// Runs once a millisecond, when the DMA controller has filled a half of its buffer.
    #[task(binds = DMA2_STREAM0, priority = 5, local = [front_end, inputs, position, buttons, measurement, backup],
           shared = [exchange, &watchdog])]
    fn sample(mut cx: sample::Context) {
        let _end = TaskEnd;
        let Some(Reading { sums, counted }) = cx.local.front_end.take() else { return };
        let sample::LocalResources { inputs, position, measurement, backup, buttons, .. } = cx.local;
        (inputs.analogue, inputs.digital) = (configuration::raw_sample(&sums), buttons.sample());
        cx.shared.exchange.lock(|exchange| {
            if let Some(new) = &exchange.parameters {
                measurement.apply(new);
                position.apply(new.position_inputs(), &mut inputs.position);
                exchange.parameters = None;
            }
            position.read(counted, &mut inputs.position);
            measurement.update(inputs, exchange.renew());
            let words = exchange.retained.get_or_insert([0; RETAINED_WORDS]);
            if measurement.retain(words) { backup.write(words) } else { exchange.retained = None }
        });
        cx.shared.watchdog.progress(Part::Sampling);
        rtic::pend(PROCESS);
    }

    #[task(binds = CAN1_TX, priority = 4, local = [transmitter], shared = [transmit])]
    fn transmit(mut cx: transmit::Context) {
        let _end = TaskEnd;
        // One frame at a time: a task of the same or a higher priority waits for one frame at most.
        if cx.shared.transmit.lock(|queue| queue.step(cx.local.transmitter)) {
            rtic::pend(super::TRANSMIT);
        }
    }

    #[task(binds = TIM2, priority = 3, local = [time, process],
           shared = [protocol, transmit, exchange, &watchdog])]
    fn process(mut cx: process::Context) {
        let _end = TaskEnd;
        let [_, services_due] = cx.local.time.acknowledge();
        cx.local.process.wake_services(services_due);
        cx.local.process.run(&mut cx.shared.exchange, &mut (cx.shared.protocol, cx.shared.transmit));
        cx.shared.watchdog.progress(Part::Process);
    }

    #[task(binds = CAN1_SCE, priority = 2, local = [services],
           shared = [protocol, transmit, exchange, &watchdog])]
    fn serve(mut cx: serve::Context) {
        let _end = TaskEnd;
        let mut node = (cx.shared.protocol, cx.shared.transmit);
        cx.local.services.run(&mut node);
        if let Some(new) = cx.local.services.take_parameters() {
            cx.shared.exchange.lock(|exchange| exchange.parameters = Some(new));
        }
        cx.shared.watchdog.progress(Part::Services);
    }

    #[task(binds = SDIO, priority = 1, local = [storage], shared = [protocol, transmit, exchange, &watchdog])]
    fn store(mut cx: store::Context) {
        let _end = TaskEnd;
        let mut node = (cx.shared.protocol, cx.shared.transmit);
        let retained = cx.shared.exchange.lock(|exchange| exchange.retained);
        cx.local.storage.judge(&mut node);
        cx.local.storage.refill_clears();
        cx.local.storage.report_programs(&mut node);
        cx.local.storage.watch_positions(&retained);
        cx.local.storage.run(&mut node, cx.shared.watchdog);
        cx.local.storage.keep(&retained, &mut node);
        cx.local.storage.make_room(&mut node, cx.shared.watchdog);
        cx.shared.watchdog.progress(Part::Storage);
    }
}
