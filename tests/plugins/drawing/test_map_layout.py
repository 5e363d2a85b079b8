from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.plugins.drawing.map_layout import Rectangle, legible, place

PAPER = Rectangle(0, 0, 800, 600)
SIZE = (60.0, 18.0)


def box(x: float, y: float, width: float = 10.0, height: float = 10.0) -> Rectangle:
    return Rectangle(x, y, x + width, y + height)


def test_a_label_goes_into_a_box_that_has_room_for_it() -> None:
    large = box(100, 100, 300, 200)

    (label,) = place([large], [SIZE], [], PAPER)

    assert label.overlap(large) == label.area


def test_a_label_goes_beside_a_small_box() -> None:
    small = box(100, 100)

    (label,) = place([small], [SIZE], [], PAPER)

    assert label.overlap(small) == 0


def test_labels_of_neighbours_keep_clear_of_one_another_and_of_the_boxes() -> None:
    boxes = [box(300 + 14 * i, 300) for i in range(6)]

    labels = place(boxes, [SIZE] * 6, [], PAPER)

    for i, label in enumerate(labels):
        assert all(label.overlap(other) == 0 for other in labels[:i])
        assert all(label.overlap(other) == 0 for other in boxes)


def test_a_label_keeps_clear_of_the_path() -> None:
    path = [(120.0 + x, 105.0) for x in range(0, 70, 3)]

    (label,) = place([box(100, 100)], [SIZE], path, PAPER)

    assert not any(label.left < x < label.right and label.top < y < label.bottom for x, y in path)


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 790), st.integers(0, 590)), max_size=12))
def test_labels_stay_on_the_paper(corners: list[tuple[int, int]]) -> None:
    labels = place([box(x, y) for x, y in corners], [SIZE] * len(corners), [], PAPER)

    assert all(label.overlap(PAPER) > 0.99 * label.area for label in labels)


@given(st.lists(st.tuples(st.integers(0, 300), st.integers(0, 60)), max_size=30))
def test_of_labels_that_would_hide_one_another_the_first_are_kept(corners: list[tuple[int, int]]) -> None:
    labels = [box(x, y, *SIZE) for x, y in corners]

    kept = [label for label, fits in zip(labels, legible(labels), strict=True) if fits]

    assert kept[:1] == labels[:1]
    assert all(a.overlap(b) <= 0.08 * a.area for i, a in enumerate(kept) for b in kept[:i])
    left_out = [label for label, fits in zip(labels, legible(labels), strict=True) if not fits]
    assert all(any(label.overlap(other) > 0.08 * label.area for other in kept) for label in left_out)
