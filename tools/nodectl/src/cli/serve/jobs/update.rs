//! Jobs: the update of the program of a node.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use canopen::{Duration, NodeId};
use serde_json::{Value as Json, json};

use super::{Context, Job};
use crate::cli::Failure;
use crate::object::at;
use crate::update::{Image, ImageInfo, Options, Outcome, Program, Step, Version, Watcher, update, version};

/// How long to wait for a node that is lost.
const PATIENCE: Duration = Duration::from_millis(60_000);

/// The bytes of a file in base64, as in a message.
pub(super) fn decode(data: &str) -> Result<Vec<u8>, String> {
    STANDARD.decode(data).map_err(|_| "the file has not arrived whole (it is no base64)".to_owned())
}

fn parse(bytes: Vec<u8>) -> Result<Image, String> {
    Image::parse(bytes).map_err(|error| error.to_string())
}

/// Checks whether an update is possible. Changes nothing.
pub(super) fn inspect(node: NodeId, name: String, bytes: Vec<u8>, file: u64) -> Job {
    Job::of_node(node, move |context| {
        let length = bytes.len();
        let image = parse(bytes);
        let device = device(context, node)?;
        let checks = checks(&image, &device, &name);
        let allowed = checks.iter().all(|check| check["ok"] != false || check["name"] == "version");
        let info = image.ok().and_then(|image| image.info);
        let image = info.map(|ImageInfo { board, version, identification }| {
            json!({
                "board": board, "version": version.to_string(), "bytes": length, "identification": identification
            })
        });
        let Device { board, version, identification } = device;
        let device = json!({ "board": board, "version": version, "identification": identification });
        Ok(json!({ "file": file, "checks": checks, "allowed": allowed, "image": image, "device": device }))
    })
}

/// The identity of a node, as far as an update needs it.
struct Device {
    board: Option<u32>,
    version: Option<String>,
    identification: Option<u32>,
}

fn device(context: &mut Context, node: NodeId) -> Result<Device, Failure> {
    context.session.begin();
    let options = context.session.options.sdo();
    let board = context.session.word(node, at(0x2004, 1))?;
    let version = context.session.text(node, 0x100A)?;
    let identification = Program::new(&mut context.session.network, node, options).identification();
    let identification = identification.map_err(|error| context.session.named(error))?;
    Ok(Device { board, version, identification })
}

fn checks(image: &Result<Image, String>, device: &Device, name: &str) -> Vec<Json> {
    let check = |what: &str, ok: bool, text: String| json!({ "name": what, "ok": ok, "text": text });
    let info = match image {
        Ok(Image { info: Some(info), .. }) => info,
        Ok(_) => return Vec::new(),
        Err(reason) => return vec![check("file", false, format!("{name}: {reason}"))],
    };
    let ImageInfo { board, version: new, .. } = *info;
    let of_device = match device.board {
        Some(device) => format!("the image is for board {board:08X}h, the node has board {device:08X}h"),
        None => "the node has no board code (2004h); its bootloader checks the image".to_owned(),
    };
    vec![
        check("file", true, format!("{name}: whole, its checksum is right; the node checks the signature")),
        check("board", device.board.is_none_or(|device| device == board), of_device),
        version_check(new, device.version.as_deref(), check),
    ]
}

/// The check of the version. An older version is allowed only if the user confirms it.
fn version_check(new: Version, running: Option<&str>, check: impl Fn(&str, bool, String) -> Json) -> Json {
    match running {
        Some(running) if version(running) > Some(new) => {
            check("version", false, format!("the node runs version {running}, which is newer than {new}"))
        }
        Some(running) => check("version", true, format!("{running} becomes {new}")),
        None => check("version", true, format!("no program runs; it becomes {new}")),
    }
}

/// Replaces the program of a node.
pub(super) fn start(node: NodeId, bytes: Vec<u8>, force: bool) -> Result<Job, String> {
    let image = parse(bytes)?;
    let work = move |context: &mut Context| {
        let (sdo, key) = (context.session.options.sdo(), context.session.options.authorisation_key()?);
        let options = Options { sdo, patience: PATIENCE, force, key, confirm: true };
        let mut teller = Teller { orders: context.teller(), told: 0, step: Step::Identify };
        let results = update(&mut context.session.network, &[node], &image, &options, &mut teller);
        let (_, result) = results.into_iter().next().ok_or_else(|| Failure::Usage("no node".to_owned()))?;
        let Outcome { old_version, old_identification, new_version, new_identification, is_changed, .. } =
            result?;
        Ok(json!({
            "result": if is_changed { "updated" } else { "unchanged" },
            "old_version": old_version, "new_version": new_version,
            "old_identification": old_identification, "new_identification": new_identification,
        }))
    };
    Ok(Job { is_update: true, ..Job::of_node(node, work) })
}

/// Reports the progress of an update to all pages.
struct Teller<T: Fn(Json)> {
    orders: T,
    told: usize,
    step: Step,
}

impl<T: Fn(Json)> Teller<T> {
    fn tell(&self, node: NodeId, done: usize, all: usize) {
        let step = match self.step {
            Step::Identify => "identify",
            Step::Stop => "stop",
            Step::Busy => "busy",
            Step::Clear => "clear",
            Step::Download | Step::DownloadSegments => "download",
            Step::Verify => "verify",
            Step::Start => "start",
            Step::Confirm => "confirm",
            Step::Lost | Step::Disturbed => "lost",
            Step::Back => "back",
        };
        let text = self.step.to_string();
        (self.orders)(json!({
            "event": "update", "node": node.get(), "step": step, "text": text, "done": done, "all": all
        }));
    }
}

impl<T: Fn(Json)> Watcher for Teller<T> {
    fn step(&mut self, node: NodeId, step: Step) {
        (self.step, self.told) = (step, 0);
        self.tell(node, 0, 0);
    }

    fn progress(&mut self, node: NodeId, done: usize, total: usize) {
        // A bar of a hundred steps is fine enough.
        let percent = done * 100 / total.max(1);
        if percent != self.told {
            self.told = percent;
            self.tell(node, done, total);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_image_is_reported_before_any_request() {
        assert!(decode("%%%").is_err());
        for (bytes, words) in [(&b"\x7fELF"[..], "ELF"), (b"nothing", "too short"), (b"", "too short")] {
            assert!(parse(bytes.to_vec()).unwrap_err().contains(words));
        }
    }

    #[test]
    fn an_older_version_is_a_warning_and_another_board_a_refusal() {
        let image = |major| {
            let info =
                ImageInfo { board: 1, version: Version { major, minor: 0, patch: 0 }, identification: 7 };
            Ok(Image { bytes: Vec::new(), info: Some(info) })
        };
        let device =
            |board| Device { board: Some(board), version: Some("2.0.0".to_owned()), identification: None };
        let ok = |checks: Vec<Json>| checks.iter().map(|check| check["ok"] == true).collect::<Vec<_>>();
        assert_eq!(ok(checks(&image(3), &device(1), "a")), [true, true, true]);
        assert_eq!(ok(checks(&image(1), &device(1), "a")), [true, true, false]);
        assert_eq!(ok(checks(&image(3), &device(2), "a")), [true, false, true]);
        assert_eq!(ok(checks(&Err("no".to_owned()), &device(1), "a")), [false]);
    }
}
