"""The meaning of names of nodes, groups and prims: the kind of object, or a collider for physics engines."""

import re
from dataclasses import dataclass
from functools import cache

from benchbot_scenes.importing.vocabulary import CLASSES, COLLIDER_WORDS, NO_CLASS, SYNONYMS

_WORD = re.compile(r"[A-ZÀ-ÖØ-Þ]+(?![a-zß-öø-ÿ])|[A-ZÀ-ÖØ-Þ]?[a-zß-öø-ÿ]+")
_IRREGULAR = {"knives": "knife", "shelves": "shelf", "leaves": "leaf", "people": "people", "mice": "mouse"}
_NOT_PLURAL = frozenset(("glass", "stairs", "clothes", "blinds", "headphones", "tablecloth", "canvas", "wc", "bus"))
LONGEST = 3
_COARSER = re.compile(r"lod[ _]?[1-9]\d*$", re.IGNORECASE)
SEVERAL = frozenset(("set", "group", "pile", "stack", "row", "collection", "bunch", "pair"))


@dataclass(frozen=True)
class Meaning:
    """The meaning of a name: a `noun` of the vocabulary, its class if it has one, and whether it means several."""

    noun: str
    class_name: str | None
    is_plural: bool


def words(name: str) -> list[str]:
    """The words of a name in lower case: "SM_DiningChair.003" is sm, dining, chair."""
    return [word.lower() for word in _WORD.findall(name)]


def is_collider(name: str) -> bool:
    """Return whether a name marks a mesh as invisible: it is for physics, or a coarser copy (LOD1, …)."""
    return _COARSER.search(name) is not None or not COLLIDER_WORDS.isdisjoint(words(name))


def meaning(name: str) -> Meaning | None:
    """The meaning of the last noun of a name, in English the kind of the object; None for a name without a known noun.

    "Chair_wood_01" is a chair, since wood is no thing here, "tv stand" a stand and "wine glass" a wine glass.
    """
    left = words(name)
    is_several = not SEVERAL.isdisjoint(left)
    while left:
        for length in range(min(LONGEST, len(left)), 0, -1):
            phrase = left[-length:]
            for last, is_plural in ((phrase[-1], False), (singular(phrase[-1]), True)):
                noun = " ".join([*phrase[:-1], last])
                if noun in _nouns() and (last == phrase[-1] or is_plural):
                    return Meaning(noun, _nouns()[noun], is_several or (is_plural and last != phrase[-1]))
        left.pop()
    return None


@cache
def _nouns() -> dict[str, str | None]:
    nouns: dict[str, str | None] = dict.fromkeys(NO_CLASS)
    for class_name in CLASSES:
        nouns |= dict.fromkeys((class_name, *SYNONYMS[class_name]), class_name)
    return nouns


def singular(word: str) -> str:
    """The singular of a word in lower case; the word itself where it is one."""
    if word in _NOT_PLURAL or len(word) < 4:
        return word
    if word in _IRREGULAR:
        return _IRREGULAR[word]
    if word.endswith("ies"):
        return word[:-3] + "y"
    if word.endswith(("ches", "shes", "xes", "sses")):
        return word[:-2]
    return word[:-1] if word.endswith("s") and not word.endswith("ss") else word
