import pytest
from simulator import Master, Simulator


def pytest_sessionfinish():
    for simulator in Simulator.started:
        simulator.process.kill()


@pytest.fixture(scope="module")
def simulator():
    """One simulator for all tests of a file."""
    simulator = Simulator("--bitrate", "1000", "--pressure", "const:250000")
    Master(simulator).ready().close()
    yield simulator
    simulator.process.kill()


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
