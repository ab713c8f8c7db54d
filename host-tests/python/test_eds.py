"""Every EDS is read by the importers that registries offer: python-canopen and Lely's dcf-tools (PyPI), canopen (npm)."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import canopen
import pytest
from canopen import objectdictionary as od

ROOT = Path(__file__).parents[2]
SHEETS = sorted((ROOT / "eds").glob("*.eds"))
NODE_ID = 5
#: The npm package, unpacked once.
NPM = ROOT / "target" / "npm"

every_sheet = pytest.mark.parametrize("path", SHEETS, ids=lambda path: path.stem)


def entries(path: Path) -> int:
    """Sections of the file that are an entry: those with a data type."""
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
    # It takes no bits for a real number: such an entry has no default here, and none that is wrong.
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
