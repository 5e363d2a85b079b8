"""Small objects on surfaces, by the use of the surface."""

from benchbot_scenes.generator.furnish import Furnisher
from benchbot_scenes.generator.plot import Item

# Where fork, knife and spoon lie beside the middle of a plate, and a cup or glass behind it.
FORK_M, SPOON_M, BEHIND_PLATE_M = 0.18, 0.23, 0.21
# The share of a table's length that is laid.
WITHIN_TABLE = 0.8
# The share of the places at a table that are laid, each with all that belongs to it.
LAID = 0.75
# The least and the most that the width of a tv is, as a share of that of the board it stands on.
TV_OF_BOARD = (0.5, 1.0)
SOAP = ("soap bottle", "bottle")
# The share of the ends of shelves where books stand in a row.
ROWS_OF_BOOKS = 0.6
WORKTOP = (
    "bottle",
    "bottle",
    "soap bottle",
    "cup",
    "cup",
    "bowl",
    "knife",
    "spoon",
    "wine glass",
    "cake",
    "vase",
    "tray",
)
FRUIT = ("apple", "orange", "banana")


def dining(room: Furnisher, table: Item, places: int) -> None:
    """Laid for so many, with plates, cutlery and cups of one set, and something to eat in the middle."""
    supply, rng = room.supply, room.plot.rng
    kinds = ("plate", "fork", "knife", "spoon", "cup", "wine glass")
    one_set = {kind: supply.draw(kind, placement="surface") for kind in kinds}
    room.on_top(supply.draw("bowl", placement="surface"), table, (0.0, 0.0), 0.0)
    long_y = table.size_m[1] >= table.size_m[0]
    half_across, half_along = (
        (table.size_m[0] / 2, table.size_m[1] / 2) if long_y else (table.size_m[1] / 2, table.size_m[0] / 2)
    )
    for place in range(places):
        side = 1 if place % 2 else -1
        along = ((place // 2 + 0.5) / max(1, (places + 1) // 2) - 0.5) * 2 * half_along * 0.9
        across = side * (half_across - 0.17)
        drink = "wine glass" if rng.random() < 0.4 else "cup"
        if rng.random() >= LAID:
            continue
        for kind, shift in (("plate", 0.0), ("fork", FORK_M), ("knife", -FORK_M), ("spoon", -SPOON_M), (drink, 0.0)):
            inward = across - side * BEHIND_PLATE_M if kind == drink else across
            spot = (inward, along + shift) if long_y else (along + shift, inward)
            if abs(along + shift) < WITHIN_TABLE * half_along:
                room.on_top(one_set[kind], table, spot, 0.0 if long_y else 90.0)
    for kind in ("bottle", "cake", *FRUIT):
        if rng.random() < 0.35:
            room.on_top(supply.draw(kind, placement="surface"), table)


def worktop(room: Furnisher, tops: list[Item]) -> None:
    """Appliances, tableware and food on the worktops of a kitchen."""
    supply, rng = room.supply, room.plot.rng
    if not tops:
        return
    wide = sorted(tops, key=lambda top: -top.size_m[1])
    room.on_top(supply.draw("microwave"), wide[0], turn_deg=0.0)
    room.on_top(supply.draw("toaster"), wide[min(1, len(wide) - 1)], turn_deg=0.0)
    kinds = [*WORKTOP, *FRUIT]
    chosen = [kinds[i] for i in rng.permutation(len(kinds))[: int(rng.integers(5, 9))]]
    for kind in chosen:
        room.on_top(supply.draw(kind, placement="surface"), tops[int(rng.integers(len(tops)))])


def desk(room: Furnisher, table: Item, monitor: bool) -> None:
    """A workplace; its user faces -x of the desk's frame."""
    supply, rng = room.supply, room.plot.rng
    half_y = table.size_m[1] / 2
    shift = float(rng.uniform(-0.08, 0.08))
    screen = supply.draw("monitor", placement="surface") or supply.draw("tv", longest_m=0.8, placement="surface")
    if monitor and screen is not None:
        room.on_top(screen, table, (-0.16, shift), 0.0)
        room.on_top(supply.draw("keyboard", placement="surface"), table, (0.12, shift), 0.0)
        room.on_top(supply.draw("mouse", placement="surface"), table, (0.13, shift + 0.30), 0.0)
    else:
        room.on_top(supply.draw("laptop", placement="surface"), table, (0.02, shift), 0.0)
        room.on_top(supply.draw("mouse", placement="surface"), table, (0.10, shift + 0.26), 0.0)
    side = 1 if rng.random() < 0.5 else -1
    for kind, chance, x, y in (
        ("cup", 0.6, 0.05, side * (half_y - 0.16)),
        ("cell phone", 0.4, 0.18, -side * (half_y - 0.22)),
        ("book", 0.5, -0.12, -side * (half_y - 0.22)),
        ("table lamp", 0.35, -0.16, side * (half_y - 0.22)),
    ):
        if rng.random() < chance:
            room.on_top(supply.draw(kind, placement="surface"), table, (x, y), float(rng.uniform(-25, 25)))


def tv(room: Furnisher, board: Item) -> None:
    """In the middle of a board: one that is neither small nor too wide for it, else the one nearest to that."""
    least_m, most_m = (share * board.size_m[1] for share in TV_OF_BOARD)
    found = sorted(room.supply.models("tv"), key=lambda model: model.size_m[1])
    found = [model for model in found if model.placement == "surface" and model.size_m[1] <= most_m]
    fitting = [model for model in found if model.size_m[1] >= least_m] or found[-1:]
    room.on_top(room.supply.one_of(fitting, most_m), board, (0.0, 0.0), 0.0)


def shelves(room: Furnisher, case: Item, most: int) -> None:
    """Rows of books along the shelves of a bookcase, and a few other things beside them; the lowest stays empty."""
    supply, rng = room.supply, room.plot.rng
    count = len(case.model.surfaces)
    levels = [i for i in range(1, count) if i < count - 1 or case.size_m[2] < 1.4] or [0]
    for level in levels:
        for side in (-1, 1):
            row = supply.draw("book row", longest_m=0.35, placement="surface")
            if row is not None and rng.random() < ROWS_OF_BOOKS:
                along = side * (case.size_m[1] / 2 - row.size_m[1] / 2 - float(rng.uniform(0.05, 0.09)))
                room.on_top(row, case, (0.0, along), 0.0, level)
    for _ in range(most):
        kind = ("book", "standing book", "vase", "clock", "bowl", "potted plant")[int(rng.integers(6))]
        turn = float(rng.uniform(-6, 6)) if "book" in kind else float(rng.uniform(-20, 20))
        room.on_top(
            supply.draw(kind, longest_m=0.35, placement="surface"),
            case,
            turn_deg=turn,
            surface=levels[int(rng.integers(len(levels)))],
        )


def bathroom(room: Furnisher, shelf: Item | None) -> None:
    """Soap, a cup and perhaps a plant on a shelf."""
    supply, rng = room.supply, room.plot.rng
    for kinds in (SOAP, SOAP, SOAP, ("cup",), ("potted plant",)):
        if rng.random() < 0.65:
            room.on_top(supply.draw(*kinds, placement="surface"), shelf, turn_deg=float(rng.uniform(-40, 40)))


def scatter(room: Furnisher, carrier: Item | None, kinds: tuple[str, ...], chance: float = 0.6) -> None:
    """Each of some kinds, perhaps, somewhere on a carrier."""
    for kind in kinds:
        if carrier is not None and room.plot.rng.random() < chance:
            room.on_top(
                room.supply.draw(kind, placement="surface"), carrier, turn_deg=float(room.plot.rng.uniform(-30, 30))
            )
