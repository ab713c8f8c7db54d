"""Every EDS is read by the importers that registries offer: python-canopen and Lely's dcf-tools (PyPI), canopen (npm)."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import canopen
import pytest
from canopen import objectdictionary as od
from simulator import PATIENCE, Master, Simulator

ROOT = Path(__file__).parents[2]
SHEETS = sorted((ROOT / "eds").glob("*.eds"))
NODE_ID = 5
#: The npm package, unpacked once.
NPM = ROOT / "target" / "npm"

every_sheet = pytest.mark.parametrize("path", SHEETS, ids=lambda path: path.stem)


def entries(path: Path) -> int:
    """The sections of the file that are entries: those with a data type."""
    return path.read_text(encoding="utf-8").count("\nDataType=")


def test_there_are_four():
    assert [path.stem for path in SHEETS] == ["combined", "encoder", "lift", "pressure"]


@every_sheet
def test_lely_accepts_it_without_a_warning(path: Path):
    checker = Path(sys.executable).with_name("dcfchk")
    done = subprocess.run([checker, "-n", str(NODE_ID), path], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@every_sheet
def test_python_canopen_has_every_entry(path: Path):
    variables = []
    for index, entry in canopen.import_od(str(path), NODE_ID).items():
        if index >= 0x1000:
            variables += [entry] if isinstance(entry, od.ODVariable) else list(entry.subindices.values())
    assert len(variables) == entries(path)
    # The importer does not accept bits for a real number: such an entry has no default here, and no wrong one.
    reals = [variable.default for variable in variables if variable.data_type == od.REAL32]
    assert set(reals) <= {None, 0.0}


SCRIPT = """
const { Eds } = require(process.argv[1] + '/node_modules/canopen/source/eds.js');
const eds = Eds.fromFile(process.argv[2]);
let count = 0;
for (const entry of Object.values(eds.dataObjects))
    count += entry._subObjects ? Object.values(entry._subObjects).filter((sub) => sub).length : 1;
console.log(JSON.stringify({ count, name: eds.productName }));
"""


@pytest.fixture(scope="module")
def npm() -> Path:
    if not (shutil.which("npm") and shutil.which("node")):
        pytest.skip("there is no npm")
    if not (NPM / "node_modules" / "canopen").exists():
        NPM.mkdir(parents=True, exist_ok=True)
        install = ["npm", "install", "--silent", "--ignore-scripts", "--no-save", "--prefix", str(NPM), "canopen@6.2.1"]
        subprocess.run(install, check=True, cwd=NPM)
    return NPM


@every_sheet
def test_canopen_of_npm_has_every_entry(path: Path, npm: Path):
    done = subprocess.run(["node", "-e", SCRIPT, npm, path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["count"] == entries(path)


def check(path: Path) -> None:
    checker = Path(sys.executable).with_name("dcfchk")
    done = subprocess.run([checker, path], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_dump_of_a_node_is_read_by_all(simulator: Simulator, npm: Path, tmp_path: Path):
    """`nodectl dump` writes a DCF (CiA 306): the data sheet with the values of one node."""
    path, bits = tmp_path / "node.dcf", tmp_path / "bits.dcf"
    Master(simulator).close()
    bus = f"socketcand://127.0.0.1:{simulator.socketcand}/vcan0"
    command = [os.environ["NODECTL_COMMAND"], "--bus", bus, "--node", "1"]
    for arguments in (["write", "1017", "500"], ["write", "6124:1", "0.25"], ["dump", str(path)], ["dump", "--bits", str(bits)]):
        subprocess.run([*command, *arguments], check=True, stdout=subprocess.DEVNULL, timeout=PATIENCE)
    check(bits)
    dictionary = canopen.import_od(str(path))
    assert dictionary.node_id == 1
    assert (dictionary[0x1017].value, dictionary[0x1017].default) == (500, 1000)
    done = subprocess.run(["node", "-e", SCRIPT, npm, path], capture_output=True, text=True, check=False)
    assert json.loads(done.stdout)["count"] == entries(path)
    # python-canopen reads decimal numbers, Lely the bits of a real number.
    assert dictionary[0x6124][1].value == 0.25
    assert "ParameterValue=0x3E800000" in bits.read_text(encoding="utf-8")
