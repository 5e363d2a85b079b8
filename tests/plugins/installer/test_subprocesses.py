import sys

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.installer_errors import installer_error
from benchbot.plugins.installer.subprocesses import ProcessResult, Runner


def test_secrets_are_left_out_of_what_a_program_says() -> None:
    said = Runner().run([sys.executable, "-c", "print('https://me:secret@example.org/')"])
    assert said == ProcessResult(0, "https://example.org/\n", "")


def test_a_program_that_takes_too_long_is_ended_with_what_it_started() -> None:
    code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'import time; time.sleep(600)'])"
    assert Runner().run([sys.executable, "-c", code], timeout_s=0.5) == ProcessResult(None, "", "")
    with pytest.raises(BenchbotError, match="no-such-program cannot be started"):
        Runner().run(["no-such-program"])


def test_what_an_installer_says_is_quoted_and_what_is_not_known_is_told_as_it_is() -> None:
    error = installer_error("uv", ProcessResult(2, "", "Using Python\nerror: No space left on device (os error 28)\n"))
    assert (error.title, error.why) == ("The disk is full.", "uv says:\nNo space left on device (os error 28)")
    error = installer_error("pip", ProcessResult(-9, "", ""))
    assert error.title == "pip failed."
    assert error.why == "pip ended with exit status -9. pip gave no reason."


def test_what_pip_says_a_conflict_is_caused_by_is_kept_before_its_advice() -> None:
    said = """\
ERROR: Cannot install acme-task and numpy==1.0 because these package versions have conflicting dependencies.

The conflict is caused by:
    The user requested numpy==1.0
    acme-task 1.0 depends on numpy>=2

To fix this you could try to:
1. loosen the range of package versions you've specified
2. remove package versions to allow pip to attempt to solve the dependency conflict

Additional packages available: see
https://pip.pypa.io/en/latest/topics/dependency-resolution/#dealing-with-dependency-conflicts
ERROR: ResolutionImpossible: for help visit the page above
"""
    error = installer_error("pip", ProcessResult(1, "", said))
    assert error.title == "There is no set of versions that fits together."
    assert "The conflict is caused by:\nThe user requested numpy==1.0\nacme-task 1.0 depends on numpy>=2" in error.why
