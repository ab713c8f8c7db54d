//! CAN-IDs that belong to another node.

use canopen::Frame;
use canopen::lss::Request;
use host_tests::bench::{Bench, ID, raw};
use node::Personality;

/// P24: a saved COB-ID that equals the pre-defined one follows the node-ID.
#[test]
fn a_predefined_cob_id_follows_the_node_id() {
    for personality in Personality::ALL {
        let mut bench = Bench::booted_as(personality);
        if bench.read(0x1800, 1).is_err() {
            continue;
        }
        let cob_id = 0x180 + u32::from(ID);
        bench.write(0x1800, 1, &(cob_id | 1 << 31).to_le_bytes()).expect("off");
        bench.write(0x1800, 1, &(cob_id | 1 << 30).to_le_bytes()).expect("on");
        bench.write(0x1010, 1, b"save").expect("a save");
        let requests = [
            Request::SwitchGlobal { configuration: true },
            Request::NodeId(ID + 1),
            Request::Store,
            Request::SwitchGlobal { configuration: false },
        ];
        for request in requests {
            bench.receive(&Frame::new(0x7E5, &request.encode()).expect("a frame"));
        }
        let mut bench = bench.power_cycled();
        (0..100).for_each(|_| bench.sample(&raw(100_000.0, 298.15)));
        bench.receive(&Frame::new(0, &[1, 0]).expect("a frame"));
        (0..100).for_each(|_| bench.sample(&raw(100_000.0, 298.15)));
    }
}
