"""Whatever fails while something is installed, the environment is afterwards what it was before, to the last byte."""

import base64
import os
import signal
import subprocess
import time
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest

from tests.plugins.installer import wheels
from tests.plugins.installer.environments import Environment
from tests.plugins.installer.wheels import HOOKS, TASK, Index

pytestmark = [pytest.mark.xdist_group("installing"), pytest.mark.slow]

NAME = "fail-task"
PATIENCE_S = 120.0
PATCHES = f"import json\njson.dumps = lambda *_, **__: ''\n{HOOKS}"
METHOD = f"import pathlib\npathlib.Path.exists = lambda self: True\n{HOOKS}"
FAILING: dict[str, tuple[str, str | None, str]] = {
    "2.0": (f"import no_such_module\n{HOOKS}", None, "ModuleNotFoundError: No module named 'no_such_module'"),
    "2.1": (HOOKS, TASK.format(name="fail_task").replace("actions", "actoins"), "Did you mean 'actions'?"),
    "2.2": (HOOKS, TASK.format(name="sample:passive"), "Two tasks are called 'sample:passive'"),
    "2.3": (f"print('hello')\n{HOOKS}", None, "It prints at import: 'hello'"),
    "2.4": (PATCHES, None, "It changes the code of others: json.dumps"),
    "2.5": (METHOD, None, "It changes the code of others: pathlib.Path.exists"),
    "2.6": (f"import os\nos._exit(0)\n{HOOKS}", None, "ended with exit status 0"),
}
"""Versions that install well and then do not work: the code, the task, and what is said of them."""


@pytest.fixture(scope="module")
def offered(index: Index, tmp_path_factory: pytest.TempPathFactory) -> Index:
    """Version 1.0 is sound, the others are not."""
    folder = tmp_path_factory.mktemp("wheels")
    index.publish(wheels.make(folder, NAME))
    for version, (code, task, _) in FAILING.items():
        files = None if task is None else {"fail_task/tasks/fail_task.yaml": task}
        index.publish(wheels.make(folder, NAME, version, code=code, files=files))
    index.publish(wheels.make(folder, NAME, "3.0", requires=["no-such-thing-at-all"]))
    index.publish(wheels.make(folder, NAME, "3.1", requires=["benchbot>=1000"]))
    index.publish(wheels.make(folder, NAME, "4.0"), digest="0" * 64)
    cut_off = wheels.make(folder, NAME, "5.0")
    rest = cut_off.read_bytes()[:300]
    index.publish(cut_off, content=rest, digest=sha256(rest).hexdigest())
    index.publish(wheels.make(folder, NAME, "5.1", unlisted={"fail_task/hidden.py": "raise SystemExit"}))
    index.publish(wheels.make(folder, NAME, "6.0", files={"numpy/ours.yaml": "a: 1", "benchbot/cli/app.py": ""}))
    return index


@pytest.fixture
def installed(offered: Index, shared: Environment) -> Environment:
    """Version 1.0, which every failure must leave in place."""
    if not list(shared.site.glob("fail_task-1.0.dist-info")):
        done = shared.run("install", f"{NAME}==1.0", "--index-url", offered.url)
        assert done.returncode == 0, done.stderr
    return shared


@pytest.mark.parametrize(("version", "said"), [(version, said) for version, (_, _, said) in FAILING.items()])
def test_what_does_not_work_is_undone(version: str, said: str, installed: Environment, offered: Index) -> None:
    before = installed.listing()

    done = installed.run("install", f"{NAME}=={version}", "--index-url", offered.url, "--trust")

    assert (done.returncode, done.stdout) == (2, "")
    assert f"{NAME} cannot be used, so everything was put back to what it was." in done.stderr
    assert said in done.stderr
    assert installed.listing() == before


@pytest.mark.parametrize("installer", ["uv", "pip"])
@pytest.mark.parametrize(
    ("version", "title"),
    [
        ("3.0", "There is n"),  # uv finds no such distribution, pip no set of versions
        ("3.1", "There is no set of versions that fits together."),
        ("4.0", "its hash is wrong"),
        ("5.0", "A wheel is damaged."),
        ("9.9", "There is no set of versions that fits together."),
    ],
)
def test_what_cannot_be_installed_changes_nothing(
    installer: str, version: str, title: str, installed: Environment, offered: Index
) -> None:
    before = installed.listing()

    done = installed.run(
        "install", f"{NAME}=={version}", "--index-url", offered.url, "--trust", "--installer", installer
    )

    assert (done.returncode, done.stdout) == (2, "")
    assert title in done.stderr
    assert f"{installer} says:" in done.stderr
    assert "Traceback" not in done.stderr
    assert installed.listing() == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((f"{NAME}==5.1",), "code: fail_task/hidden.py"),
        ((f"{NAME}==6.0", "--trust"), "fail-task would overwrite a file of benchbot."),
        ((f"{NAME}==2.0",), "Nothing was installed: you have not allowed the code that would come."),
        ((f"{NAME}==2.0", "--require-hashes"), "A hash is missing."),
        (("no-such-thing-at-all",), "There is no such distribution."),
        (("./nowhere",), "'./nowhere' is nothing that can be installed."),
    ],
)
def test_what_is_refused_changes_nothing(
    words: tuple[str, ...], said: str, installed: Environment, offered: Index
) -> None:
    before = installed.listing()
    state = {"BENCHBOT_STATE_DIR": str(installed.home / "else")}
    done = installed.run("install", *words, "--index-url", offered.url, changes=state)
    assert (done.returncode, said in done.stderr) == (2, True), done.stderr
    assert installed.listing() == before


@pytest.mark.parametrize(("installer", "variable"), [("uv", None), ("pip", None), ("uv", "PIP_INDEX_URL")])
def test_without_network_and_secrets_kept(installer: str, variable: str | None, installed: Environment) -> None:
    before = installed.listing()
    url = "http://me:secret@127.0.0.1:9/simple"
    words = ["--index-url", url] if variable is None else []
    changes = {} if variable is None else {variable: url}
    done = installed.run("install", "anything", *words, "--installer", installer, changes=changes)
    assert (done.returncode, "The package index cannot be reached." in done.stderr) == (2, True), done.stderr
    assert "secret" not in done.stderr
    assert installed.listing() == before


ISOLATED = ("unshare", "--mount", "sh", "-ec")


def isolated(script: str, environment: Environment, *words: str) -> "subprocess.CompletedProcess[str]":
    """Run a command where the disks are mounted as the script says."""
    command = [*ISOLATED, f'{script}\nexec "$@"', "sh", *environment.words(*words)]
    return subprocess.run(
        command, cwd=environment.home, env=environment.environ(), capture_output=True, text=True, check=False
    )


def test_without_permission_to_write(installed: Environment, offered: Index) -> None:
    before = installed.listing()
    read_only = f"mount --bind {installed.prefix} {installed.prefix}; mount -o remount,ro,bind {installed.prefix}"
    done = isolated(read_only, installed, "install", f"{NAME}==1.0", "--index-url", offered.url)
    assert (done.returncode, "no permission to write" in done.stderr) == (2, True), done.stderr
    assert installed.listing() == before


def test_a_full_disk(installed: Environment, offered: Index, tmp_path: Path) -> None:
    """The environment's disk has room for a part of the distribution only."""
    big = {f"fail_task/part_{number}.yaml": base64.b64encode(os.urandom(300_000)).decode() for number in range(12)}
    wheel = wheels.make(tmp_path, NAME, "7.0", files=big)
    before = installed.listing()
    site = installed.site
    upper = tmp_path / "upper"
    small = (
        f"mkdir {upper}; mount -t tmpfs -o size=2m none {upper}; mkdir {upper}/u {upper}/w; "
        f"mount -t overlay overlay -o lowerdir={site},upperdir={upper}/u,workdir={upper}/w {site}"
    )
    listed = f"cd {site}; trap 'find . -type f ! -path \"*/__pycache__/*\" | sort > {tmp_path}/after' EXIT"
    find = f"cd {site}; find . -type f ! -path '*/__pycache__/*' | sort"
    names = subprocess.run(["sh", "-c", find], capture_output=True, text=True, check=True).stdout
    command = [*ISOLATED, f'{small}\n{listed}\n"$@"', "sh", *installed.words("install", str(wheel), "--trust")]
    done = subprocess.run(command, env=installed.environ(), capture_output=True, text=True, check=False)
    assert (done.returncode, "The disk is full." in done.stderr) == (2, True), done.stderr
    assert (tmp_path / "after").read_text() == names
    assert installed.listing() == before


def eventually(holds: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < deadline_s
        time.sleep(0.05)


@pytest.fixture
def stopping(installed: Environment, tmp_path: Path) -> Environment:
    """uv installs and then does not end, as if the power were about to fail; `reached` is there when it does so."""
    real = (installed.home / "bin" / "uv").readlink()
    slow = tmp_path / "uv"
    slow.write_text(
        f'#!/bin/sh\ncase "$*" in\n*--reinstall*) {real} "$@"; echo $$ > {tmp_path}/reached.new;'
        f' mv {tmp_path}/reached.new {tmp_path}/reached; exec sleep 600;;\n*) exec {real} "$@";;\nesac\n'
    )
    slow.chmod(0o755)
    return installed


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_in_the_middle(
    number: signal.Signals, stopping: Environment, offered: Index, tmp_path: Path
) -> None:
    before = stopping.listing()
    words = ("install", f"{NAME}==2.4", "--index-url", offered.url, "--trust")
    process = stopping.start(*words, changes={"PATH": f"{tmp_path}:{stopping.environ()['PATH']}"})
    eventually((tmp_path / "reached").exists)
    assert list(stopping.site.glob("fail_task-2.4.dist-info"))

    process.send_signal(number)
    out, err = process.communicate(timeout=PATIENCE_S)

    assert (process.returncode, out) == (130, "")
    assert "Putting everything back" in err
    assert stopping.listing() == before


def test_killed_in_the_middle(stopping: Environment, offered: Index, tmp_path: Path) -> None:
    """Nothing can be done at once; whoever comes next waits for what is still at work, and puts everything back."""
    before = stopping.listing()
    words = ("install", f"{NAME}==2.4", "--index-url", offered.url, "--trust")
    process = stopping.start(*words, changes={"PATH": f"{tmp_path}:{stopping.environ()['PATH']}"})
    eventually((tmp_path / "reached").exists)
    process.kill()
    process.communicate(timeout=PATIENCE_S)
    assert list(stopping.site.glob("fail_task-2.4.dist-info"))

    following = stopping.start("uninstall", NAME, "--dry-run")
    assert following.stderr is not None
    waiting = following.stderr.readline()
    assert f"benchbot install {NAME}==2.4 --index" not in waiting
    assert f"Waiting for another change of this environment to end: benchbot install {NAME}==2.4 (process " in waiting
    os.kill(int((tmp_path / "reached").read_text()), signal.SIGKILL)

    out, err = following.communicate(timeout=PATIENCE_S)
    assert (following.returncode, out) == (0, f"- {NAME} 1.0  (plug-in)\n")
    assert f"'benchbot install {NAME}==2.4' was broken off" in err
    assert stopping.listing() == before
