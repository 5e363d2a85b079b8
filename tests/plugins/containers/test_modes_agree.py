"""The same example natively, in a sandbox and in a container: what comes of it is the same."""

import json
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

import benchbot.plugins
from benchbot.plugins.containers import context
from benchbot.plugins.containers import mode as containers
from benchbot.plugins.sandbox.mode import Sandbox
from benchbot.submission.modes import NATIVE, SolutionSpec
from tests.plugins.containers import base_image
from tests.submission.submitting import back_end, submit

pytestmark = pytest.mark.xdist_group("containers")

EXAMPLE = Path(benchbot.plugins.__file__).parent / "examples" / "hello_passive.py"
DOCKERFILE = f"""\
FROM {base_image.NAME}
COPY hello_passive.py /solution/
CMD ["python", "/solution/hello_passive.py"]
"""


def test_the_same_example_comes_to_the_same_result_in_every_mode(
    engine_variables: dict[str, str], tmp_path: Path
) -> None:
    folder = tmp_path / "example"
    folder.mkdir()
    shutil.copy(EXAMPLE, folder)
    (folder / "Dockerfile").write_text(DOCKERFILE)
    native = [sys.executable, "hello_passive.py"]
    with containers.container_mode(context.find(folder), print) as container:
        found = [
            result_of(SolutionSpec(native, folder)),
            result_of(SolutionSpec(native, folder, mode=Sandbox())),
            result_of(SolutionSpec([container.image], folder, mode=container)),
        ]
    modes = [result["provenance"].pop("solution").get("mode", NATIVE.name) for result in found]
    assert modes == ["native", "sandbox", "container"]
    native_bytes, *others = (json.dumps(result).encode() for result in found)
    assert others == [native_bytes, native_bytes]


def result_of(spec: SolutionSpec) -> dict[str, Any]:
    """Return the result of a solution that has a back end for itself."""
    with back_end() as backend:
        ended, spectator = submit(spec, backend)
    assert ended.problem is None, spectator.text
    assert ended.document["provenance"]["steps"] > 0
    return ended.document
