//! The boards run on several threads: the run is the same with any number of them.

use canbus::{Stamped, Time};

use crate::support::{Master, START_ALL, world};

/// The frames and the log of a run, and the work of each board.
fn run(flags: &str, threads: usize) -> (Vec<Stamped>, Vec<String>, Vec<u64>) {
    let mut world = world(&format!("--bitrate 1000 {flags} --threads {threads}"));
    let master = Master::join(&mut world);
    for step in 0..30 {
        world.run_until(Time::from_millis(40 * (step + 1)));
        if step == 10 {
            master.send(&mut world, START_ALL.0, &START_ALL.1);
        }
        if step == 20 {
            // A reset of one node, while the others send.
            master.send(&mut world, 0, &[0x81, 2]);
        }
        if step > 12 {
            master.send(&mut world, 0x601 + (step % 3) as u16, &[0x40, 0x18, 0x10, 4, 0, 0, 0, 0]);
        }
    }
    let log = world.take_log().into_iter().map(|line| format!("{} {} {}", line.at, line.node, line.text));
    let log = log.collect();
    let work = (0..3).map(|board| world.machine(board).stats().trace).collect();
    (world.take_frames(), log, work)
}

fn the_number_of_threads_does_not_matter(flags: &str) {
    let one = run(flags, 1);
    assert!(one.0.len() > 30 && one.1.len() > 10, "{} frames, {} lines", one.0.len(), one.1.len());
    for threads in 2..=3 {
        let several = run(flags, threads);
        let first = one.0.iter().zip(&several.0).find(|(one, several)| one != several);
        assert!(first.is_none() && one.0.len() == several.0.len(), "{threads} threads: {first:?}");
        assert!(one.1 == several.1, "the logs of {threads} threads");
        assert_eq!(one.2, several.2, "what the boards of {threads} threads did");
    }
}

#[test]
fn one_thread_and_several_give_the_same_run() {
    the_number_of_threads_does_not_matter(
        "--node 1 --node 2:combined --node 3:encoder --shaft rpm:60 --load 20",
    );
}

#[test]
fn so_do_they_in_any_interleaving() {
    the_number_of_threads_does_not_matter("--node 1 --node 2 --node 3:combined --interleave 5");
}
