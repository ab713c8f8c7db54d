//! A save right after a write waits for the samples that may have been taken with the old parameters.

use canopen::Frame;
use host_tests::bench::{Bench, raw};
use node::{Personality, StoreJob};

/// The samples that may have been taken with old parameters: of this millisecond and the next, and one that has begun.
const OLDER_SAMPLES: usize = 3;

#[test]
fn a_save_that_waits_for_samples_makes_the_services_due_with_the_last_of_them() {
    for personality in Personality::ALL {
        let mut bench = Bench::booted_as(personality);
        bench.stores_later = true;
        (0..5).for_each(|_| bench.sample(&raw(250_000.0, 298.15)));
        bench.write(0x2002, 3, &500_u16.to_le_bytes()).unwrap();
        let save = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
        bench.receive(&Frame::new(0x600 + bench.id(), &save).unwrap());
        let mut job = StoreJob::new(personality);
        for sample in 1..=OLDER_SAMPLES {
            assert!(!bench.protocol.take_job(&mut job), "{personality:?}: the job waits at sample {sample}");
            let next = bench.protocol.publish(bench.now, &mut bench.out);
            assert_eq!(
                next.services == bench.now,
                sample == OLDER_SAMPLES,
                "{personality:?}: sample {sample}"
            );
        }
        assert!(bench.protocol.take_job(&mut job), "{personality:?}: the job no longer waits");
        let next = bench.protocol.publish(bench.now, &mut bench.out);
        assert_ne!(next.services, bench.now, "{personality:?}: nothing waits");
    }
}
