"""A batch whose solution runs in containers."""

import json
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import docker
import pytest

from tests.plugins.containers import solutions
from tests.plugins.containers.test_container import PASSIVE

pytestmark = pytest.mark.xdist_group("containers")


def test_a_batch_builds_one_image_and_runs_each_episode_in_a_container_of_it(
    engine_variables: dict[str, str], tmp_path: Path
) -> None:
    folder = solutions.write(tmp_path / "solution", PASSIVE)
    words = [sys.executable, "-m", "benchbot", "batch", "--task", "sample:passive", "--robots", "sample_robot"]
    words += ["--envs", "arena:1", "--seeds", "0..1", "--containerised", str(folder), "--jobs", "1", "-o", "batch"]

    def batch() -> str:
        done = subprocess.run(words, check=False, capture_output=True, text=True, cwd=tmp_path, timeout=600)
        return f"{done.returncode}: {done.stderr}"

    said = batch()
    assert said.startswith("0: "), said
    found = [
        json.loads(path.read_bytes())["provenance"] for path in (tmp_path / "batch/episodes").glob("*/result.json")
    ]
    assert [(each["solution"]["mode"], each["failure"]) for each in found] == [("container", None)] * 2
    (snapshot,) = (tmp_path / "batch" / "solutions").iterdir()
    assert {each["solution"]["snapshot"] for each in found} == {snapshot.name}
    assert (snapshot / "files" / "Dockerfile").read_bytes() == (folder / "Dockerfile").read_bytes()
    with closing(docker.APIClient(base_url=engine_variables["DOCKER_HOST"])) as client:
        assert client.containers(all=True) == []
    (folder / "solution.py").write_text("raise SystemExit(1)\n")
    assert "Changed: the file solution.py of the solution." in batch()
