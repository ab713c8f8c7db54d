//! Frames as text, one a line.

use crate::Logged;

/// A frame as `  0.012345 -> 605 [8] 40 00 10 00 00 00 00 00`: the time since the first frame, the direction as this
/// side sees it, CAN-ID, length and data.
pub(super) fn lines(frames: &[Logged]) -> Vec<String> {
    let start = frames.first().map_or(0, |first| first.here.0);
    frames.iter().map(|logged| line(logged, start)).collect()
}

fn line(logged: &Logged, start: u64) -> String {
    let time = logged.here.0.saturating_sub(start);
    let direction = if logged.is_sent { "->" } else { "<-" };
    let frame = &logged.frame;
    let data: Vec<String> = frame.data().iter().map(|byte| format!("{byte:02X}")).collect();
    let data = if frame.is_remote() { "remote".to_owned() } else { data.join(" ") };
    let (seconds, micros) = (time / 1_000_000, time % 1_000_000);
    format!("{seconds:3}.{micros:06} {direction} {:03X} [{}] {data}", frame.id(), frame.len())
}
