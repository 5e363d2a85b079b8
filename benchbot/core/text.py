r"""Foreign text as it is shown: no character of it commands a terminal, reorders a line, or is there unseen.

Foreign is all text that BenchBot did not write itself: the output of a solution, names in declarations, results and
bundles, messages of plug-ins. It is kept as it is, and made visible where it is shown: colours are left out, other
such characters are written as JSON writes them (`\u001b`), so that JSON stays the same document.
"""

import re

SOLUTION = "solution | "
"""The beginning of each line that a solution has printed, wherever lines of BenchBot's own stand beside it."""

_COLOURS = re.compile(r"\x1b\[[0-9;:]*m")
# Control characters (Cc) but line feed and tab, format characters (Cf) but the visible ones of Arabic, Syriac and
# Kaithi, separators of lines and paragraphs, half surrogate pairs, and what XML cannot hold. Joiners stay where scripts
# and emoji need them.
_UNSEEN = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\xad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb"
    r"\ufffe\uffff\ud800-\udfff\U00013430-\U0001343f\U0001bca0-\U0001bca3\U0001d173-\U0001d17a\U000e0000-\U000e007f]"
    r"|(?<![\u0620-\u180d\u180f-\u1fff\u2190-\u2bff\ufe0f\U0001f000-\U0001faff])[\u200c\u200d]"
)
_BREAKS = re.compile(r"[\t\n\x0b\x0c\r\x1c-\x1e\x85\u2028\u2029]")
# Marks, but for underscores within words, which mark nothing; and what makes links of bare addresses.
_MARKDOWN = re.compile(r"[\\`*{}\[\]()<>#+!|~&$@]|(?<![^\W_])_|_(?![^\W_])|:(?=//)|(?<=www)\.", re.IGNORECASE)


def visible(text: str) -> str:
    """Return a text of any number of lines without colours and with all else that is unseen written out."""
    return _UNSEEN.sub(_written, _COLOURS.sub("", text))


def one_line(text: str) -> str:
    """Return a text, visible, as one line: breaks and tabs become spaces."""
    return visible(_BREAKS.sub(" ", text))


def markdown(text: str) -> str:
    """Return a text, as one line, for use within a line of Markdown: nothing of it is markup, HTML, link or picture."""
    return _MARKDOWN.sub(r"\\\g<0>", one_line(text))


def _written(found: re.Match[str]) -> str:
    return re.sub("(....)", r"\\u\1", found[0].encode("utf-16-be", "surrogatepass").hex())
