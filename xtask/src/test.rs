//! `cargo xtask test`: every check of the project, the cheapest first.

use std::process::Command;

use anyhow::{Result, ensure};

use crate::command::{cargo, root, run};
use crate::steps::Steps;
use crate::target::Toolchain;
use crate::{bench, callgraph, images, native, python, sim};

/// The packages that only build for the embedded target.
const IMAGES: [&str; 5] = ["firmware", "bootloader", "mechanics-images", "panic-free", "bench-images"];

/// Runs the steps.
fn run_all(steps: &mut Steps) -> Result<()> {
    steps.run("format", || run(cargo().args(["fmt", "--all", "--check"])))?;
    steps.run("native tools", native::ensure_emulator_tools)?;
    steps.run("embedded target", || Toolchain::ensure().map(|_| ()))?;
    steps.run("lint host", || run(host("clippy").args(["--all-targets", "--", "-D", "warnings"])))?;
    steps.run("documentation", || run(host("doc").arg("--no-deps").env("RUSTDOCFLAGS", "-D warnings")))?;
    steps.run("images", || images::build().map(|_| ()))?;
    steps.run("lint images", lint_images)?;
    steps.run("other chips", other_chips)?;
    steps.run("embassy", embassy)?;
    steps.run("no panic", no_panic)?;
    steps.run("no panic in the images", callgraph::check_panics)?;
    steps.run("stack", || callgraph::stack(false))?;
    steps.run("test host", || run(with_images(&mut host("test"))))?;
    steps.run("performance", bench::check)?;
    steps.run("test python", test_python)
}

/// The whole command.
pub(crate) fn run_tests(only: Option<&str>) -> Result<()> {
    let mut steps = Steps::new(only);
    run_all(&mut steps)?;
    steps.finish()
}

/// A cargo call over everything that runs on the host, the emulated board included.
fn host(verb: &str) -> Command {
    let mut command = cargo();
    command.args([verb, "--quiet", "--workspace", "--profile", "sim", "--features", "host-tests/board"]);
    for package in IMAGES {
        command.args(["--exclude", package]);
    }
    command
}

fn lint_images() -> Result<()> {
    let toolchain = Toolchain::ensure()?;
    let packages = [
        "--release",
        "-p",
        "firmware",
        "-p",
        "bootloader",
        "-p",
        "mechanics-images",
        "-p",
        "panic-free",
        "-p",
        "bench-images",
        "-p",
        "bsp",
    ];
    run(toolchain.cargo("clippy", &packages).args(["--", "-D", "warnings"]))?;
    run(toolchain.cargo("doc", &packages).arg("--no-deps").env("RUSTDOCFLAGS", "-D warnings"))
}

fn other_chips() -> Result<()> {
    let toolchain = Toolchain::ensure()?;
    for chip in ["stm32f405", "stm32f407"] {
        let features = ["--release", "--no-default-features", "--features", chip];
        for package in ["firmware", "bootloader"] {
            run(toolchain.cargo("check", &features).args(["-p", package]))?;
        }
    }
    Ok(())
}

/// The library in an async main for the target. It is never run.
fn embassy() -> Result<()> {
    let example = ["--release", "-p", "canopen-device", "--example", "embassy"];
    let scripts = root().join("crates/canopen/examples/embassy");
    let search = format!("-Clink-arg=-L{}", scripts.display());
    run(Toolchain::ensure()?.cargo("rustc", &example).args(["--", "-Clink-arg=-Tlink.x", &search]))
}

/// Links everything that comes from the bus with a panic handler that cannot link; and shows that it would not link.
fn no_panic() -> Result<()> {
    let toolchain = Toolchain::ensure()?;
    let package = ["--release", "-p", "panic-free"];
    run(&mut toolchain.cargo("build", &package))?;
    let control = toolchain.cargo("build", &package).args(["--features", "with-a-panic"]).output()?;
    let says = String::from_utf8_lossy(&control.stderr);
    let is_refused = !control.status.success() && says.contains("a_panic_path_is_left");
    ensure!(is_refused, "an image with a panic path has linked:\n{says}");
    Ok(())
}

fn test_python() -> Result<()> {
    native::ensure_tshark()?;
    let sim = sim::build()?;
    let tools = ["nodectl", "sign"];
    run(cargo()
        .args(["build", "--quiet", "--profile", "sim"])
        .args(tools.iter().flat_map(|tool| ["-p", tool])))?;
    let [nodectl, sign] =
        tools.map(|tool| sim.with_file_name(format!("{tool}{}", std::env::consts::EXE_SUFFIX)));
    run(cargo().args([
        "build",
        "--quiet",
        "--profile",
        "sim",
        "-p",
        "canopen-device",
        "--example",
        "io_module",
    ]))?;
    let io_module = sim.with_file_name("examples").join(format!("io_module{}", std::env::consts::EXE_SUFFIX));
    let python = python::ensure()?;
    run(with_images(&mut Command::new(python))
        .args(["-m", "pytest", "-q", "host-tests/python"])
        .current_dir(root())
        .env("SIM_COMMAND", sim)
        .env("NODECTL_COMMAND", nodectl)
        .env("SIGN_COMMAND", sign)
        .env("IO_MODULE_COMMAND", io_module))
}

/// Tells tests where the ELF files are.
fn with_images(command: &mut Command) -> &mut Command {
    command.env("NODE_IMAGES", images::dir()).env("MECHANICS_IMAGES", images::dir())
}
