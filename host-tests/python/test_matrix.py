"""Tests of `nodectl` that are not about one personality, node-ID or bit rate: each runs in several cases."""

import json
import os
import subprocess

from conftest import Case
from simulator import Simulator


class Nodectl:
    """`nodectl` on the bus of a simulator, for the node of a case."""

    def __init__(self, simulator: Simulator, case: Case):
        bus = f"socketcand://127.0.0.1:{simulator.socketcand}/vcan0"
        self.command = [os.environ["NODECTL_COMMAND"], "--bus", bus, "--node", str(case.node), "--json"]
        self.wait()

    def run(self, *arguments: str, timeout: int = 20000) -> subprocess.CompletedProcess:
        """Runs a command. At 10 kbit/s a frame takes 13 ms, and the machine may be busy."""
        limits = ["--timeout", str(timeout), "--limit", "120"]
        return subprocess.run([*self.command, *limits, *arguments], capture_output=True, text=True)

    def wait(self) -> None:
        """Waits until the node answers."""
        for _ in range(60):
            if self.run("read", "1000", timeout=1000).returncode == 0:
                return
        raise AssertionError("the node does not answer")

    def __call__(self, *arguments: str) -> list[dict]:
        result = self.run(*arguments)
        assert result.returncode == 0, f"{arguments}: {result.stdout}{result.stderr}"
        return [json.loads(line) for line in result.stdout.splitlines()]


def test_read_and_write(board: Simulator, case: Case):
    nodectl = Nodectl(board, case)
    nodectl("write", "1017", "500")
    assert nodectl("read", "1017")[0]["value"] == 500
    assert nodectl.run("write", "1000", "1").returncode == 1


def test_nmt(board: Simulator, case: Case):
    nodectl = Nodectl(board, case)
    for command in ("start", "preop", "stop", "start"):
        nodectl("nmt", command)


def test_scan_and_info(board: Simulator, case: Case):
    nodectl = Nodectl(board, case)
    assert [node["node"] for node in nodectl("scan")[0]["nodes"]] == [case.node]
    assert nodectl("info")


def test_dump_apply_and_diff(board: Simulator, case: Case, tmp_path):
    nodectl = Nodectl(board, case)
    dcf = str(tmp_path / "node.dcf")
    nodectl("write", "1017", "500")
    nodectl("dump", dcf)
    nodectl("write", "1017", "600")
    assert nodectl.run("diff", dcf).returncode == 8
    nodectl("apply", dcf)
    assert nodectl("read", "1017")[0]["value"] == 500
    nodectl("diff", dcf)


def test_save_and_restore(board: Simulator, case: Case):
    nodectl = Nodectl(board, case)
    nodectl("write", "1017", "500")
    nodectl("save")
    nodectl("nmt", "reset")
    nodectl.wait()
    assert nodectl("read", "1017")[0]["value"] == 500
    nodectl("restore")
    nodectl("nmt", "reset")
    nodectl.wait()
    assert nodectl("read", "1017")[0]["value"] != 500
