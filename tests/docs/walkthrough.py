"""A page of the documentation, walked through as its reader would: files are written, commands typed, in order."""

import os
import re
import shlex
import subprocess
import sys
import sysconfig
import venv
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.docs.blocks import Block, blocks

_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")
_TITLE = re.compile(r'title="([^"]+)"')


@dataclass(frozen=True)
class Reader:
    """Somebody with BenchBot installed, an empty folder and a shell."""

    folder: Path
    variables: dict[str, str]

    def walk(self, page: str, runner: str) -> None:
        """Do what a page says: write its files, and run the blocks that are marked as run by `runner`."""
        printed = ""
        for block in blocks(page):
            if title := _TITLE.search(block.info):
                path = self.folder / title[1]
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(block.text, "utf-8")
            elif block.run_by == runner:
                printed = self.type(block)
            elif block.mark == "printed":
                assert_printed(block.text, printed)

    def type(self, block: Block) -> str:
        """Run the commands of a block, which must succeed; return what they printed."""
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", block.text],
            cwd=self.folder,
            env=self.variables,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{block.text}\n{done.stdout}\n{done.stderr}"
        return done.stdout + done.stderr


def assert_printed(wanted: str, printed: str) -> None:
    """Check that each line was printed; numbers may differ in their second digit, as between processors."""
    for line in wanted.splitlines():
        words, numbers = _NUMBER.sub("#", line.strip()), [float(number) for number in _NUMBER.findall(line)]
        alike = [other for other in printed.splitlines() if _NUMBER.sub("#", other.strip()) == words]
        found = [[float(number) for number in _NUMBER.findall(other)] for other in alike]
        assert any(given == pytest.approx(numbers, abs=0.02, rel=0.02) for given in found), f"{line}\n{printed}"


def reader(folder: Path, cache: Path) -> Reader:
    """Return a reader with an environment of their own, to install into, that has all that this one has.

    What BenchBot keeps in its cache is in `cache`.
    """
    installed = folder / "venv"
    venv.create(installed, with_pip=False)
    ours = sysconfig.get_path("purelib")
    site = Path(sysconfig.get_path("purelib", vars={"base": str(installed), "platbase": str(installed)}))
    # As a site folder, not as a mere path: what is installed here in editable mode is found by its .pth files.
    (site / "ours.pth").write_text(f"import site; site.addsitedir({ours!r})\n", "utf-8")
    python = shlex.quote(str(installed / "bin" / "python"))
    for name, module in (("benchbot", "benchbot"), ("pip", "pip")):
        program = installed / "bin" / name
        program.write_text(f'#!/bin/sh\nexec {python} -m {module} "$@"\n', "utf-8")
        program.chmod(0o755)
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("BENCHBOT_", "PIP_", "PYTEST_", "PYTHON"))
    }
    home = folder / "folder"
    home.mkdir()
    variables = {
        "PATH": os.pathsep.join([str(installed / "bin"), str(Path(sys.executable).parent), os.environ["PATH"]]),
        "BENCHBOT_STATE_DIR": str(folder / "state"),
        "BENCHBOT_CACHE_DIR": str(cache),
        # What is installed comes from the page's own folders, and needs nothing that is not here.
        "PIP_NO_BUILD_ISOLATION": "0",
        "PIP_NO_DEPS": "1",
        "PIP_NO_INDEX": "1",
        "PIP_NO_CACHE_DIR": "1",
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
        "PIP_CONFIG_FILE": os.devnull,
        "PYTEST_ADDOPTS": "-p no:randomly -p no:cacheprovider -n 0",
    }
    return Reader(home, {**kept, **variables})
