"""Ground truths by environment: those that plug-ins declare, or those in files."""

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, cast

from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.documents import GroundTruth
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.resources import declaration_files


class GroundTruths:
    """The ground truths to score against, by `name:variant` and format."""

    def __init__(self, paths: Sequence[Path], made: Callable[[str], Sequence[Path]] = lambda _: ()) -> None:
        """Read those in `paths`; `made` returns the files of an environment, `name:variant`, that is not among them."""
        self._documents: dict[tuple[str, str], GroundTruth] = {}
        self._made = made
        self._read(paths)

    def _read(self, paths: Sequence[Path]) -> None:
        origins: dict[tuple[str, str], Path] = {}
        for path in paths:
            document = schema.read(path)
            schema.check(document, "ground_truth", path)
            key = (environment_of(document["environment"]), str(document["format"]["name"]))
            if key in origins:
                raise BenchbotError(
                    f"There are two ground truths of the environment '{key[0]}'.",
                    f"{origins[key]} and {path} both have the format '{key[1]}'.",
                    "Keep one of them, or name the one to use with --ground-truth.",
                )
            origins[key] = path
            self._documents[key] = cast(GroundTruth, document)

    @classmethod
    def of(cls, catalog: Catalog, paths: Sequence[Path] | None) -> "GroundTruths":
        """Return those in `paths` (JSON files, and folders of them) when given, else those that plug-ins declare."""
        if paths is None:
            return cls(catalog.ground_truth_files, catalog.made_ground_truth_files)
        return cls(tuple(declaration_files(paths, (".json",))))

    def find(self, environment: str, formats: Collection[str]) -> GroundTruth:
        """Return the truth of `name:variant` in one of `formats`; raises BenchbotError that names what there is."""
        if not any((environment, name) in self._documents for name in formats):
            self._read(self._made(environment))
        for name in sorted(formats):
            if (environment, name) in self._documents:
                return self._documents[environment, name]
        known = sorted({environment for environment, name in self._documents if name in formats})
        raise BenchbotError(
            f"There is no ground truth of the environment '{environment}'.",
            f"There is one of: {', '.join(known) or 'none'}.{did_you_mean(environment, known)}",
            "Install the plug-in that provides it, or name its file with --ground-truth.",
        )


def environment_of(details: Mapping[str, Any]) -> str:
    """Return `name:variant` of an environment's declaration."""
    return f"{details['name']}:{details['variant']}"


def digest(ground_truth: GroundTruth) -> str:
    """Return the SHA-256 of a ground truth's canonical JSON: keys sorted, no spaces."""
    text = json.dumps(ground_truth, sort_keys=True, separators=(",", ":"))
    return sha256(text.encode()).hexdigest()
