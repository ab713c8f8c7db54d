"""The sources of the pictures in docs/pictures: pictures.py writes a hash of them, a test compares it."""

import hashlib
import json
from pathlib import Path

ROOT = Path(__file__).parents[2]
STATED = ROOT / "docs" / "pictures" / "sources.json"

#: What draws the pictures: the page, and the screen of the simulator.
SOURCES = {"page": ["tools/nodectl/web"], "terminal": ["emulator/sim/src/display"]}


def hashes() -> dict[str, str]:
    """A hash of the names and contents of all files of each group of pictures."""
    found = {}
    for group, folders in SOURCES.items():
        whole = hashlib.sha256()
        for folder in folders:
            for file in sorted(file for file in (ROOT / folder).rglob("*") if file.is_file()):
                whole.update(str(file.relative_to(ROOT / folder)).encode() + b"\0" + file.read_bytes() + b"\0")
        found[group] = whole.hexdigest()
    return found


def write() -> None:
    STATED.write_text(json.dumps(hashes(), indent=2) + "\n", encoding="utf-8")


def stated() -> dict[str, str]:
    return json.loads(STATED.read_text(encoding="utf-8"))
