"""The golden values in the tree equal the output of their scripts."""

import subprocess
import sys
from pathlib import Path

import pytest

GOLDEN = Path(__file__).parent.parent / "golden"


@pytest.mark.parametrize("script", sorted(GOLDEN.glob("*_*.py")), ids=lambda path: path.stem)
def test_script_writes_what_is_in_the_tree(script, tmp_path):
    subprocess.run([sys.executable, "-B", script, tmp_path], check=True)
    written = sorted(tmp_path.iterdir())
    assert written
    for file in written:
        assert file.read_text() == (GOLDEN / file.name).read_text(), f"run {script.name} and commit {file.name}"
