"""People."""

from tools.household import materials
from tools.household.item import Item
from tools.household.people import SITTING, STANDING, Looks, person

_MAN = Looks(
    1.02,
    False,
    "#c68e6f",
    "#2f231b",
    False,
    materials.knit("pullover", "#5d6f7c"),
    materials.linen("jeans", "#3d5170"),
    "#5a4332",
)
_WOMAN = Looks(
    0.96,
    True,
    "#d9a787",
    "#6b4528",
    True,
    materials.linen("blouse", "#b86a55"),
    materials.linen("skirt", "#3f4a44"),
    "#2a2526",
    skirt=True,
    eyes="#5a6b4a",
)
_SEATED = Looks(
    0.98,
    True,
    "#7b5139",
    "#1d1714",
    False,
    materials.linen("shirt", "#d6cfb9"),
    materials.linen("trousers", "#4a4a50"),
    "#e6e2da",
)

ITEMS = (
    Item("person_man_standing", "person", lambda: person(STANDING, _MAN), "person", "floor"),
    Item("person_woman_standing", "person", lambda: person(STANDING, _WOMAN), "person", "floor"),
    Item("person_woman_sitting", "sitting person", lambda: person(SITTING, _SEATED), "person", "floor"),
)
