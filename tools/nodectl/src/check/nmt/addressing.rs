//! Checks of the addressee of a command, and of frames that are no command.

use super::super::prelude::*;

pub(super) const CHECKS: &[Check] = &[
    Check::new("NMT-40", "A command to all nodes is obeyed", "CiA 301, 7.2.8.2.1", to_all),
    Check::new("NMT-41", "A command to another node is not obeyed", "CiA 301, 7.2.8.2.1", to_another),
    Check::new("NMT-42", "An unknown command changes nothing", "CiA 301, 7.2.8.2.1", unknown),
    Check::new("NMT-43", "A command of one byte changes nothing", "CiA 301, 7.2.8.2.1", short).recommended(),
    Check::new("NMT-44", "A command of three bytes changes nothing", "CiA 301, 7.2.8.2.1", long)
        .recommended(),
    Check::new("NMT-45", "A remote frame with CAN-ID 0 changes nothing", "CiA 301, 7.2.8.2.1", remote),
    Check::new("NMT-46", "Commands one right after the other are all obeyed", "CiA 301, 7.3.2.1", in_a_row),
];

fn to_all(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.beat(50)?;
    s.send(0x000, &[Command::Start as u8, 0])?;
    s.pass(20)?;
    s.tells(State::Operational)
}

fn to_another(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.beat(50)?;
    let other = u8::try_from(s.id() % 127 + 1).unwrap_or(1);
    for command in [Command::Start, Command::Stop, Command::ResetNode] {
        s.send(0x000, &[command as u8, other])?;
        s.pass(20)?;
        s.tells(State::PreOperational)?;
    }
    Ok(())
}

fn unknown(s: &mut Subject<'_>) -> Outcome {
    s.beat(50)?;
    let own = s.node().get();
    for command in [0x00, 0x03, 0x7F, 0x83, 0xFF] {
        s.send(0x000, &[command, own])?;
        s.pass(20)?;
        s.tells(State::PreOperational)?;
    }
    Ok(())
}

fn short(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.beat(50)?;
    s.send(0x000, &[Command::Start as u8])?;
    s.pass(20)?;
    s.tells(State::PreOperational)
}

fn long(s: &mut Subject<'_>) -> Outcome {
    s.beat(50)?;
    let own = s.node().get();
    s.send(0x000, &[Command::Start as u8, own, 0])?;
    s.pass(20)?;
    s.tells(State::PreOperational)
}

fn remote(s: &mut Subject<'_>) -> Outcome {
    s.beat(50)?;
    s.remote(0x000, 2)?;
    s.pass(20)?;
    s.tells(State::PreOperational)
}

fn in_a_row(s: &mut Subject<'_>) -> Outcome {
    s.beat(50)?;
    s.command(Command::Start)?;
    s.command(Command::Stop)?;
    s.pass(20)?;
    s.tells(State::Stopped)
}
