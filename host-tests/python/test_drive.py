"""The CiA 402 drive of the examples, driven by python-canopen: the state machine, its modes, its refusals."""

import time

import canopen
import pytest
from example import Bench, data_sheet
from simulator import PATIENCE

NODE = 6

DISABLE_VOLTAGE, QUICK_STOP, SHUTDOWN, SWITCH_ON, ENABLE = 0x0, 0x2, 0x6, 0x7, 0xF
FAULT_RESET = 0x80

#: Bits 0 to 3, 5 and 6 of the statusword.
DISABLED, READY, ON, ENABLED, STOPPING, REACTING, FAULT = 0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08

#: The command that leads from a state to the next one.
WAY = [(SHUTDOWN, READY), (SWITCH_ON, ON), (ENABLE, ENABLED)]


class Drive(Bench):
    def __init__(self, sheet):
        super().__init__("drive", NODE, sheet)
        self.listen(0x180 + NODE)

    def controlword(self, word: int) -> None:
        """By RPDO 1."""
        self.network.send_message(0x200 + NODE, word.to_bytes(2, "little"))

    def statusword(self) -> int:
        return self.node.sdo[0x6041].raw

    def status(self) -> int:
        """The state in the statusword."""
        word = self.statusword()
        return word & (0x4F if word & 0x4F in (DISABLED, FAULT, REACTING) else 0x6F)

    def wait_for(self, status: int) -> None:
        """Waits for TPDO 1 with a state: only a change of the statusword is sent."""
        while True:
            word = int.from_bytes(self.next(0x180 + NODE), "little")
            if status in (word & 0x4F, word & 0x6F):
                return

    def wait_for_bit(self, bit: int, value: int) -> None:
        end = time.monotonic() + PATIENCE
        while self.statusword() >> bit & 1 != value:
            assert time.monotonic() < end, f"bit {bit} of the statusword stays {1 - value}"

    def enable(self) -> None:
        self.state("OPERATIONAL", 5)
        for word, status in WAY:
            self.controlword(word)
            self.wait_for(status)

    def refuses(self, index: int, value: int) -> int:
        with pytest.raises(canopen.SdoAbortedError) as refusal:
            self.node.sdo[index].raw = value
        return refusal.value.code


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    return data_sheet("drive", tmp_path_factory.mktemp("drive"))


@pytest.fixture
def bench(sheet):
    bench = Drive(sheet)
    yield bench
    bench.close()


def test_every_transition_of_the_state_machine(bench):
    assert bench.node.sdo[0x1000].raw == 0x00020192
    commands = [DISABLE_VOLTAGE, QUICK_STOP, SHUTDOWN, SWITCH_ON, ENABLE]
    after = {
        DISABLED: [DISABLED, DISABLED, READY, DISABLED, DISABLED],
        READY: [DISABLED, DISABLED, READY, ON, ENABLED],
        ON: [DISABLED, DISABLED, READY, ON, ENABLED],
        ENABLED: [DISABLED, STOPPING, READY, ON, ENABLED],
    }
    # The drive stays in Quick stop active.
    bench.node.sdo[0x605A].raw = 6
    for number, (state, expected) in enumerate(after.items()):
        for command, status in zip(commands, expected):
            bench.node.sdo[0x6040].raw = DISABLE_VOLTAGE
            for word, _ in WAY[:number]:
                bench.node.sdo[0x6040].raw = word
            assert bench.status() == state
            bench.node.sdo[0x6040].raw = command
            assert bench.status() == status, f"{command:04b} in {state:02X}h"
    bench.node.sdo[0x6040].raw = QUICK_STOP
    assert bench.status() == STOPPING
    bench.node.sdo[0x6040].raw = ENABLE
    assert bench.status() == ENABLED, "transition 16"


def test_a_quick_stop_ends_in_switch_on_disabled(bench):
    bench.enable()
    bench.controlword(QUICK_STOP)
    bench.wait_for(DISABLED)


def test_a_position_is_approached_and_reported_by_sync(bench):
    bench.enable()
    bench.node.sdo[0x607A].raw = 5000
    bench.controlword(ENABLE | 0x10)
    bench.wait_for_bit(10, 1)
    assert bench.node.sdo[0x6064].raw == 5000
    bench.controlword(ENABLE)
    bench.wait_for_bit(12, 0)
    # Relative, by RPDO 3.
    data = (ENABLE | 0x50).to_bytes(2, "little") + (-1500).to_bytes(4, "little", signed=True)
    bench.network.send_message(0x400 + NODE, data)
    while bench.node.sdo[0x6064].raw != 3500:
        pass
    bench.listen(0x380 + NODE)
    bench.network.sync.transmit()
    assert int.from_bytes(bench.next(0x380 + NODE)[2:], "little", signed=True) == 3500


def test_a_position_beyond_the_limit_is_not_passed(bench):
    bench.node.sdo[0x607D][2].raw = 1000
    bench.enable()
    bench.node.sdo[0x607A].raw = 2000
    bench.controlword(ENABLE | 0x10)
    bench.wait_for_bit(10, 1)
    assert bench.node.sdo[0x6064].raw == 1000
    assert bench.statusword() >> 11 & 1 == 1, "internal limit active"


def test_a_velocity_is_reached_and_halt_stops_it(bench):
    bench.node.sdo[0x6060].raw = 3
    # The drive takes a mode in its next cycle.
    while bench.node.sdo[0x6061].raw != 3:
        pass
    bench.enable()
    data = ENABLE.to_bytes(2, "little") + (-2000).to_bytes(4, "little", signed=True)
    bench.network.send_message(0x500 + NODE, data)
    bench.wait_for_bit(12, 0)
    while bench.node.sdo[0x606C].raw != -2000:
        pass
    bench.wait_for_bit(10, 1)
    assert bench.refuses(0x6060, 1) == 0x08000022, "the motor turns"
    bench.controlword(ENABLE | 0x100)
    bench.wait_for_bit(12, 1)
    assert bench.node.sdo[0x606C].raw == 0
    assert bench.status() == ENABLED
    bench.node.sdo[0x6060].raw = 1


def test_a_mode_that_the_drive_lacks_is_refused(bench):
    assert bench.refuses(0x6060, 8) == 0x06090030
    assert bench.node.sdo[0x6060].raw == 1
    bench.state("OPERATIONAL", 5)
    bench.network.send_message(0x300 + NODE, bytes([SHUTDOWN, 0, 8]))
    bench.wait_for(READY)
    assert bench.node.sdo[0x6061].raw == 1, "an RPDO cannot set it either"


def test_under_local_control_the_controlword_is_refused(bench):
    bench.program.command("local", 1)
    bench.wait_for_bit(9, 0)
    assert bench.refuses(0x6040, SHUTDOWN) == 0x08000021
    assert bench.status() == DISABLED
    bench.program.command("local", 0)
    bench.wait_for_bit(9, 1)
    bench.node.sdo[0x6040].raw = SHUTDOWN
    assert bench.status() == READY


def test_a_fault_is_signalled_and_reset_by_an_edge_when_it_is_over(bench):
    bench.listen(0x080 + NODE)
    bench.enable()
    bench.program.command("overcurrent", 1)
    assert bench.next(0x080 + NODE)[:2] == (0x2310).to_bytes(2, "little")
    bench.wait_for(FAULT)
    assert bench.node.sdo[0x603F].raw == 0x2310
    assert bench.node.sdo[0x1003][1].raw & 0xFFFF == 0x2310
    bench.node.sdo[0x6040].raw = FAULT_RESET
    assert bench.status() == FAULT, "the fault is still there"
    bench.program.command("overcurrent", 0)
    assert bench.next(0x080 + NODE)[:2] == b"\x00\x00"
    bench.node.sdo[0x6040].raw = FAULT_RESET
    assert bench.status() == FAULT, "no edge"
    bench.node.sdo[0x6040].raw = 0
    bench.node.sdo[0x6040].raw = FAULT_RESET
    assert bench.status() == DISABLED
    assert bench.node.sdo[0x603F].raw == 0


def test_a_master_that_falls_silent_is_a_fault_of_a_drive_with_torque(bench):
    bench.node.sdo[0x1016][1].raw = 0x7F << 16 | 200
    bench.enable()
    bench.network.send_message(0x77F, b"\x05")
    # 1029h:1 has its default: the node is Pre-operational, without PDOs.
    while bench.status() != FAULT:
        pass
    assert bench.node.sdo[0x603F].raw == 0x8100
