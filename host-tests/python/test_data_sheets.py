"""The corpus of data sheets, read by nodectl, by python-canopen and by Lely's dcf-tools. With -s the table is printed."""

import contextlib
import io
import os
import subprocess
import sys
from pathlib import Path

import canopen

CORPUS = Path(__file__).parents[2] / "tools" / "eds" / "tests" / "corpus"
PAGE = Path(__file__).parents[2] / "docs" / "data-sheets.md"
NODE_ID = "5"


def files() -> list[Path]:
    return sorted([*CORPUS.glob("*.eds"), *CORPUS.glob("*.dcf")], key=lambda path: path.stem)


def oddity(path: Path) -> str:
    """The first line of a file says what it shows."""
    return path.read_bytes().splitlines()[0].decode("latin-1").replace("\u00ef\u00bb\u00bf", "").lstrip("; ").strip()


def by_nodectl(path: Path) -> str:
    line = [os.environ["NODECTL_COMMAND"], "diff", path, path]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    warnings = {line for line in done.stderr.splitlines() if line.startswith("warning: ")}
    assert done.returncode in (0, 7), done.stderr
    if done.returncode:
        return "no"
    return f"{len(warnings)} warning{'s' * (len(warnings) != 1)}" if warnings else "yes"


def by_python_canopen(path: Path) -> str:
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            dictionary = canopen.import_od(str(path), int(NODE_ID))
    except Exception as error:
        return f"no ({type(error).__name__})"
    return "yes" if 0x1017 in dictionary else "in part"


def by_lely(path: Path) -> str:
    checker = Path(sys.executable).with_name("dcfchk")
    done = subprocess.run([checker, "-n", NODE_ID, path], capture_output=True, check=False)
    if done.returncode:
        return "no"
    return "with warnings" if done.stdout or done.stderr else "yes"


def table() -> list[str]:
    rows = ["| file | it shows | nodectl | python-canopen | Lely |", "|---|---|---|---|---|"]
    for path in files():
        row = [path.name, oddity(path), by_nodectl(path), by_python_canopen(path), by_lely(path)]
        rows.append("| " + " | ".join(cell.replace("|", "/") for cell in row) + " |")
    return rows


def test_what_others_read_is_read_by_nodectl():
    rows = table()
    print(*rows, sep="\n")
    assert len(rows) >= 62
    for row in rows[2:]:
        ours, *others = [cell.strip() for cell in row.split("|")][3:6]
        assert ours != "no" or all(other.startswith("no") for other in others), row
    assert "\n".join(rows) in PAGE.read_text(encoding="utf-8"), "the table of docs/data-sheets.md has changed"
