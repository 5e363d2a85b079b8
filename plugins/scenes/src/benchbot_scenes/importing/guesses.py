"""Guesses about a file, as a YAML file that a person can correct and hand back."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import yaml

from benchbot.plugin import BenchbotError, check_declaration, declaration_problems, did_you_mean, read_declaration
from benchbot_scenes.importing.guessing import UNITS_M
from benchbot_scenes.importing.model import UpAxis
from benchbot_scenes.importing.vocabulary import CLASSES

_SCHEMAS = Path(__file__).parent
SUFFIX = ".import.yaml"


@dataclass(frozen=True)
class Guesses:
    """Values that the user gives, so that they need no guess; None is guessed. The keys are those of guesses.json."""

    units: str | float | None = None
    up: UpAxis | None = None
    floor_z_m: float | None = None
    start_pose: tuple[float, float, float] | None = None
    hidden: tuple[str, ...] | None = None
    classes: dict[str, str | None] = field(default_factory=dict)
    lighting: dict[str, Any] | None = None
    robot: str | None = None

    @property
    def unit_m(self) -> float | None:
        """Metres in the unit, if it is known."""
        return UNITS_M[self.units] if isinstance(self.units, str) else self.units


def read_guesses(path: Path) -> Guesses:
    """Read a guesses file; raises BenchbotError naming file, line and key when it is none."""
    document = read_declaration(path)
    check_declaration(document, "guesses", path, _SCHEMAS)
    for name, class_name in document.get("classes", {}).items():
        if class_name is not None and class_name not in CLASSES:
            raise BenchbotError(
                f"{path}: '{name}' cannot be of class '{class_name}'.",
                f"There is no such class.{did_you_mean(class_name, list(CLASSES))}",
                f"Choose one of: {', '.join(CLASSES)}; or null.",
            )
    if "lighting" in document:
        _check_lighting(document["lighting"], path)
    start = document.get("start_pose")
    return Guesses(
        units=document.get("units"),
        up=document.get("up"),
        floor_z_m=document.get("floor_z_m"),
        start_pose=None if start is None else cast(tuple[float, float, float], tuple(map(float, start))),
        hidden=tuple(document["hidden"]) if "hidden" in document else None,
        classes=document.get("classes", {}),
        lighting=document.get("lighting"),
        robot=document.get("robot"),
    )


def _check_lighting(lighting: dict[str, Any], path: Path) -> None:
    """Raise BenchbotError unless an environment may have it."""
    environment = {"name": "a", "variant": 1, "type": "sim_taichi", "start_pose": [1, 0, 0, 0, 0, 0, 0]}
    wrong = declaration_problems({**environment, "lighting": lighting}, "environment", path)
    if wrong:
        lines = "\n".join(str(problem) for problem in wrong)
        raise BenchbotError(
            f"{path} has no usable lighting.", lines, "Mend the lines above; docs/lighting.md has all keys."
        )


def beside(path: Path) -> Guesses:
    """The guesses that lie beside a scene's file (room.obj has room.import.yaml), or none."""
    found = path.with_suffix(SUFFIX)
    return read_guesses(found) if found.is_file() else Guesses()


def write_guesses(path: Path, guesses: Guesses, reasons: dict[str, str], source: str) -> None:
    """Write what was guessed, each with its reason as a comment."""
    values: dict[str, Any] = {
        "units": guesses.units,
        "up": guesses.up,
        "floor_z_m": guesses.floor_z_m,
        "robot": guesses.robot,
        "start_pose": None if guesses.start_pose is None else [round(value, 4) for value in guesses.start_pose],
        "hidden": None if guesses.hidden is None else list(guesses.hidden),
        "classes": guesses.classes,
        "lighting": guesses.lighting,
    }
    lines = [
        f"# What was made of {source}. Correct what is wrong, delete what shall be guessed again, and run:",
        f"#   benchbot import-environment {source} --guesses {path.name} --output-location ANOTHER_FOLDER",
    ]
    for key, value in values.items():
        if value is None:
            continue
        if key in reasons:
            lines.append(f"# {reasons[key]}")
        text = yaml.safe_dump({key: value}, sort_keys=False, allow_unicode=True, default_flow_style=False, width=110)
        if isinstance(value, list):
            text = f"{key}: {yaml.safe_dump(value, allow_unicode=True, default_flow_style=True, width=10000)}"
        lines.append(text.rstrip("\n"))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
