"""Files are there as they were or as they become, whatever happens in between."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from benchbot.core import atomic
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass

LIMIT_BYTES = 4096
WRITES_TOO_MUCH = """\
import resource, signal, sys
from pathlib import Path
from benchbot.core import atomic
from benchbot.core.errors import BenchbotError

unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), unlimited[1]))
try:
    atomic.write_text(Path(sys.argv[1]), "x" * (int(sys.argv[2]) + 1))
except BenchbotError as error:
    resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
    sys.exit(f"{error.title} {error.why}")
"""


def test_a_text_that_does_not_fit_leaves_the_file_as_it_was_and_nothing_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    atomic.write_text(path, "before")

    done = subprocess.run(
        [sys.executable, "-c", WRITES_TOO_MUCH, path, str(LIMIT_BYTES)], capture_output=True, text=True, check=False
    )

    assert done.stderr == f"Cannot write {path}. File too large\n"
    assert path.read_text() == "before"
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]


def test_a_text_is_written_into_a_folder_that_is_made_and_is_as_readable_as_any(tmp_path: Path) -> None:
    path = tmp_path / "results" / "tische.csv"
    mask = os.umask(0o027)
    try:
        atomic.write_text(path, "Stühle")
    finally:
        os.umask(mask)

    assert path.read_text("utf-8") == "Stühle"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_a_place_where_no_file_can_be_is_an_error_with_a_fix(tmp_path: Path) -> None:
    (tmp_path / "file").touch()

    with pytest.raises(BenchbotError, match="Cannot write") as caught:
        atomic.write_text(tmp_path / "file" / "table.csv", "after")

    assert (caught.value.failure, caught.value.exit_code) == (FailureClass.INFRASTRUCTURE, ExitCode.INTERNAL)
    assert "a folder that you may write to" in caught.value.fix
