//! The builds before the tests, and the checks beside them: lints and documentation.

use anyhow::{Result, ensure};

use super::host;
use super::report::Step;
use crate::command::{cargo, root, run};
use crate::own_tool::Tools;
use crate::setup::{self, Need, python};
use crate::target::Toolchain;
use crate::{bench, callgraph, hal_examples, images, packages, progress, reproducible};

/// The builds for this machine that the tests need.
pub(super) fn builds_for_host() -> Vec<Step> {
    vec![
        Step::new("format", || run(cargo().args(["fmt", "--all", "--check"]))),
        Step::new("build host", || progress::build("host", &mut host::build()?)),
        Step::new("python", || python::clients().map(|_| ())),
    ]
}

/// The builds for the Cortex-M4 that the tests need.
pub(super) fn builds_for_target(needs: &'static [Need], thorough: bool) -> Vec<Step> {
    let mut steps = vec![Step::new("system packages", move || setup::install(needs))];
    if thorough {
        // The name contains the tool's name, so that `--only qemu` runs the step.
        steps.push(Step::new("install qemu", || setup::install(&[Need::Qemu])));
        // Before the images of the default chip, because cargo puts both into the same place.
        steps.push(Step::new("build other_chips", build_other_chips));
        steps.push(Step::new("reproducible images", || reproducible::check(&Toolchain::ensure()?)));
        steps.push(Step::new("build hal_examples", || hal_examples::build(&Toolchain::ensure()?)));
    }
    steps.extend([
        Step::new("bootloader of an owner", || images::check_owners(&Toolchain::ensure()?)),
        Step::new("build images", || images::compile_all(&Toolchain::ensure()?)),
        Step::new("build bench images", || bench::build(&bench::Options::default()).map(|_| ())),
    ]);
    steps
}

/// The checks for this machine that no test waits for. They run one after the other, as cargo runs only one build at a
/// time.
pub(super) fn checks_for_host() -> Vec<Step> {
    vec![
        Step::new("lint host", lint_host),
        Step::new("documentation", document_host),
        Step::new("packages", packages::check),
        Step::new("examples of the documentation", || run(host::cargo("test")?.args(["--quiet", "--doc"]))),
    ]
}

/// The checks for the Cortex-M4 that no test waits for. They run one after the other, as cargo runs only one build at a
/// time.
pub(super) fn checks_for_target() -> Vec<Step> {
    vec![
        Step::new("no panic in the images", callgraph::check_panics),
        Step::new("stack", || callgraph::stack(false, Tools::Built)),
        Step::new("performance", bench::check),
        Step::new("no panic", no_panic),
        Step::new("lint images", lint_images),
        Step::new("other chips", check_other_chip),
        Step::new("examples for the target", examples_for_target),
    ]
}

fn lint_host() -> Result<()> {
    progress::build("lint host", host::cargo("clippy")?.args(["--all-targets", "--", "-D", "warnings"]))
}

/// With the examples, so that cargo uses the same features as for the tests and compiles no crate a second time.
fn document_host() -> Result<()> {
    let mut command = host::cargo("doc")?;
    command.args(["--no-deps", "--lib", "--bins", "--examples"]).env("RUSTDOCFLAGS", "-D warnings");
    progress::build("documentation", &mut command)
}

fn lint_images() -> Result<()> {
    let toolchain = Toolchain::ensure()?;
    let packages = host::IMAGES.iter().chain(&["bsp"]).flat_map(|package| ["-p", package]);
    let packages: Vec<&str> =
        std::iter::once("--release").chain(images::DEVELOPMENT).chain(packages).collect();
    let mut clippy = toolchain.cargo("clippy", &packages);
    progress::build("lint images", clippy.args(["--", "-D", "warnings"]))?;
    let mut doc = toolchain.cargo("doc", &packages);
    progress::build("lint images", doc.arg("--no-deps").env("RUSTDOCFLAGS", "-D warnings"))
}

fn build_other_chips() -> Result<()> {
    let toolchain = Toolchain::ensure()?;
    images::OTHER_CHIPS.iter().try_for_each(|(chip, _)| images::compile_for(&toolchain, chip).map(|_| ()))
}

/// Checks that the images for another chip compile. `--thorough` links the images and runs them.
fn check_other_chip() -> Result<()> {
    let [(chip, _), _] = images::OTHER_CHIPS;
    images::check_for(&Toolchain::ensure()?, chip)
}

/// Builds the examples for the target: the library in an async main, and in RTIC for a NUCLEO. They are never run.
fn examples_for_target() -> Result<()> {
    let toolchain = Toolchain::ensure()?;
    ["embassy", "rtic"].into_iter().try_for_each(|name| {
        let example = ["--release", "-p", "canopen-device", "--example", name];
        let scripts = root().join("crates/canopen/examples").join(name);
        let mut command = toolchain.cargo("rustc", &example);
        command.args(["--", "-Clink-arg=-Tlink.x"]).arg(format!("-Clink-arg=-L{}", scripts.display()));
        progress::build(name, &mut command)
    })
}

/// Links all code that handles data from the bus with a panic handler that cannot be linked. Also checks that code with
/// a panic fails to link.
fn no_panic() -> Result<()> {
    let toolchain = Toolchain::ensure()?;
    let package = ["--release", "-p", "panic-free"];
    progress::build("no panic", &mut toolchain.cargo("build", &package))?;
    let control = toolchain.cargo("build", &package).args(["--features", "with-a-panic"]).output()?;
    let says = String::from_utf8_lossy(&control.stderr);
    let is_refused = !control.status.success() && says.contains("a_panic_path_is_left");
    ensure!(is_refused, "an image with a panic path has linked:\n{says}");
    Ok(())
}
