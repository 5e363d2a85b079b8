import json
import re
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from benchbot.core import text

UNSEEN = ("Cc", "Cf", "Cs", "Zl", "Zp")
SEEN = "\u0600\u0601\u0602\u0603\u0604\u0605\u06dd\u070f\u0890\u0891\u08e2\U000110bd\U000110cd"
"""Format characters that are seen: signs that stand before or around numbers."""
HOSTILE = (
    "\x1b\x07\x08\r\n\t\x9b\x7f\x85\u202e\u2066\u200d\u200c\u200b\ufeff\u2028\ud800[]0;m<>|`_*!()\\#:/@&.w न❤\ufe0f🔥é"
)
FOREIGN = st.text(st.sampled_from(HOSTILE) | st.characters(), max_size=60)


def test_no_character_is_forgotten() -> None:
    every = [chr(number) for number in range(0x110000)]

    left = {letter for letter in every if unicodedata.category(letter) in UNSEEN and text.visible(letter) == letter}
    written = {letter for letter in every if text.visible(letter) != letter}

    assert left == {"\n", "\t", *SEEN}
    assert {unicodedata.category(letter) for letter in written} <= {*UNSEEN, "Cn", "Mn"}


@given(FOREIGN)
def test_what_is_visible_commands_no_terminal_and_stays_so(foreign: str) -> None:
    shown = text.visible(foreign)

    joined = re.sub(r"(?<=[^\x00-\xff])[\u200c\u200d]", "", shown)
    assert not [letter for letter in joined if unicodedata.category(letter) in UNSEEN and letter not in f"\n\t{SEEN}"]
    assert text.visible(shown) == shown
    assert text.one_line(text.one_line(foreign)) == text.one_line(foreign)
    assert len(text.one_line(foreign).splitlines()) <= 1
    assert "\t" not in text.one_line(foreign)


@given(st.recursive(FOREIGN | st.integers(), lambda inner: st.lists(inner) | st.dictionaries(FOREIGN, inner)))
def test_visible_json_is_the_same_document(document: object) -> None:
    shown = text.visible(json.dumps(document, indent=2, ensure_ascii=False))

    assert json.loads(shown) == document
    assert not {"\x1b", "\x9b", "\x7f", "\u202e", "\r"} & set(shown)


@pytest.mark.parametrize(
    ("foreign", "shown"),
    [
        ("\x1b]52;c;cm0=\x07", r"\u001b]52;c;cm0=\u0007"),
        ("\x1b[2J\x1b[HResult: 1.0", r"\u001b[2J\u001b[HResult: 1.0"),
        ("\x1b[1;31mERROR\x1b[0m: no", "ERROR: no"),
        ("\x1b\x1b[0m[2J", r"\u001b[2J"),
        ("half \ud800, a tag \U000e0041", r"half \ud800, a tag \udb40\udc41"),
        ("0.1 \u202e0.9\u202c", r"0.1 \u202e0.9\u202c"),
    ],
)
def test_attacks_are_written_out_and_colours_left_out(foreign: str, shown: str) -> None:
    assert text.visible(foreign) == shown


@pytest.mark.parametrize(
    "words", ["Grüße, 世界", "می\u200cخواهم", "क्\u200dष", "👨\u200d👩\u200d👧 ❤️\u200d🔥", "a\n\tb"]
)
def test_all_languages_stay_readable(words: str) -> None:
    assert text.visible(words) == words


@given(FOREIGN, st.sampled_from(["default", "gfm-like"]))
def test_no_markdown_comes_of_foreign_text(foreign: str, flavour: str) -> None:
    parser = MarkdownIt(flavour)
    (row,) = [
        token for token in parser.parse(f"| a {text.markdown(foreign)} b |\n|---|\n| c |\n") if "a " in token.content
    ]
    paragraph = parser.parse(f"a {text.markdown(foreign)} b")

    for inline in (row, paragraph[1]):
        assert {token.type for token in inline.children or ()} <= {"text", "text_special"}
    assert len(paragraph) == 3


@pytest.mark.parametrize("address", ["https://evil.example/x", "www.evil.example", "![x](https://evil.example/x.png)"])
def test_no_address_becomes_a_link(address: str) -> None:
    rendered = MarkdownIt("gfm-like").render(f"see {text.markdown(address)} there")

    assert "<a" not in rendered
    assert "<img" not in rendered
