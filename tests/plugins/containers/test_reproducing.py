"""A bundle of results that were made in a container: its Dockerfile goes in, and is built again elsewhere."""

import json
from pathlib import Path

import pytest

from tests.cli.solutions import PASSIVE
from tests.cli.submitted import SELECTION
from tests.command_line import CommandLine
from tests.plugins.containers import solutions

pytestmark = pytest.mark.xdist_group("containers")


def test_the_same_comes_of_it_in_a_container_built_anew(
    cli: CommandLine,
    podman: dict[str, str],
    tmp_path: Path,
) -> None:
    solutions.write(cli.folder / "solution", PASSIVE)
    weak = ["--weak-limits"]

    ran = cli("submit", "--containerised", "solution", *weak, *SELECTION, "-r", "result.json", **podman)
    assert ran.returncode == 0, ran.stderr
    assert json.loads((cli.folder / "result.json").read_text())["provenance"]["solution"]["mode"] == "container"
    made = cli("bundle", "result.json", "--solution", "solution")
    assert made.returncode == 0, made.stderr
    native = cli("reproduce", "bundle.zip", "--native", "--trust", **podman)
    done = cli("reproduce", "bundle.zip", *weak, **podman)

    assert (done.returncode, done.stdout) == (0, "identical  arena:1, seed 0\n"), done.stderr
    assert native.returncode == 2
    assert "It runs in a container, and --native was given." in native.stderr
