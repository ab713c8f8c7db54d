use canopen::Duration;
use fastrand::Rng;
use host_tests::domain::*;
use host_tests::network::*;
use host_tests::sdo::*;
#[test]
fn dbg() {
    for seed in 0..1500u64 {
        let mut n = Network::new([DomainDevice::new()]).disturbed(Disturbance::new(seed, 3));
        n.start();
        n.run(Duration::from_millis(10));
        let mut rng = Rng::with_seed(seed);
        let data: Vec<u8> = (0..500).map(|_| rng.u8(..)).collect();
        n.stations[0].unit.set_content(&data);
        let bs = rng.u8(2..=127);
        let mut link = n.server(ID);
        let r = Client::new(&mut link).read_blocks(DOMAIN, bs);
        if r != Ok(data.clone()) { println!("up blocks seed {seed} bs {bs} {:?} {:?} now {} {:?}", r.err(), n.tally(), n.now(), n.traffic()); }
        n.run(Duration::from_millis(1100));
        let mut link = n.server(ID);
        let r = Client::new(&mut link).read(DOMAIN);
        if r != Ok(data.clone()) { println!("up seg seed {seed} {:?} {:?}", r.err(), n.tally()); }
        n.run(Duration::from_millis(1100));
        let mut link = n.server(ID);
        let r = Client::new(&mut link).write(DOMAIN, &data);
        if r != Ok(()) { println!("down seg seed {seed} {:?} {:?}", r.err(), n.tally()); }
        n.run(Duration::from_millis(1100));
        let mut link = n.server(ID);
        let r = Client::new(&mut link).write_blocks(DOMAIN, &data);
        if r != Ok(()) { println!("down blocks seed {seed} {:?} {:?}", r.err(), n.tally()); }
    }
}
