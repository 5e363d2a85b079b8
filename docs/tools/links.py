"""The links of a Markdown page: found and rewritten, but for those in code."""

import re
from collections.abc import Callable, Iterator

_CODE = re.compile(r"^(?P<fence> *(?:```+|~~~+)).*?^(?P=fence)", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"(\]\()([^)\s]+)(\))")
_ELSEWHERE = re.compile(r"[a-z][a-z0-9+.-]*:", re.IGNORECASE)


def is_local(target: str) -> bool:
    """Return whether a link leads to a file, rather than to another host or within its page."""
    return not (_ELSEWHERE.match(target) or target.startswith(("#", "//")))


def targets(text: str) -> Iterator[str]:
    """Yield the targets of all links and pictures to files, as they are written."""
    for piece, is_code in _pieces(text):
        if not is_code:
            yield from (match[2] for match in _LINK.finditer(piece) if is_local(match[2]))


def rewritten(text: str, new_target: Callable[[str], str]) -> str:
    """Return the page with the target of each link to a file replaced."""

    def replace(match: re.Match[str]) -> str:
        return match[1] + (new_target(match[2]) if is_local(match[2]) else match[2]) + match[3]

    return "".join(piece if is_code else _LINK.sub(replace, piece) for piece, is_code in _pieces(text))


def _pieces(text: str) -> Iterator[tuple[str, bool]]:
    """Yield the page in pieces, each with whether it is a block of code."""
    end = 0
    for match in _CODE.finditer(text):
        yield text[end : match.start()], False
        yield match[0], True
        end = match.end()
    yield text[end:], False
