"""The items of the pack that we make ourselves, by category."""

from tools.household.catalogue import (
    bathroom,
    bedroom,
    clutter,
    decor,
    electronics,
    food,
    kitchen,
    lamps,
    living,
    office,
    openings,
    people,
    storage,
    tableware,
)
from tools.household.item import Item


def items() -> tuple[Item, ...]:
    """Every item, in a fixed order."""
    return (
        *living.ITEMS,
        *bedroom.ITEMS,
        *storage.ITEMS,
        *kitchen.ITEMS,
        *bathroom.ITEMS,
        *lamps.ITEMS,
        *electronics.ITEMS,
        *food.ITEMS,
        *tableware.ITEMS,
        *decor.ITEMS,
        *office.ITEMS,
        *openings.ITEMS,
        *people.ITEMS,
        *clutter.ITEMS,
    )
