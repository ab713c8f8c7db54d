"""`nodectl check` beside a plain `cargo sim`, page and all."""

import os

import pytest
from simulator import Master, Simulator, nodectl

#: The personality that is checked in a usual run; --thorough checks all.
CHECKED = ["pressure", "lift", "encoder", "combined"] if "THOROUGH" in os.environ else ["pressure"]


@pytest.mark.parametrize("personality", CHECKED)
def test_every_check_passes(personality: str):
    simulator = Simulator("--node", f"5:{personality}", "--bitrate", "1000", speed="real")
    Master(simulator).close()
    done = nodectl(simulator, "check", "--yes", node=5)
    assert done.returncode == 0, done.stdout
    simulator.quit()
