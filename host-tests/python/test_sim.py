"""A stock CANopen master talks to the real firmware on the emulated board."""

import math
import struct

import canopen
import pytest
from simulator import BOOT_UP, PATIENCE, Master, Simulator

STOPPED, OPERATIONAL, PRE_OPERATIONAL = 4, 5, 127

#: One step of the 12-bit converter in pascal: the transducer gives 80 % of its supply over 1 MPa.
ADC_STEP = 1_000_000 / 4096 / 0.8

#: The process value is in bar unless 6131h selects another unit.
BAR = 100_000


def real32(data: bytes) -> float:
    return struct.unpack_from("<f", data)[0]


def pascal(tpdo: bytes) -> float:
    """The pressure in TPDO 1, whose first object is 6130h:1."""
    return real32(tpdo) * BAR


def test_boot_up_and_a_heartbeat_every_second(master: Master):
    heartbeat = master.listen(0x701)
    master.node.nmt.send_command(0x81)
    heartbeat.until(lambda data: data == BOOT_UP)
    times = [heartbeat.next()[0] for _ in range(4)]
    for earlier, later in zip(times, times[1:]):
        assert later - earlier == pytest.approx(1.0, abs=0.0005)


def test_device_type_and_identity(master: Master):
    assert master.read(0x1000) == 0x0002_0194
    assert master.read(0x1017) == 1000
    assert master.read(0x1018) == 4
    vendor, product, revision, serial = (master.read(0x1018, sub) for sub in (1, 2, 3, 4))
    assert (vendor, product) == (0, 1)
    assert revision != 0
    assert serial == master.read(0x1018, 4)


def test_an_object_that_does_not_exist_is_refused(master: Master):
    with pytest.raises(canopen.SdoAbortedError) as aborted:
        master.read(0x5FFF)
    assert aborted.value.code == 0x0602_0000


@pytest.mark.parametrize("pressure", [100_000, 400_000, 250_000])
def test_tpdo1_follows_a_constant_pressure(master: Master, pressure: int):
    master.simulator.command(f"pressure 1=const:{pressure}")
    master.node.nmt.send_command(0x01)
    tpdo = master.listen(0x181)
    # Terminal and bus are separate connections to the simulator: some TPDOs may have been measured before the change.
    tpdo.until(lambda data: math.isclose(pascal(data), pressure, abs_tol=ADC_STEP))
    assert pascal(tpdo.next()[1]) == pytest.approx(pressure, abs=ADC_STEP)


def test_nmt_commands_show_in_the_heartbeat(master: Master):
    heartbeat = master.listen(0x701)
    for command, state in ((0x01, OPERATIONAL), (0x02, STOPPED), (0x80, PRE_OPERATIONAL), (0x01, OPERATIONAL)):
        master.node.nmt.send_command(command)
        heartbeat.until(lambda data: data == bytes([state]))
    master.node.nmt.send_command(0x82)
    heartbeat.until(lambda data: data == BOOT_UP)
    assert heartbeat.next()[1] == bytes([PRE_OPERATIONAL])


def test_a_remapped_tpdo_answers_sync(master: Master):
    disabled, valid = 0x8000_0181, 0x0000_0181
    master.write(0x1800, 1, disabled, 4)
    master.write(0x1A00, 0, 0, 1)
    master.write(0x1800, 2, 1, 1)
    master.write(0x1A00, 1, 0x6100_0120, 4)
    master.write(0x1A00, 2, 0x6150_0108, 4)
    master.write(0x1A00, 0, 2, 1)
    master.write(0x1800, 1, valid, 4)
    master.node.nmt.send_command(0x01)
    with master.simulator.bus() as observer:
        for _ in range(5):
            master.network.send_message(0x80, b"")
            sync = next_frame(observer, 0x80)
            tpdo = next_frame(observer, 0x181)
            assert 0 < tpdo.timestamp - sync.timestamp < 0.001
            assert len(tpdo.data) == 5
            assert real32(tpdo.data) == pytest.approx(250_000, abs=ADC_STEP), "6100h is in pascal"
            assert tpdo.data[4] == 0


def next_frame(bus, cob_id: int):
    while (message := bus.recv(PATIENCE)) is not None:
        if message.arbitration_id == cob_id:
            return message
    raise AssertionError(f"no frame {cob_id:03X}")


def test_slcan_clients_are_on_the_same_bus(master: Master):
    bus = master.simulator.slcan_bus(bitrate=1_000_000)
    assert bus.get_version(PATIENCE) == (1, 1)
    network = canopen.Network(bus)
    network.connect()
    node = network.add_node(1, canopen.ObjectDictionary())
    node.sdo.RESPONSE_TIMEOUT = PATIENCE
    assert node.sdo.upload(0x1000, 0) == struct.pack("<I", 0x0002_0194)
    # The call also closes the bus.
    network.disconnect()


def test_ramps_and_steps_are_followed_and_the_run_is_summed_up():
    """A ramp of 100 kPa in 4 s, then a step, so that the pressure at each time stamp is known."""
    simulator = Simulator("--bitrate", "1000", "--pressure", "ramp:100000,200000,4")
    master = Master(simulator)
    tpdo = master.listen(0x181)
    master.ready()
    master.write(0x1800, 5, 100, 2)
    master.node.nmt.send_command(0x01)
    for _ in range(10):
        time, data = tpdo.next()
        ramp = 100_000 + 100_000 * min(time / 4, 1)
        # The sample is up to two milliseconds older than the time stamp, which is the end of the frame.
        assert pascal(data) == pytest.approx(ramp, abs=ADC_STEP + 50)
    simulator.command("pressure step:150000,300000,0.5")
    before, _ = tpdo.until(lambda data: math.isclose(pascal(data), 150_000, abs_tol=ADC_STEP))
    after, _ = tpdo.until(lambda data: math.isclose(pascal(data), 300_000, abs_tol=ADC_STEP))
    assert after - before <= 0.6
    master.close()
    summary = simulator.quit()
    node = summary["nodes"][0]
    assert node["boot_ups"] == 1 and node["heartbeats"] > 0 and node["tpdos"] > 10 and node["sdo_frames"] > 0
    assert node["unmodelled"] == [] and node["incidents"] == []
    assert summary["bus"]["errors"] == 0
