from pathlib import Path

import pytest

from benchbot.core.declarations import formats
from benchbot.core.declarations.catalog import Declaration
from benchbot.core.errors import BenchbotError


def test_a_format_whose_function_raises_whatever_it_likes_is_told_as_any_other() -> None:
    data = {"name": "mine", "functions": {"validate": "json:loads"}}
    declaration = Declaration("format", "mine", Path("mine.yaml"), "benchbot-mine", data)
    formats.validate(declaration, "[]")
    with pytest.raises(BenchbotError) as caught:
        formats.validate(declaration, "no JSON")
    assert caught.value.title == "validate() failed."
    assert caught.value.why.startswith("JSONDecodeError: Expecting value")
