//! Tests of `cargo xtask` on unprepared machines. The machines are faked: programs are scripts on a search path of
//! their own, which note the arguments of their calls.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::process::{Command, Output};

const NOTHING: &str = "nothing is missing";
/// A program that exists and works.
const WORKS: &str = "exit 0";
/// A program that fails, as `python3 -c "import venv, ensurepip"` does on a Debian without python3-venv.
const FAILS: &str = "exit 1";

/// A machine with some programs.
struct Machine {
    root: PathBuf,
    is_closed: bool,
}

impl Machine {
    /// A machine with a C compiler, make and rustup, on which the user is not root.
    fn new(name: &str) -> Machine {
        let root = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
        // Remove the files of an earlier run.
        let _ = fs::remove_dir_all(&root);
        fs::create_dir_all(root.join("bin")).unwrap();
        fs::create_dir_all(root.join("libclang")).unwrap();
        let linker = root.join("sysroot/lib/rustlib").join(env!("XTASK_HOST")).join("bin");
        fs::create_dir_all(&linker).unwrap();
        fs::write(linker.join("rust-lld"), "").unwrap();
        let sysroot = format!("echo {}/sysroot", root.display());
        let machine = Machine { root, is_closed: false };
        let machine =
            machine.with("cc", WORKS).with("make", WORKS).with("rustup", WORKS).with("cargo", WORKS);
        machine.with("rustc", &sysroot).with("id", "echo 1000").with("dpkg-query", FAILS)
    }

    /// A new Debian: no cmake, a libclang-cpp that is no libclang, no python3-venv.
    fn debian(name: &str) -> Machine {
        let machine = Machine::new(name).with("apt-get", WORKS).with("python3", FAILS);
        fs::write(machine.root.join("libclang/libclang-cpp.so.14"), "").unwrap();
        machine
    }

    /// Adds a program that notes each of its calls.
    fn with(self, program: &str, does: &str) -> Machine {
        let path = self.root.join("bin").join(program);
        let calls = self.root.join("calls");
        let text = format!(
            "#!/bin/sh\n[ \"$1\" = --version ] || echo \"{program} $*\" >> {}\n{does}\n",
            calls.display()
        );
        fs::write(&path, text).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        self
    }

    fn with_browser(self) -> Machine {
        self.with("chromium", WORKS).with("chromedriver", WORKS)
    }

    /// The files that the fake cargo does not build.
    fn has_images(&self) {
        let images = self.root.join("target/thumbv7em-none-eabihf/release");
        fs::create_dir_all(&images).unwrap();
        ["firmware", "bootloader"].iter().for_each(|name| fs::write(images.join(name), "").unwrap());
    }

    fn closed(mut self) -> Machine {
        self.is_closed = true;
        self
    }

    fn xtask(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
        command.args(arguments).env_clear();
        command.env("PATH", self.root.join("bin")).env("CARGO_TARGET_DIR", self.root.join("target"));
        command.env("LIBCLANG_PATH", self.root.join("libclang"));
        if self.is_closed {
            command.env("RUSTUP_AUTO_INSTALL", "0");
        }
        command.output().unwrap()
    }

    /// The output of `cargo xtask setup --dry-run`.
    fn says(&self) -> String {
        let output = self.xtask(&["setup", "--dry-run"]);
        assert!(output.status.success());
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    }

    /// The last line of the output: the command to type.
    fn command(&self) -> String {
        self.says().lines().last().unwrap_or_default().trim().to_owned()
    }

    /// The calls of a program so far.
    fn calls(&self, program: &str) -> Vec<String> {
        let calls = fs::read_to_string(self.root.join("calls")).unwrap_or_default();
        calls.lines().filter(|call| call.split(' ').next() == Some(program)).map(str::to_owned).collect()
    }
}

#[test]
fn a_user_without_root_on_debian_gets_one_command_and_no_build() {
    let machine = Machine::debian("debian").closed();
    let command = "sudo apt-get install -y rustc-web rust-web-src cargo-web rust-web-clippy python3-venv tshark \
                   chromium chromium-driver";
    assert_eq!(machine.command(), command);
    for arguments in [&["test"][..], &["sim", "--for", "5"], &["setup"]] {
        let output = machine.xtask(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let says = String::from_utf8(output.stderr).unwrap();
        assert!(says.contains("sudo apt-get install -y rustc-web"), "{says}");
        assert!(!says.contains("libclang-dev"), "a libclang comes from PyPI: {says}");
    }
    assert_eq!(machine.calls("cargo"), [""; 0], "nothing is built before everything is there");
    assert_eq!(machine.calls("apt-get"), [""; 0]);
}

#[test]
fn a_program_that_does_not_work_is_no_program() {
    let machine = Machine::debian("stub").with("tshark", FAILS).with("cc", FAILS);
    let command = "sudo apt-get install -y build-essential python3-venv tshark chromium chromium-driver";
    assert_eq!(machine.command(), command);
}

#[test]
fn root_on_debian_types_nothing() {
    let machine = Machine::debian("root").closed().with("id", "echo 0");
    let output = machine.xtask(&["setup"]);
    let says = String::from_utf8_lossy(&output.stderr).into_owned();
    let installs = machine.calls("apt-get");
    assert!(
        installs.iter().any(|call| call.contains("install") && call.contains("rustc-web")),
        "{installs:?} {says}"
    );
    assert!(!says.contains("sudo"), "{says}");
}

#[test]
fn with_a_python_that_makes_environments_the_emulator_s_tools_need_no_package() {
    let machine = Machine::debian("python").with("python3", WORKS);
    let machine = machine.with("tshark", WORKS).with_browser();
    assert_eq!(machine.says(), NOTHING, "rustup adds the target, and PyPI has cmake and libclang");
}

#[test]
fn other_systems_get_their_own_commands() {
    for (manager, command) in [
        ("dnf", "sudo dnf install -y python3 wireshark-cli chromium chromedriver"),
        ("pacman", "sudo pacman -S --needed --noconfirm python wireshark-cli chromium"),
        ("brew", "brew install python wireshark chromium chromedriver"),
    ] {
        let machine = Machine::new(manager).with(manager, WORKS);
        assert_eq!(machine.command(), command);
    }
}

#[test]
fn a_rustup_that_must_not_download_is_named_where_debian_cannot_help() {
    let machine = Machine::new("closed").closed().with("dnf", WORKS).with("python3", WORKS);
    let machine = machine.with("tshark", WORKS).with_browser();
    assert_eq!(machine.command(), "env -u RUSTUP_AUTO_INSTALL rustup target add thumbv7em-none-eabihf");
}

#[test]
fn without_a_package_manager_the_packages_are_named() {
    let says = Machine::new("bare").says();
    assert!(says.contains("tshark") && says.contains("package manager"), "{says}");
}

#[test]
fn without_probe_rs_the_install_command_is_printed_and_no_build_starts() {
    for machine in [Machine::new("no-probe-rs").with("dnf", WORKS), Machine::new("no-manager")] {
        let output = machine.xtask(&["flash", "--development"]);
        let says = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(says.contains("cargo install --locked probe-rs-tools"), "{says}");
        assert_eq!(machine.calls("cargo"), [""; 0]);
    }
}

#[test]
fn a_board_needs_the_target_too() {
    let machine = Machine::new("no-target").closed().with("dnf", WORKS).with("probe-rs", WORKS);
    let output = machine.xtask(&["flash", "--development", "--dry-run"]);
    let says = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(says.contains("rustup target add thumbv7em-none-eabihf") && !says.contains("probe-rs"), "{says}");
}

#[test]
fn without_a_board_nothing_is_built() {
    let empty = "echo 'No debug probes were found.'";
    for probe_rs in [empty, FAILS] {
        let machine =
            Machine::new("no-board").with("probe-rs", &format!("[ \"$1\" = --version ] || {probe_rs}"));
        let output = machine.xtask(&["flash", "--development"]);
        let says = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(says.contains("no debug probe was found") && says.contains("ST-LINK"), "{says}");
        assert_eq!(machine.calls("cargo"), [""; 0]);
        assert_eq!(machine.calls("probe-rs"), ["probe-rs list"]);
    }
}

/// Both programs and the tools are built. Then the command fails, because the program that writes the flash does not
/// exist on this machine.
#[test]
fn with_a_board_both_programs_are_built() {
    let machine = Machine::new("board").with("probe-rs", "echo '[0]: STLink V2-1'");
    machine.has_images();
    let says = String::from_utf8(machine.xtask(&["flash", "--development"]).stderr).unwrap();
    assert!(says.contains("cannot start") && says.contains("flash"), "{says}");
    let calls = machine.calls("cargo");
    let builds = |what: &str| calls.iter().filter(|call| call.contains(what)).count();
    assert_eq!(
        (builds("-p programmer"), builds("-p firmware"), builds("-p bootloader")),
        (1, 1, 1),
        "{calls:?}"
    );
}

/// As the runner of `cargo run`, the command gets the path of the application.
#[test]
fn an_application_that_is_given_is_not_built() {
    let machine = Machine::new("runner").with("probe-rs", WORKS);
    machine.xtask(&["flash", "--development", "firmware"]);
    let calls = machine.calls("cargo");
    assert!(calls.iter().any(|call| call.contains("-p bootloader")), "{calls:?}");
    assert!(!calls.iter().any(|call| call.contains("-p firmware")), "{calls:?}");
}

#[test]
fn without_an_argument_the_commands_are_listed_a_line_each() {
    let output = Machine::new("list").xtask(&[]);
    let says = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success());
    for command in ["sim", "test", "setup", "eds", "bench"] {
        let lines = says.lines().filter(|line| line.split_whitespace().nth(2) == Some(command));
        assert_eq!(lines.count(), 1, "{command}: {says}");
    }
    assert!(says.lines().all(|line| line.starts_with("cargo xtask ") && line.len() < 130), "{says}");
}

#[test]
fn a_dry_run_installs_no_cpu_library() {
    let machine = Machine::new("dry").with("pkg-config", WORKS).with("python3", WORKS).with("cmake", WORKS);
    machine.says();
    let python = machine.calls("python3");
    assert!(!python.iter().any(|call| call.contains("-m venv")), "{python:?}");
    for name in ["cpu-library", "cpu-library.missing"] {
        assert!(!machine.root.join("target").join(name).exists(), "{name}");
    }
}
