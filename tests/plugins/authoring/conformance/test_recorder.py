"""The recorder in the box conforms; each small recorder that breaks one promise is found out."""

import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.light_records import Recorder
from benchbot.core.progress import Progress, Step
from benchbot.testing import check_recorder
from tests.plugins.authoring.conformance.reading import all_is_well, broken


@pytest.mark.parametrize("name", ["frames", "steps", "trajectory"])
def test_the_recorders_in_the_box_conform(name: str) -> None:
    assert all_is_well(check_recorder(name))


class Lines:
    """A line per step; as it should be, but for what its variants do."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "steps.jsonl"
        self.write("")

    def write(self, text: str) -> None:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self.path.write_text(text)
        except OSError as error:
            raise BenchbotError("Cannot write.", str(error), "Make room.") from error

    def reset(self) -> None:
        self.write("")

    def step(self, action: str | None, arguments: Mapping[str, Any], step: Step, progress: Progress) -> None:
        line = json.dumps({"action": action, "steps": progress.steps, "seen": [*step.observations], "pad": 300 * "."})
        self.write(self.path.read_text() + line + "\n")

    def close(self) -> None:
        pass


def test_a_sound_recorder_conforms() -> None:
    assert all_is_well(check_recorder(Recorder("lines", Lines)))


class WritesNothing(Lines):
    def write(self, text: str) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.path.write_text("")


class WritesElsewhere(Lines):
    def close(self) -> None:
        (self.path.parent.parent / "index.json").write_text("{}")


class Paints(Lines):
    def step(self, action: str | None, arguments: Mapping[str, Any], step: Step, progress: Progress) -> None:
        if "image_rgb" in step.observations:
            step.observations["image_rgb"][0] = 255
        super().step(action, arguments, step, progress)


class NeedsALaser(Lines):
    def step(self, action: str | None, arguments: Mapping[str, Any], step: Step, progress: Progress) -> None:
        len(step.observations["laser"]["scans"])
        super().step(action, arguments, step, progress)


class NeverForgets(Lines):
    def reset(self) -> None:
        pass


class NeedsTheStart(Lines):
    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.last = 0

    def step(self, action: str | None, arguments: Mapping[str, Any], step: Step, progress: Progress) -> None:
        if progress.frames != self.last + 1:
            raise RuntimeError("a step is missing")
        self.last = progress.frames
        super().step(action, arguments, step, progress)

    def reset(self) -> None:
        super().reset()
        self.last = 0


class ClosesOnce(Lines):
    def close(self) -> None:
        self.path.rename(self.path.with_suffix(".done"))


class GrowsAJsonFile(Lines):
    def step(self, action: str | None, arguments: Mapping[str, Any], step: Step, progress: Progress) -> None:
        (self.path.parent / "poses.json").write_text("[0, ")
        super().step(action, arguments, step, progress)

    def close(self) -> None:
        (self.path.parent / "poses.json").write_text("[0]")


class LooksLikeAResult(Lines):
    def close(self) -> None:
        (self.path.parent / "copy.json").write_text('{"results": 1, "environment_details": 2}')


class KeepsItOpen(Lines):
    kept: list[Any] = []  # noqa: RUF012

    def close(self) -> None:
        self.kept.append(self.path.open())


class SaysNothing(Lines):
    def write(self, text: str) -> None:
        with suppress(BenchbotError):
            super().write(text)

    def step(self, action: str | None, arguments: Mapping[str, Any], step: Step, progress: Progress) -> None:
        if self.path.exists():
            super().step(action, arguments, step, progress)


class SaysItRaw(Lines):
    def write(self, text: str) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.path.write_text(text)


@pytest.mark.parametrize(
    ("recorder", "subject", "words"),
    [
        (WritesNothing, "a session", "Nothing was written"),
        (WritesElsewhere, "a session", "index.json"),
        (Paints, "observations", "altered the observations"),
        (NeedsALaser, "channels that a task lacks", "KeyError: 'laser'"),
        (NeverForgets, "reset", "Drop in reset()"),
        (NeedsTheStart, "a run under way", "a step is missing"),
        (ClosesOnce, "close", "FileNotFoundError"),
        (GrowsAJsonFile, "results beside it", "would count poses.json as a result"),
        (LooksLikeAResult, "results beside it", "would count copy.json as a result"),
        (KeepsItOpen, "nothing left", "files open"),
        (SaysNothing, "full disk", "Nothing was told"),
        (SaysItRaw, "full disk", "It raised OSError"),
        (SaysNothing, "a folder that cannot be", "Nothing was told"),
        (SaysItRaw, "a folder that cannot be", "It raised NotADirectoryError"),
    ],
)
def test_a_broken_promise_is_found_out(recorder: type[Lines], subject: str, words: str) -> None:
    assert words in broken(check_recorder(Recorder("lines", recorder)))[subject]
