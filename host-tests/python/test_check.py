"""`nodectl check` beside a plain `cargo sim`, page and all, at the speed of a real board.

Time limits of checks are those of the host's clock here. What the firmware does in virtual time is judged by `conforming`
on the emulated board, where a deviation counts at once.
"""

import json
import os
import signal
import subprocess
import time

import pytest
from simulator import BOOT_UP, PATIENCE, Master, Relay, Simulator, nodectl

#: The personality that is checked in a usual run; --thorough checks all.
CHECKED = ["pressure", "lift", "encoder", "combined"] if "THOROUGH" in os.environ else ["pressure"]

#: On a busy host, a check may need several tries. A fault of the firmware deviates in each.
TRIES = 6


def check(simulator: Simulator, only: list[str]) -> dict[str, str]:
    """The checks that failed, with what they expected and saw. An empty list is all checks."""
    flags = ["--only", ",".join(only)] if only else []
    done = nodectl(simulator, "--json", "check", "--yes", *flags, node=5)
    try:
        # The report is the first line; where a check has failed, the error of the command follows.
        report = json.loads(done.stdout.splitlines()[0])
        failed = [result for result in report["checks"] if result["verdict"] == "failed"]
    except (IndexError, KeyError, ValueError):
        raise AssertionError(f"no report, exit code {done.returncode}: {done.stdout[-2000:]} {done.stderr}") from None
    assert done.returncode == (9 if failed or report["left_behind"] else 0), done.stderr
    assert not report["left_behind"], report["left_behind"]
    return {result["id"]: f"expected {result['expected']}, seen {result['seen']}" for result in failed}


@pytest.mark.parametrize("personality", CHECKED)
def test_every_check_passes(personality: str):
    simulator = Simulator("--node", f"5:{personality}", "--bitrate", "1000", speed="real")
    Master(simulator).close()
    failed = check(simulator, [])
    for _ in range(TRIES - 1):
        if failed:
            print("again:", failed)
            failed = check(simulator, list(failed))
    assert not failed, f"failed in each of {TRIES} tries: {failed}"
    simulator.quit()


#: The checks, and the write after which they are interrupted: the first change of a TPDO, the order to restore the defaults, an order to save.
CHANGES = [("PDO", "2B00180"), ("STO", "23111001"), ("STO-2", "23101001")]


@pytest.mark.parametrize("term", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(("personality", "only", "change"), [(name, *change) for name, change in zip(("pressure", "encoder", "combined"), CHANGES)])
def test_an_interrupted_check_leaves_what_the_node_had(personality: str, only: str, change: str, term: signal.Signals):
    simulator = Simulator("--node", f"5:{personality}", "--bitrate", "1000", speed="real")
    Master(simulator).close()
    assert nodectl(simulator, "write", "1017", "700", node=5).returncode == 0
    assert nodectl(simulator, "save", node=5).returncode == 0
    before = nodectl(simulator, "dump", node=5).stdout
    relay = Relay(simulator)
    command = [os.environ["NODECTL_COMMAND"], "--bus", f"socketcand://127.0.0.1:{relay.socketcand}/vcan0", "--node", "5"]
    process = subprocess.Popen([*command, "check", "--yes", "--only", only], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    end = time.monotonic() + PATIENCE
    while not any(can_id == 0x605 and data.startswith(change) for _, _, can_id, data in list(relay.frames)):
        assert process.poll() is None and time.monotonic() < end, f"no write {change}: {process.communicate()}"
        time.sleep(0.01)
    process.send_signal(term)
    out, error = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130 and "interrupted" in error and "the run was interrupted" in out, (out, error)
    assert nodectl(simulator, "dump", node=5).stdout == before
    assert nodectl(simulator, "nmt", "reset", node=5).returncode == 0
    assert nodectl(simulator, "dump", node=5).stdout == before, "what was saved is saved"
    simulator.quit()


def test_a_second_signal_ends_a_check_at_once():
    simulator = Simulator("--node", "5:pressure", speed="real")
    # The node has booted before the check makes it boot.
    assert nodectl(simulator, "read", "1000", node=5).returncode == 0
    master = Master(simulator)
    boot_up = master.listen(0x705)
    command = [os.environ["NODECTL_COMMAND"], "--bus", f"socketcand://127.0.0.1:{simulator.socketcand}/vcan0", "--node", "5"]
    process = subprocess.Popen([*command, "check", "--yes", "--only", "STO"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    boot_up.until(lambda data: data == BOOT_UP)
    process.send_signal(signal.SIGINT)
    assert "a second Ctrl-C ends at once" in process.stderr.readline()
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, error
    assert error.startswith("ended at once: node 5 may have values") and "its saved parameters may be the defaults" in error, error
    master.close()
    simulator.quit()
