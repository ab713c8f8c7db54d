import os
import random
import signal
import zlib
from dataclasses import dataclass

import pytest
from simulator import Master, Simulator

PERSONALITIES = ("pressure", "encoder", "combined", "lift")
NODE_IDS = (1, 16, 127)
BIT_RATES = (10, 250, 1000)

# A shell starts a program in the background with Ctrl-C ignored, and its children inherit this: a test that presses Ctrl-C would wait.
signal.signal(signal.SIGINT, signal.default_int_handler)


@dataclass(frozen=True)
class Case:
    """A case of the matrix: a test that is not about one personality, node-ID or bit rate runs in several."""

    personality: str
    node: int
    kbit: int

    def flags(self) -> list[str]:
        return ["--node", f"{self.node}:{self.personality}", "--bitrate", str(self.kbit)]

    def __str__(self) -> str:
        return f"{self.personality}-{self.node}-{self.kbit}"


def cases(name: str) -> list[Case]:
    """All cases with THOROUGH, else one for each personality, chosen by the name of the test and MATRIX_SEED."""
    if os.environ.get("THOROUGH") == "1":
        return [Case(name, node, kbit) for name in PERSONALITIES for node in NODE_IDS for kbit in BIT_RATES]
    seed = int(os.environ.get("MATRIX_SEED", "1")) ^ zlib.crc32(name.encode())
    choice = random.Random(seed).choice
    return [Case(personality, choice(NODE_IDS), choice(BIT_RATES)) for personality in PERSONALITIES]


def pytest_generate_tests(metafunc):
    if "case" in metafunc.fixturenames:
        metafunc.parametrize("case", cases(metafunc.function.__name__), ids=str)


def pytest_sessionfinish():
    for simulator in Simulator.started:
        simulator.process.kill()


@pytest.fixture(autouse=True)
def judged():
    """Judges the bus of every simulator that has ended in the test."""
    yield
    for simulator in Simulator.started:
        simulator.judge()


@pytest.fixture
def board(case, request):
    """A simulator with the node of a case of the matrix."""
    simulator = Simulator(*case.flags())
    yield simulator
    simulator.end()
    if "MATRIX_LOG" in os.environ:
        name = request.function.__name__.removeprefix("test_").replace("_", " ")
        with open(os.environ["MATRIX_LOG"], "a") as log:
            log.write(f"{name}\t{case.personality}\t{case.node}\t{case.kbit}\n")


@pytest.fixture(scope="module")
def simulator():
    """One simulator for all tests of a file."""
    simulator = Simulator("--bitrate", "1000", "--pressure", "const:250000")
    Master(simulator).ready().close()
    yield simulator
    simulator.end()


@pytest.fixture
def master(simulator):
    """A new connection to a node that was just reset, so that no test depends on another."""
    master = Master(simulator)
    boot_up = master.listen(0x701)
    master.node.nmt.send_command(0x81)
    boot_up.until(lambda data: data == b"\x00")
    yield master
    master.close()


@pytest.fixture(scope="module")
def driver():
    """One browser for all tests of a file."""
    # Tests without a browser do not need selenium.
    from page import browser

    driver = browser()
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def server(simulator):
    """The server of the page, on the simulator of the file."""
    from page import Server

    server = Server(simulator)
    yield server
    server.stop()
