"""The classes that a score is over: names, synonyms and probabilities brought to one list."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import BenchbotError, GroundTruth

BACKGROUND = "background"


@dataclass(frozen=True)
class Classes:
    """Lower-case class names with the background last, and other names for them."""

    names: tuple[str, ...]
    synonyms: Mapping[str, str]

    @classmethod
    def of(cls, ground_truths: Sequence[GroundTruth]) -> "Classes":
        """Return the union of the class lists and of the synonyms of ground truths.

        Without class_list its environment's object_labels stand for it. Raises BenchbotError when it has neither.
        """
        names: set[str] = set()
        synonyms: dict[str, str] = {}
        for document in ground_truths:
            truth, environment = document["ground_truth"], document.get("environment", {})
            listed = truth.get("class_list") or environment.get("object_labels")
            if not listed:
                raise BenchbotError(
                    "A ground truth has no classes.",
                    f"The one of '{environment.get('name')}:{environment.get('variant')}' has neither a "
                    "class_list nor its environment's object_labels.",
                    "Add a class_list to the ground truth.",
                )
            names |= {name.lower() for name in listed}
            for name, meaning in truth.get("synonyms", {}).items():
                synonyms.setdefault(name.lower(), meaning.lower())
        return cls((*sorted(names - {BACKGROUND}), BACKGROUND), synonyms)

    def index(self, name: str) -> int | None:
        """Return the place of a class in `names`, following synonyms to their end; None when there is none."""
        name, seen = name.lower(), set[str]()
        while name not in self.names and name in self.synonyms and name not in seen:
            seen.add(name)
            name = self.synonyms[name]
        return self.names.index(name) if name in self.names else None

    def probabilities(self, weights: Sequence[Sequence[float]], class_list: Sequence[str]) -> NDArray[np.float64]:
        """Return weights over `class_list` as probabilities over `names`, (N, len(names)).

        Classes that `names` lacks count as background. See `normalised` for sums other than 1.
        """
        columns = np.zeros((len(class_list), len(self.names)))
        for row, name in enumerate(class_list):
            index = self.index(name)
            columns[row, -1 if index is None else index] = 1.0
        return normalised(np.asarray(weights, float).reshape(-1, len(class_list)) @ columns)


def normalised(weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rows that sum to 1: divided by a sum above 1, else with the rest added to the last column."""
    sums = weights.sum(axis=1, keepdims=True)
    probabilities: NDArray[np.float64] = weights / np.maximum(sums, 1.0)
    probabilities[:, -1:] += np.maximum(1.0 - sums, 0.0)
    return probabilities
