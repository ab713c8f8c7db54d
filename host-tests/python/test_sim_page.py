"""The page and the control connection that the simulator serves beside the bus."""

import json
import socket
import time
import urllib.request

import pytest
from full_bus import Client
from simulator import PATIENCE, Simulator


def answers(url: str) -> bool:
    try:
        return urllib.request.urlopen(url).status == 200
    except OSError:
        return False


def with_page(address: str) -> Simulator:
    return Simulator(page=address, speed="real")


@pytest.mark.parametrize("end", [Simulator.quit, lambda simulator: simulator.process.kill()])
def test_the_page_is_there_as_long_as_the_simulator_however_that_ends(end):
    simulator = with_page("127.0.0.1:0")
    url = simulator.greeting["page"]
    assert answers(url)
    end(simulator)
    deadline = time.monotonic() + PATIENCE
    while answers(url):
        assert time.monotonic() < deadline, "the page has outlived its simulator"
        time.sleep(0.05)


def test_from_elsewhere_nothing_goes_without_the_token():
    """A server for other machines shows its address with the token, and refuses clients without the token."""
    simulator = with_page("0.0.0.0:0")
    url = simulator.greeting["page"]
    place, token = url.split("?token=")
    here = place.replace("0.0.0.0", "127.0.0.1")
    assert not answers(here) and not answers(f"{here}?token={'0' * len(token)}")
    assert not answers(f"{here}js/main.js")
    assert answers(f"{here}?token={token}")
    simulator.quit()


def test_a_port_that_is_taken_is_no_error():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        simulator = with_page(f"127.0.0.1:{port}")
        url = simulator.greeting["page"]
        assert url.startswith("http://127.0.0.1:") and f":{port}/" not in url
        assert answers(url)
        simulator.quit()


def test_the_host_starts_the_nodes_although_the_page_looks_on():
    simulator = with_page("127.0.0.1:0")
    page = Client(simulator.greeting["page"])
    states = []
    end = time.monotonic() + PATIENCE
    while "operational" not in states:
        assert time.monotonic() < end, states
        states += [node["state"] for node in page.next().get("nodes", [])]
    simulator.quit()


def test_stimuli_are_changed_and_told_over_the_control_connection():
    simulator = Simulator("--control", "127.0.0.1:0")
    host, port = simulator.greeting["control"].split(":")
    with socket.create_connection((host, int(port)), timeout=PATIENCE) as control, control.makefile() as lines:

        def ask(line: str) -> dict:
            control.sendall(f"{line}\n".encode())
            return json.loads(lines.readline())

        assert ask("pressure 1=const:300000") == {"ok": True}
        assert ask("fault 1=open-sensor:on") == {"ok": True}
        (board,) = ask("boards")["boards"]
        assert (board["pressure"], board["faults"]) == ({"spec": "const:300000", "value": 300000.0}, ["open-sensor"])
        assert ask("fault 1=open-sensor:off") == {"ok": True}
        assert ask("boards")["boards"][0]["faults"] == []
        assert "there is no node 9" in ask("pressure 9=const:1")["error"]
        assert ask("quit") == {"ok": True}
    simulator.summary()
