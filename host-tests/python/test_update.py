"""The firmware is replaced and put back, at the speed of a real board: to B by a stock python-canopen client that follows the
sequence of CiA 302-3, back to A by `nodectl update`.
"""

import base64
import hmac
import json
import os
import re
import shlex
import signal
import subprocess
import time
from pathlib import Path

import canopen
import pytest
from simulator import PATIENCE, Master, Relay, Simulator

STOP, START, CLEAR = 0, 1, 3
AUTHORISATION = 0x2003
CLOSED, OPEN = 1, 2
BUSY = 1
BOOT = int.from_bytes(b"TOOB", "little")
DATA, CONTROL, IDENTIFICATION, STATUS = 0x1F50, 0x1F51, 0x1F56, 0x1F57


@pytest.fixture
def simulator():
    simulator = Simulator("--bitrate", "1000", speed="real")
    yield simulator
    simulator.end()


def image(path: Path, version: str) -> Path:
    """The application, signed as another version, with another identification because a word is added to its code."""
    elf = Path(os.environ["NODE_IMAGES"]) / "firmware"
    signed = elf.with_name("firmware.img").read_bytes()
    code = path.with_suffix(".bin")
    code.write_bytes(signed[512:] + b"\xb0" * 4)
    sign = [os.environ["SIGN_COMMAND"], "image", code, "--image-version", version, "--out", path]
    subprocess.run(sign, check=True, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    return path


def identification(file: Path) -> int:
    """CRC-32 of the code, at the place given in docs/update.md."""
    return int.from_bytes(file.read_bytes()[28:32], "little")


def until(condition, what: str):
    """Repeats a request, like a master that does not know how long a step takes."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            if condition():
                return
        except canopen.SdoCommunicationError:
            pass
        time.sleep(0.1)
    raise AssertionError(f"the node does not {what}")


def command_that_restarts(master: Master, command: int) -> None:
    """Sends a command; the node may restart before it acknowledges."""
    try:
        master.write(CONTROL, 1, command, 1)
    except canopen.SdoCommunicationError:
        pass


def update_by_the_standard(master: Master, program: bytes) -> None:
    command_that_restarts(master, STOP)
    until(lambda: master.read(CONTROL, 1) == 0, "stop")
    assert master.read(0x1000) == BOOT
    master.write(CONTROL, 1, CLEAR, 1)
    until(lambda: not master.read(STATUS, 1) & BUSY, "clear")
    assert master.read(STATUS, 1) == 0
    with master.node.sdo.open(DATA, 1, "wb", size=len(program), block_transfer=True) as stream:
        stream.write(program)
    until(lambda: not master.read(STATUS, 1) & BUSY, "verify")
    assert master.read(STATUS, 1) == 0
    command_that_restarts(master, START)
    until(lambda: master.read(CONTROL, 1) == 1, "start")


def nodectl(simulator: Simulator, *arguments) -> dict:
    bus = f"socketcand://127.0.0.1:{simulator.socketcand}/vcan0"
    command = [os.environ["NODECTL_COMMAND"], "--bus", bus, "--node", "1", "--json", *arguments]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, timeout=10 * PATIENCE)
    return json.loads(done.stdout)


def test_an_update_by_python_canopen_and_back_by_nodectl(simulator: Simulator, tmp_path: Path):
    a = Path(os.environ["NODE_IMAGES"]) / "firmware.img"
    b = image(tmp_path / "b.img", "0.2.0")
    master = Master(simulator)
    master.ready()
    # A request lost in a restart must be noticed soon, and a late answer of a busy host must not be an error.
    master.node.sdo.RESPONSE_TIMEOUT = 5.0
    until(lambda: master.read(IDENTIFICATION, 1) == identification(a), "run A")
    update_by_the_standard(master, b.read_bytes())
    assert master.read(IDENTIFICATION, 1) == identification(b)
    master.close()

    # The trial is decided before the next update. Both images have the same version: a master that compares versions
    # needs no force.
    assert nodectl(simulator, "confirm")["result"] == "confirmed"
    report = nodectl(simulator, "update", a)
    assert report["result"] == "updated"
    assert (report["old_identification"], report["new_identification"]) == (identification(b), identification(a))
    # The log has both updates, the newest event first.
    events = ["confirmed by a command", "on trial"] * 2
    until(lambda: [entry["event"] for entry in nodectl(simulator, "info")["program"]["log"]] == events, "log both updates")
    program = nodectl(simulator, "info")["program"]
    assert [entry["version"] for entry in program["log"]] == ["0.1.0", "0.1.0", "0.2.0", "0.2.0"]
    assert (program["sector_erases"], program["clears_allowed"]) == (6, 48)
    assert simulator.quit()["bus"]["errors"] == 0


def test_an_update_that_is_interrupted_in_its_check_is_ended_by_the_next_run(simulator: Simulator, tmp_path: Path):
    """The node checks the program on its own. The next run finds it on trial in the bootloader, starts it, and confirms it."""
    b = image(tmp_path / "b.img", "0.2.0")
    c = Path(os.environ["NODE_IMAGES"]) / "firmware.img"

    def update(bus: Simulator | Relay, program: Path) -> list:
        return [os.environ["NODECTL_COMMAND"], "--bus", f"socketcand://127.0.0.1:{bus.socketcand}/vcan0", "--node", "1", "update", program]

    def interrupt() -> None:
        """Sends the signal when nodectl has asked for the state of the check, and before it has the answer."""
        relay = Relay(simulator)
        relay.holds = lambda frames: frames[-1][3].startswith("40571F01") and any(data[2:8] == "501F01" for _, _, _, data in frames)
        with subprocess.Popen(update(relay, b)) as run:
            assert relay.has_held.wait(10 * PATIENCE), "the program was not downloaded"
            run.send_signal(signal.SIGINT)
        assert run.returncode == -signal.SIGINT

    interrupt()
    report = nodectl(simulator, "update", b)
    assert (report["result"], report["new_identification"], report["on_trial"]) == ("updated", identification(b), False)
    # Another program is not taken for that of the file.
    assert nodectl(simulator, "update", c)["result"] == "updated"
    interrupt()
    refused = subprocess.run(update(simulator, c), capture_output=True, text=True, check=False)
    assert refused.returncode == 6, refused.stderr
    assert "its program is on trial" in refused.stderr
    assert nodectl(simulator, "confirm")["identification"] == identification(b)


def test_the_holder_of_its_key_opens_a_node_with_the_standard_library():
    """The bootloader has a key, but no program signed by its owner. The Python code is that of docs/update.md."""
    simulator = Simulator("--bitrate", "1000", speed="real", bootloader="bootloader-guarded")
    master = Master(simulator)
    assert master.read(0x1000) == BOOT
    assert master.read(AUTHORISATION, 1) == CLOSED
    with pytest.raises(canopen.SdoAbortedError) as refused:
        master.write(CONTROL, 1, CLEAR, 1)
    assert refused.value.code == 0x0800_0022

    digits = Path(__file__).parent.parent / "tests" / "board" / "update" / "authorisation-key.hex"
    key = bytes.fromhex(digits.read_text())
    node = master.node
    message = node.sdo.upload(AUTHORISATION, 2) + node.sdo.upload(0x1018, 4)
    node.sdo.download(AUTHORISATION, 3, hmac.new(key, message, "sha512").digest()[:8])
    assert master.read(AUTHORISATION, 1) == OPEN
    master.write(CONTROL, 1, CLEAR, 1)
    master.close()
    simulator.quit()


ROOT = Path(__file__).parent.parent.parent


def documented(word: str) -> list[str]:
    """The commands of docs/update.md that begin with this word after `cargo xtask sign`, without their comments."""
    text = (ROOT / "docs" / "update.md").read_text().replace("\\\n", " ")
    found = re.findall(rf"^cargo xtask sign ({word} [^#\n]*)", text, re.MULTILINE)
    assert found, f"docs/update.md has no `cargo xtask sign {word}`"
    return found


def pem(secret: bytes) -> str:
    """An Ed25519 key in PKCS#8 (RFC 8410)."""
    der = bytes.fromhex("302e020100300506032b657004220420") + secret
    return f"-----BEGIN PRIVATE KEY-----\n{base64.b64encode(der).decode()}\n-----END PRIVATE KEY-----\n"


def test_the_documented_commands_lead_from_a_key_to_an_accepted_update(tmp_path: Path):
    """The bootloader of the owner is built with the keys of the tests, so these take the place of the new ones."""
    home = tmp_path / "home"
    (home / "secret").mkdir(parents=True)
    (home / "safe").mkdir()
    (home / "vault").mkdir()

    def sign(command: str) -> str:
        images = str(Path(os.environ["NODE_IMAGES"]) / "firmware")
        command = command.replace("~", str(home)).replace("target/thumbv7em-none-eabihf/release/firmware", images)
        arguments = [os.environ["SIGN_COMMAND"], *shlex.split(command)]
        return subprocess.run(arguments, check=True, stdout=subprocess.PIPE, text=True, cwd=tmp_path).stdout

    for command in documented("key"):
        assert re.fullmatch(r"UPDATE_(RELEASE|ROOT|RECOVERY)_KEY=[0-9a-f]{64}\n", sign(command))
    for name, secret in [("secret/release.pem", 0x42), ("safe/root.pem", 0x43), ("vault/recovery.pem", 0x44)]:
        (home / name).write_text(pem(bytes([secret] * 32)))
    assert sign("public ~/safe/root.pem --rank root").startswith("UPDATE_ROOT_KEY=")
    assert sign("public ~/safe/root.pem").startswith("PUBLIC_KEY="), "a file does not contain the rank"
    files = {"RELEASE_1": "secret/release-1", "ROOT_1": "safe/root-1", "RELEASE_2": "secret/release-2"}
    for command in documented("key-list"):
        for word, file in files.items():
            command = command.replace(word, sign(f"public ~/{file}.pem").split("=")[1].strip())
        assert "generation" in sign(command)
    for command in documented("image"):
        sign(command)
    for command in documented("show"):
        assert "signature   good" in sign(command)

    simulator = Simulator("--bitrate", "1000", speed="real", bootloader="bootloader-owner")
    report = nodectl(simulator, "update", tmp_path / "node-1.4.0.img")
    assert report["result"] == "updated"
    assert report["new_identification"] == identification(tmp_path / "node-1.4.0.img")
    assert simulator.quit()["bus"]["errors"] == 0
