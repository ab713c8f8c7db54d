"""`nodectl check` beside a plain `cargo sim`, page and all, at the speed of a real board.

Time limits of checks are those of the host's clock here. What the firmware does in virtual time is judged by `conforming`
on the emulated board, where a deviation counts at once.
"""

import json
import os

import pytest
from simulator import Master, Simulator, nodectl

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
