//! The programs of the mechanics in QEMU: a second opinion on exceptions and system registers, from the project that
//! the CPU library was made from. For each difference, the table states which emulator is right, and by which clause.
//!
//! `cargo xtask test --thorough` installs QEMU and runs this test.

#[allow(dead_code)]
mod bench;

use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::thread;
use std::time::Duration;

use bench::Verdict;

/// QEMU's machine with the most similar chip: an STM32F405.
const MACHINE: &str = "netduinoplus2";

/// Number of polls for the verdict, and the pause between two polls. This only limits a program that hangs.
const LOOKS: usize = 200;
const PAUSE: Duration = Duration::from_millis(20);

/// A QEMU process that runs a program.
struct Qemu {
    process: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Drop for Qemu {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Qemu {
    fn start(program: &str) -> Qemu {
        let mut command = Command::new("qemu-system-arm");
        command.args(["-machine", MACHINE, "-display", "none", "-serial", "none", "-monitor", "none"]);
        // An instruction takes 8 ns of the machine's time, whatever its time on the host.
        command.args(["-icount", "shift=3,sleep=off", "-qmp", "stdio", "-kernel"]).arg(bench::path(program));
        let started = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut process = started.expect("qemu-system-arm, which `cargo xtask test --thorough` installs");
        let requests = process.stdin.take().unwrap();
        let answers = BufReader::new(process.stdout.take().unwrap());
        let mut qemu = Qemu { process, requests, answers };
        qemu.line();
        qemu.ask(r#"{"execute":"qmp_capabilities"}"#);
        qemu
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.answers.read_line(&mut line).unwrap();
        assert!(!line.is_empty(), "QEMU has ended");
        line
    }

    /// Sends a request and returns the answer; events of the machine in between are skipped.
    fn ask(&mut self, request: &str) -> String {
        writeln!(self.requests, "{request}").unwrap();
        loop {
            let line = self.line();
            if line.contains("\"return\"") || line.contains("\"error\"") {
                return line;
            }
        }
    }

    /// The first words at an address: the verdict of a program and its notes.
    fn words(&mut self, address: u32) -> [u32; 8] {
        let command = format!("xp /8xw {address:#x}");
        let answer = self.ask(&format!(
            r#"{{"execute":"human-monitor-command","arguments":{{"command-line":"{command}"}}}}"#
        ));
        // Each line begins with the address, without a space before it.
        let words =
            answer.split(" 0x").skip(1).filter_map(|word| u32::from_str_radix(word.get(..8)?, 16).ok());
        words.collect::<Vec<u32>>().try_into().expect("eight words")
    }
}

/// The verdict of a program in QEMU, and its notes.
fn run(program: &str) -> (Verdict, [u32; 6]) {
    let address = bench::verdict_of(program);
    let mut qemu = Qemu::start(program);
    for _ in 0..LOOKS {
        let [said, code, notes @ ..] = qemu.words(address);
        match bench::verdict([said, code]) {
            Verdict::Silent => thread::sleep(PAUSE),
            verdict => return (verdict, notes),
        }
    }
    (Verdict::Silent, [0; 6])
}

/// A program that passes on the emulated board, with QEMU's different verdict.
struct Difference {
    program: &'static str,
    verdict: Verdict,
    /// The numbers of the failed checks, if the program notes them.
    notes: &'static [u32],
    /// Which emulator is right, and by which clause of the ARMv7-M Architecture Reference Manual.
    because: &'static str,
}

/// Programs with the same verdict in QEMU.
const AGREED: [&str; 16] = [
    "basepri",
    "escalation",
    "exclusive",
    "execute_never",
    "float_contexts",
    "hints",
    "it_block",
    "it_miss",
    "lost_update",
    "preemption",
    "requested_again",
    "restart",
    "rtic_tasks",
    "stack_overflow",
    "tail_chain",
    "traps",
];

const DIFFERENCES: [Difference; 3] = [
    Difference {
        program: "lost_store",
        verdict: Verdict::Failed(1),
        notes: &[],
        because: "QEMU has no write buffer: every store is waited for. B1.5.14 has imprecise faults, and the Cortex-M4 buffers stores \
                  (technical reference manual, 2.3.2) until ACTLR.DISDEFWBUF is set",
    },
    Difference {
        program: "system_registers",
        verdict: Verdict::Failed(3),
        notes: &[3, 12, 0, 0, 0, 51],
        because: "3: QEMU divides the count of SysTick by eight when the clock source changes; B3.3.1 and B3.3.3 have a register \
                  that the chosen clock decrements, and no other change of it. 12: see systick. 51: QEMU's core has eight priority \
                  bits; how many there are is up to the chip (B1.5.4), and the STM32F4 has four (PM0214, 4.3.7)",
    },
    Difference {
        program: "systick",
        verdict: Verdict::Failed(2),
        notes: &[],
        because: "QEMU has no DWT: DWT_CYCCNT reads 0 with TRCENA and CYCCNTENA set; C1.8.8 has it count",
    },
];

#[test]
#[ignore = "needs QEMU: `cargo xtask test --thorough` installs it"]
fn qemu_agrees_or_the_difference_is_known() {
    let mut wrong = Vec::new();
    for program in AGREED {
        let (said, _) = run(program);
        println!("{program}: {said:?}");
        if said != Verdict::Passed {
            wrong.push(format!("{program}: {said:?}"));
        }
    }
    for Difference { program, verdict, notes, because } in DIFFERENCES {
        let (said, noted) = run(program);
        println!("{program}: {said:?} {noted:?}: {because}");
        if said != verdict || !noted.starts_with(notes) {
            wrong.push(format!("{program}: {said:?} {noted:?} instead of {verdict:?} {notes:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Five programs are excluded: three program the flash of the chip, which QEMU does not support; one has peripherals of
/// the bench; one measures cycles, which QEMU does not count.
#[test]
fn every_program_is_asked_about() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../images/src/bin");
    let mut programs: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|file| file.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    programs.sort();
    let known = DIFFERENCES.iter().map(|difference| difference.program).chain(AGREED);
    let mut known: Vec<&str> = known
        .chain(["busy_flash", "calibrate", "posted_stores", "programmed_twice", "self_modified"])
        .collect();
    known.sort_unstable();
    assert_eq!(programs, known);
}
