import subprocess
import tarfile
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.bundles import sources, tarball


def test_it_is_what_tar_made_of_the_folder_in_v2(tmp_path: Path, solution: Path) -> None:
    (solution / "Dockerfile").write_text("FROM scratch\n")
    script = solution / "bin" / "run.sh"
    script.parent.mkdir()
    script.write_text("#!/bin/sh\n")
    script.chmod(0o755)
    target = tmp_path / "submission.tgz"

    tarball.write(sources.collect(solution), target)

    with tarfile.open(target) as tar:
        assert tar.getnames() == ["./Dockerfile", "./bin/run.sh", "./solution.py"]
    unpacked = tmp_path / "unpacked"
    unpacked.mkdir()
    subprocess.run(["tar", "-xzf", target, "-C", unpacked], check=True)
    assert (unpacked / "bin" / "run.sh").stat().st_mode & 0o111
    assert (unpacked / "Dockerfile").read_text() == "FROM scratch\n"
    before = target.read_bytes()
    tarball.write(sources.collect(solution), target)
    assert target.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["solution", "submission.tgz", "unpacked"]


def test_where_nothing_can_be_written_is_said(solution: Path) -> None:
    with pytest.raises(BenchbotError, match="Cannot write"):
        tarball.write(sources.collect(solution), Path("/dev/null/submission.tgz"))
