"""Images that are built: from the folder of the Dockerfile, once, with the failing step told, and nothing half done."""

import os
import signal
import subprocess
import threading
from contextlib import closing, suppress
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.plugins.containers import context, engine, mode
from tests.plugins.containers import base_image, solutions
from tests.supervisor.harness import eventually

pytestmark = pytest.mark.xdist_group("containers")

SLEEPS = f"""\
FROM {base_image.NAME}
RUN ["python", "-c", "import time; time.sleep(1000.125)"]
"""


def left(variables: dict[str, str]) -> list[str]:
    """Return the containers that podman has, those too that it builds in; and processes of a step that sleeps."""
    command = ["podman", "ps", "--all", "--external", "--quiet"]
    environment = {**os.environ, **variables}
    listed = subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout.split()
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            if b"sleep(1000.125)" in path.read_bytes():
                listed.append(str(path))
    return listed


def test_the_same_context_is_built_once_and_another_one_anew(engine_variables: dict[str, str], tmp_path: Path) -> None:
    folder = solutions.write(tmp_path / "solution")
    (folder / ".dockerignore").write_text("notes\n")
    with engine.reached() as reached, closing(reached.connect()) as client:
        images = []
        for change in (lambda: None, lambda: (folder / "notes").write_text("x"), (folder / "more").mkdir):
            change()
            told: list[str] = []
            with mode.container_mode(context.find(folder), told.append) as prepared:
                images.append(prepared.image)
            assert ("there already" in told[0]) == (len(images) == 2), told
        assert images[0] == images[1] != images[2]
        assert [line.split(":")[0] for line in told if line.startswith("STEP")][1] == "STEP 2/4"
        labels = client.inspect_image(images[0])["Config"]["Labels"]  # type: ignore[no-untyped-call]
        assert labels["benchbot.submission"] == "1"


@pytest.mark.parametrize(
    ("dockerfile", "step", "why"),
    [
        (f"FROM {base_image.NAME}\nCOPY map.png /\n", "STEP 2/3: COPY map.png /", "map.png"),
        (f'FROM {base_image.NAME}\nRUN ["python", "-c", "raise SystemExit(\'no wheel\')"]\n', "STEP 2/3", "no wheel"),
        (f"FROM {base_image.NAME}\nRUNN true\n", "", "RUNN"),
        ("FROM localhost/no/such/image\n", "STEP 1/2: FROM localhost/no/such/image", "no/such/image"),
    ],
)
def test_a_build_that_fails_says_at_which_step(
    engine_variables: dict[str, str], tmp_path: Path, dockerfile: str, step: str, why: str
) -> None:
    folder = solutions.write(tmp_path / "broken", dockerfile=dockerfile)
    with (
        pytest.raises(BenchbotError, match="cannot be built") as raised,
        mode.container_mode(context.find(folder), print),
    ):
        pass
    assert step in raised.value.why
    assert why in raised.value.why
    assert str(folder / "Dockerfile") in raised.value.fix
    assert raised.value.exit_code == ExitCode.SUBMISSION_FAILED
    assert left(engine_variables) == []


def test_an_interrupted_build_leaves_no_container_and_no_process(
    engine_variables: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # No engine is named and none listens: BenchBot starts one of its own, and ends it.
    monkeypatch.delenv("DOCKER_HOST")
    monkeypatch.setattr(engine, "usual_sockets", list)
    folder = solutions.write(tmp_path / "slow", dockerfile=SLEEPS)
    begun, runs, over = threading.Event(), threading.Event(), threading.Event()

    def interrupt() -> None:
        begun.wait(120)
        if eventually(lambda: any(entry.startswith("/proc") for entry in left(engine_variables)), 120):
            runs.set()
        if not over.is_set():  # another test may have begun
            os.kill(os.getpid(), signal.SIGINT)

    def tell(line: str) -> None:
        if line.startswith("STEP 2"):
            begun.set()

    interrupting = threading.Thread(target=interrupt)
    interrupting.start()
    try:
        with pytest.raises(KeyboardInterrupt), mode.container_mode(context.find(folder), tell):
            pass
    finally:
        over.set()
    interrupting.join()
    assert runs.is_set()
    assert eventually(lambda: left(engine_variables) == [])


def test_the_context_is_the_folder_of_the_dockerfile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = solutions.write(tmp_path / "solution")
    (folder / "Dockerfile.gpu").write_text("FROM scratch\n")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "Containerfile").touch()
    monkeypatch.chdir(tmp_path)
    for named, expected in (
        ("solution", (folder, "Dockerfile")),
        ("solution/Dockerfile.gpu", (folder, "Dockerfile.gpu")),
        ("other", (tmp_path / "other", "Containerfile")),
    ):
        found = context.find(Path(named))
        assert (found.folder, found.dockerfile) == expected
    for missing, why in (("nothing", "nothing of that name"), (".", "folder without one")):
        with pytest.raises(BenchbotError, match="There is no Dockerfile") as raised:
            context.find(Path(missing))
        assert why in raised.value.why
