import json
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.declarations.positions import Keys, Positions

KEYS = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Zl", "Zp")), min_size=1, max_size=8)
DOCUMENTS = st.dictionaries(
    KEYS,
    st.recursive(
        st.none() | st.booleans() | st.text(max_size=5),
        lambda inner: st.lists(inner, min_size=1, max_size=3) | st.dictionaries(KEYS, inner, min_size=1, max_size=3),
        max_leaves=8,
    ),
    min_size=1,
    max_size=3,
)


def numbered(value: Any, numbers: Iterator[int]) -> Any:
    """Put a number of its own into each place where there is neither a mapping nor a list."""
    if isinstance(value, dict):
        return {key: numbered(inner, numbers) for key, inner in value.items()}
    if isinstance(value, list):
        return [numbered(inner, numbers) for inner in value]
    return next(numbers)


def places(value: Any, keys: tuple[str | int, ...] = ()) -> Iterator[tuple[Keys, int]]:
    if isinstance(value, int):
        yield keys, value
    else:
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from places(inner, (*keys, key))


@pytest.mark.parametrize("suffix", [".json", ".yaml"])
@given(shape=DOCUMENTS)
def test_every_value_is_found_in_the_line_where_it_is(suffix: str, shape: dict[str, Any]) -> None:
    document = numbered(shape, iter(range(100_000, 200_000)))
    with TemporaryDirectory() as folder:
        path = Path(folder, f"a{suffix}")
        written = json.dumps(document, indent=1) if suffix == ".json" else yaml.safe_dump(document, allow_unicode=True)
        path.write_text(written, encoding="utf-8", newline="\n")
        positions = Positions(path)
        lines = written.split("\n")
        for keys, number in places(document):
            line = positions.line(keys)
            assert line is not None
            # A long or odd key has a line of its own (`? key`), and its value the next one.
            assert str(number) in lines[line - 1] or str(number) in lines[line]


def test_what_is_not_there_is_placed_where_it_would_be(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text('{"a": 1,\n "b": [\n  {"c": 2}]}')
    positions = Positions(path)

    assert positions.line(["b", 0, "nothing", "of", "this"]) == 3
    assert positions.line(["b", 7]) == 2
    assert Positions(tmp_path / "nowhere.yaml").line(["a"]) is None


def test_repeated_keys_are_told_even_where_an_anchor_holds_itself(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("a: &x\n  b: *x\n  c: 1\n  c: 2\n<<: *x\n'on': 1\n")
    positions = Positions(path)

    assert list(positions.repeated()) == [(["a"], "c", 3, 4)]
    assert positions.line(["a", "c"]) == 4
