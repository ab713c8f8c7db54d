"""The documents: commands are run as they are written, in their order, and links, paths and figures are right.

A fenced block with `{test=NAME}` after its language is run. The blocks of one name in one document share a simulator,
which a line `cargo sim` starts with its flags. `sh` blocks run in bash, `python` blocks in this interpreter, and the lines
of `text` blocks are typed into the simulator's terminal. A `console` block has commands after `$ ` and their output; a
command fails where its output is an error.
"""

import os
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path
from xml.etree import ElementTree

import error_budget
import picture_sources
import pytest
from simulator import ONCE_MORE, PATIENCE, Simulator

ROOT = Path(__file__).parent.parent.parent
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```(\w+) \{test=(\w+)\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)
TAG = re.compile(r"\{(test=\w+|endless|home)\}$")

Block = tuple[str, str]

#: A path of a file that the reader makes.
EXAMPLE = re.compile(r"NAME|my_f407")

#: The exit code of `nodectl diff` for two configurations that differ.
DIFFERENCE = 8


def threads() -> dict[str, list[Block]]:
    """The blocks of each thread, by the name of the document and of the thread."""
    found: dict[str, list[Block]] = {}
    for document in DOCUMENTS:
        for language, name, text in BLOCK.findall(document.read_text(encoding="utf-8")):
            found.setdefault(f"{document.stem}-{name}", []).append((language, text))
    return found


class Thread:
    """A user who follows a document."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.simulator: Simulator | None = None
        # The documents call `nodectl` by its name.
        (folder / "bin").mkdir()
        (folder / "bin" / "nodectl").symlink_to(Path(os.environ["NODECTL_COMMAND"]).resolve())

    def run(self, language: str, text: str) -> None:
        getattr(self, language)(text)

    def sh(self, text: str) -> None:
        text = text.replace("cargo nodectl", "nodectl")
        text = text.replace("target/thumbv7em-none-eabihf/release", str(Path(os.environ["NODE_IMAGES"]).resolve()))
        lines = text.splitlines()
        for line in [line for line in lines if line.startswith("cargo sim")]:
            assert self.simulator is None, "the thread has a simulator"
            flags, _, speed = line.partition(" --speed ")
            self.simulator = Simulator(*shlex.split(flags, comments=True)[2:], speed=speed.split(" ")[0] or "real")
            self._wait_for_the_boards()
        self._succeeds("\n".join(line for line in lines if not line.startswith("cargo sim")))

    def _wait_for_the_boards(self) -> None:
        """A user types slower than a board boots. Boards without a node-ID send nothing that shows it."""
        if not self.simulator.devices:
            time.sleep(ONCE_MORE)
        for node in self.simulator.devices:
            until = time.monotonic() + PATIENCE
            while self._bash(f"nodectl --node {node} read 1000h").returncode and time.monotonic() < until:
                pass

    def _bash(self, commands: str) -> subprocess.CompletedProcess:
        path = f"{self.folder / 'bin'}:{os.environ['PATH']}"
        bus = f"socketcand://127.0.0.1:{self.simulator.socketcand}/vcan0"
        return self._run(["bash", "-exc", commands], self.folder, {**os.environ, "PATH": path, "NODECTL_BUS": bus})

    def _succeeds(self, commands: str) -> None:
        run = self._bash(commands)
        assert run.returncode == 0, f"{run.stdout}{run.stderr}"

    def python(self, text: str) -> None:
        assert "29536" in text, "the port of the simulator"
        text = text.replace("29536", str(self.simulator.socketcand))
        run = self._run([sys.executable, "-c", text], ROOT, dict(os.environ))
        assert run.returncode == 0, f"{run.stdout}{run.stderr}"

    def console(self, text: str) -> None:
        for command, output in re.findall(r"^\$ (.*)\n((?:[^$].*\n|\n)*)", text, re.MULTILINE):
            expected = [1] if output.startswith("nodectl: ") else [0, DIFFERENCE] if " diff " in command else [0]
            run = self._bash(command)
            assert run.returncode in expected, f"{command}\n{run.stdout}{run.stderr}"

    def text(self, text: str) -> None:
        for line in text.splitlines():
            self.simulator.command(line)

    def end(self) -> None:
        assert self.simulator is not None, "the first line of a thread starts a simulator"
        assert self.simulator.quit()["bus"]["errors"] == 0

    @staticmethod
    def _run(command: list[str], folder: Path, environment: dict[str, str]) -> subprocess.CompletedProcess:
        return subprocess.run(
            command, cwd=folder, env=environment, timeout=PATIENCE, capture_output=True, text=True, check=False
        )


@pytest.mark.parametrize("name", threads())
def test_the_commands_of_a_thread_succeed_in_their_order(name: str, tmp_path: Path):
    thread = Thread(tmp_path)
    for language, text in threads()[name]:
        thread.run(language, text)
    thread.end()


def test_commands_are_tagged():
    """A document whose commands are run has no untagged block with a command of `nodectl`. Blocks with the tag `endless`
    or `home` are not run: their commands do not end, or write into the home directory of the reader."""
    for document in DOCUMENTS:
        blocks = re.findall(r"^```([^\n]*)\n(.*?)^```$", document.read_text(encoding="utf-8"), re.M | re.S)
        if any("{test=" in head for head, _ in blocks):
            untagged = [block for head, block in blocks if not TAG.search(head) and "\nnodectl " in f"\n{block}"]
            assert not untagged, f"{document.name}: {untagged}"


def commands(document: Path) -> list[str]:
    """The commands of `nodectl` in a document, in blocks and in the text, without comments and placeholders."""
    text = document.read_text(encoding="utf-8").replace("cargo nodectl", "nodectl").replace("\\\n", " ")
    lines = re.findall(r"^(?:\$ )?(nodectl [^\n]*)", "\n".join(re.findall(r"^```.*?^```", text, re.M | re.S)), re.M)
    text = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    inline = [re.sub(r"\s+", " ", command) for command in re.findall(r"`(nodectl [^`]+)`", text)]
    found = [re.sub(r"\s+(#|>|&&|\|) .*", "", command).strip() for command in lines + inline]
    return [command for command in found if not re.search(r"…|\.\.\.|\b[A-Z]{3,}\b|\[", command)]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda document: document.name)
def test_commands_are_understood(document: Path):
    """Without a bus a command ends with exit code 4, or 7 without its file, and a wrong one with 2."""
    environment = {**os.environ, "NODECTL_BUS": "socketcand://127.0.0.1:9/none"}
    wrong = []
    for command in commands(document):
        arguments = shlex.split(command)[1:]
        if {"serve", "man", "completions", "explain"} & set(arguments):
            continue
        command_line = [os.environ["NODECTL_COMMAND"], *arguments]
        run = subprocess.run(command_line, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE)
        is_mention = re.search("required arguments were not provided|a value is required", run.stderr) or len(arguments) == 1
        if run.returncode == 2 and not is_mention:
            wrong.append((command, run.stderr.splitlines()[:1]))
    assert not wrong


def test_commands_of_the_project_exist():
    source = (ROOT / "xtask/src/main.rs").read_text(encoding="utf-8")
    variants = re.findall(r"^    ([A-Z][A-Za-z]+)(?: \{|\(|,)", source, re.MULTILINE)
    known = {re.sub(r"(?<!^)(?=[A-Z])", "-", variant).lower() for variant in variants}
    for document in DOCUMENTS:
        named = set(re.findall(r"cargo xtask ([a-z][a-z-]+)", document.read_text(encoding="utf-8")))
        assert named <= known, document.name


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda document: document.name)
def test_paths_exist(document: Path):
    """Paths from the root of the repository, in code. A brace or a star stands for several files."""
    text = re.sub(r"^```.*?^```", "", document.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    folders = "bench|bootloader|crates|docs|eds|emulator|firmware|host-tests|tools|xtask"
    named = re.findall(rf"`((?:{folders})/[\w./-]+)`", text)
    assert not [path for path in named if not (ROOT / path).exists() and not EXAMPLE.search(path)]


def test_named_tests_exist():
    """A name of four words or more in code is that of a function or of another item; `...` stands for a part of it."""
    folders = ["bench", "bootloader", "crates", "emulator", "firmware", "host-tests", "tools", "xtask"]
    found = [file for folder in folders for file in (ROOT / folder).rglob("*.[rp][sy]")]
    files = [file for file in found if "target" not in file.parts]
    names = set(re.findall(r"\w+", "\n".join(file.read_text(encoding="utf-8", errors="replace") for file in files)))
    missing = []
    for document in DOCUMENTS:
        text = re.sub(r"^```.*?^```", "", document.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        for code in re.findall(r"`([^`\n]+)`", text):
            for name in re.findall(r"(?:^|::| )((?:\.\.\.)?[a-z]+(?:_[a-z0-9]+){3,}(?:_?\.\.\.)?)(?= |$)", code):
                part = name.strip("._")
                exists = part in names or (part != name and any(part in known for known in names))
                missing += [] if exists else [(document.name, code)]
    assert not missing


def anchors(text: str) -> set[str]:
    """The anchors of the headings, as GitHub makes them."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    plain = [re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading) for heading in headings]
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in plain}


def links(document: Path) -> list[str]:
    text = re.sub(r"^```.*?^```", "", document.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"`[^`\n]*`", "", text)
    pictures = re.findall(r"\b(?:src|srcset)=\"([^\"]*)\"", text)
    return pictures + re.findall(r"\]\(([^)#\s]*(?:#[^)\s]*)?)\)", text)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda document: document.name)
def test_links_lead_to_files_and_headings(document: Path):
    broken = []
    for link in links(document):
        if re.match(r"https?:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (document.parent / path).resolve() if path else document
        if not target.exists() or (anchor and anchor not in anchors(target.read_text(encoding="utf-8"))):
            broken.append(link)
    assert not broken


def test_the_site_has_every_document():
    """`cargo xtask docs` makes pages of the documents in SUMMARY.md, once each, and of those that they link to."""
    summary = ROOT / "docs" / "SUMMARY.md"
    listed = [(summary.parent / link).resolve() for link in links(summary)]
    assert len(listed) == len(set(listed))
    assert set(DOCUMENTS) <= {*listed, summary}
    linked = {(document.parent / link.partition("#")[0]).resolve() for document in listed for link in links(document)}
    assert {file for file in linked if file.suffix == ".md"} <= {*listed, summary}


def test_drawings_are_shown_and_described():
    shown = {(document.parent / link).resolve() for document in DOCUMENTS for link in links(document)}
    for drawing in sorted((ROOT / "docs" / "drawings").glob("*.svg")):
        root = ElementTree.parse(drawing).getroot()
        described = {element.tag.rpartition("}")[2] for element in root if element.text}
        assert {"title", "desc", "style"} <= described, drawing.name
        assert "prefers-color-scheme: dark" in drawing.read_text(encoding="utf-8"), drawing.name
        assert drawing in shown, drawing.name


def test_pictures_are_younger_than_what_they_show():
    assert picture_sources.stated() == picture_sources.hashes(), "cargo xtask pictures takes them again"


def test_the_drawing_of_the_architecture_has_the_tasks_and_the_sectors():
    drawing = ElementTree.parse(ROOT / "docs" / "architecture.svg").getroot()
    texts = ["".join(element.itertext()) for element in drawing.iter() if element.tag.endswith("}text")]
    drawn = {(name, priority) for name, priority in zip(texts, texts[1:]) if priority.startswith("priority ")}
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d) \| (\w+) \|", page.split("## Tasks")[1].split("\n## ")[0], re.MULTILINE)
    assert drawn == {(name, f"priority {priority}") for priority, name in rows if name != "idle"}
    update = (ROOT / "docs" / "update.md").read_text(encoding="utf-8").split("## Flash")[1].split("\n## ")[0]
    assert set(re.findall(r"\bS\d", " ".join(texts))) == set(re.findall(r"\bS\d", update))


def test_the_error_budget_is_that_of_its_circuits():
    text = (ROOT / "docs" / "wiring.md").read_text(encoding="utf-8")
    stated = text.split("<!-- begin error budget -->\n")[1].split("\n<!-- end error budget -->")[0]
    assert stated == error_budget.table()


def test_every_emergency_code_is_explained():
    """docs/troubleshooting.md has a row for each code and each detail that the firmware sends, and for no other."""
    rows = [line.split(",") for line in (ROOT / "host-tests/tables/emcy.csv").read_text().splitlines()[1:]]
    sent = {row[0][2:] + "h" for row in rows if row[5] or row[0] == "0x0000"}
    text = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
    section = text.split("## EMCY codes")[1].split("\n## ")[0]
    explained = set(re.findall(r"^\| ([0-9A-F]{4}h)", section, re.MULTILINE))
    assert explained == sent


def test_every_abort_code_is_explained():
    source = (ROOT / "crates/canopen/src/sdo/abort.rs").read_text(encoding="utf-8")
    digits = re.findall(r"=> 0x([0-9A-F])([0-9A-F])([0-9A-F]{2}),", source)
    known = {f"0{kind}0{group} 00{code}h" for kind, group, code in digits}
    text = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
    section = text.split("## SDO abort codes")[1].split("\n## ")[0]
    assert set(re.findall(r"^\| ([0-9A-F]{4} [0-9A-F]{4}h)", section, re.MULTILINE)) == known


def test_the_figures_of_the_readme_are_those_of_the_benchmark():
    benchmark = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8").split("## As flashed")[1]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([^|]+) \| ([\d,]+) \| ([\d,]+) \|$", readme.split("## Why")[1].split("\n## ")[0], re.MULTILINE)
    assert rows
    for operation, ours, theirs in rows:
        row = re.search(rf"^\| {re.escape(operation)} \| (\d+) \|.*\| (\d+) \|$", benchmark, re.MULTILINE)
        assert row, operation
        assert (ours.replace(",", ""), theirs.replace(",", "")) == row.groups(), operation
