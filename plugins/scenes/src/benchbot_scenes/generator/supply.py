"""The supply of a place: models from a pack, each in a variation of its own, and names for what is placed."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from benchbot_scenes.catalogue import AssetModel, Catalogue
from benchbot_scenes.variations import VARIATIONS


@dataclass
class Supply:
    """The models that a scene is furnished with, and the names of what has been placed.

    Every model that is drawn is a variation that the place does not have yet, where the pack's models vary. What is
    alike in reality is drawn once and put down several times: the chairs and the plates of a table (a local of its
    programme), and what a place has everywhere, such as desks, office chairs and kitchen units (`usual`, `matching`).
    """

    catalogue: Catalogue
    rng: np.random.Generator
    counts: dict[str, int] = field(default_factory=dict)
    style: dict[str, AssetModel] = field(default_factory=dict)
    numbers: dict[str, int] = field(default_factory=dict)
    taken: set[str] = field(default_factory=set)

    def models(self, *kinds: str) -> list[AssetModel]:
        """The models of the first of `kinds` (or classes) that the pack has any of, as they are."""
        for kind in kinds:
            found = self.catalogue.of_kind(kind) or self.catalogue.of_class(kind)
            if found:
                return found
        return []

    def draw(self, *kinds: str, longest_m: float = 99.0, placement: str | None = None) -> AssetModel | None:
        """A model at random, no wider (across its facing) than `longest_m`, for the floor, a surface, …"""
        found = [model for model in self.models(*kinds) if placement in (None, model.placement)]
        return self.one_of([model for model in found if model.size_m[1] <= longest_m], longest_m)

    def one_of(self, models: Sequence[AssetModel], longest_m: float = 99.0) -> AssetModel | None:
        """A new variation of one of some models, which are no wider than `longest_m`; None of none."""
        return self.varied(models[int(self.rng.integers(len(models)))], longest_m) if models else None

    def varied(self, model: AssetModel, longest_m: float = 99.0) -> AssetModel:
        """A variation of a model that the place does not have yet, no wider than `longest_m`.

        The first number of a class or kind is drawn, the others follow it, whatever the model: so those near each other
        have other finishes. The model itself, if it does not vary.
        """
        if model.varies is None:
            return model
        key = model.class_name or model.kind
        if key not in self.numbers:
            self.numbers[key] = int(self.rng.integers(1, VARIATIONS))
        for _ in range(VARIATIONS):
            self.numbers[key] = self.numbers[key] % (VARIATIONS - 1) + 1
            found = model.variation(self.numbers[key])
            if found.id not in self.taken and found.size_m[1] <= longest_m:
                self.taken.add(found.id)
                return found
        return model

    def usual(self, *kinds: str) -> AssetModel | None:
        """The model that this place has everywhere, in one variation."""
        if kinds[0] not in self.style:
            model = self.draw(*kinds)
            if model is None:
                return None
            self.style[kinds[0]] = model
        return self.style[kinds[0]]

    def matching(self, model: AssetModel | None, other: AssetModel | None) -> AssetModel | None:
        """A fitted unit in the variation of another: the same fronts and worktops. What is not fitted stays."""
        if model is None or other is None or model.varies is None or not (model.varies.is_fitted and other.number):
            return model
        return self.catalogue.model(model.base_id).variation(other.number)

    def name(self, model: AssetModel) -> str:
        """A new id for something placed: its class or kind, and a number."""
        stem = (model.class_name or model.kind).replace(" ", "_")
        self.counts[stem] = self.counts.get(stem, 0) + 1
        return f"{stem}_{self.counts[stem]}"
