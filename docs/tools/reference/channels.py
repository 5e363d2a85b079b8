"""What can be observed and done: names, values, units."""

from benchbot.core.channels import ACTIONS, GIVEN_BY_EPISODES, OBSERVATIONS, Observations
from docs.tools.reference.signatures import annotation
from docs.tools.reference.tables import GENERATED, code, plain, table

_INTRODUCTION = """\
# Observations and actions

A task names those that its solutions get; a robot must have them. Frames and axes follow REP-103 and REP-105 (x
forward, y left, z up; metres, radians but for the angle of `move_angle`), quaternions are x, y, z, w. All
observations of a step are of one instant. How they travel is in [the wire](../wire.md).
The types are in `benchbot.plugin`; `Observations` is that of all together, of which a step holds those that were asked
for (`benchbot.api` has it, too, with the number of the scene). It is a `TypedDict`: a platform with a channel of its
own adds it by `class Mine(Observations, total=False)`, and is a platform of the standard ones still.

"""


def page() -> str:
    """Return the page of observations and actions."""
    types = {name: code(annotation(found)) for name, found in Observations.__annotations__.items()}
    observations = [
        [code(item.name), types[item.name], code(item.value), plain(item.description)] for item in OBSERVATIONS.values()
    ]
    actions = [
        [code(item.name), code(f"{item.argument}") if item.argument else "none", item.unit, plain(item.description)]
        for item in ACTIONS.values()
    ]
    given = ", ".join(map(code, sorted(GIVEN_BY_EPISODES)))
    return (
        GENERATED
        + _INTRODUCTION
        + "## Observations\n\n"
        + table(["name", "type", "value", "meaning"], observations)
        + f"\nA robot need not offer {given}: it comes with the episode.\n"
        + "\n## Actions\n\n"
        + table(["name", "argument", "unit", "meaning"], actions)
    )
