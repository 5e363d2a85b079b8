"""What a wheel says of itself: name, Python, licence, README, version, and what it needs of the others."""

import re
from collections.abc import Iterator, Sequence
from io import StringIO
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from readme_renderer import markdown

from release.building import Built

_HEADING = re.compile(r"^## (?:\[?(?P<version>\d[^\]\s]*)\]?|Unreleased)", re.MULTILINE)
_RELATIVE = re.compile(r"\]\((?!https?://|#|mailto:)([^)\s]+)")


def problems(built: Built, others: Sequence[Built]) -> Iterator[str]:
    """Yield what is wrong with the metadata of a wheel; `others` are all that are to be uploaded together."""
    metadata = built.metadata()
    for key in ("Summary", "Requires-Python", "License-Expression"):
        if not metadata[key]:
            yield f"{key} is missing"
    if canonicalize_name(str(metadata["Name"])) != built.project.name:
        yield f"it is called {metadata['Name']}, not {built.project.name}"
    if metadata["Description-Content-Type"] != "text/markdown":
        yield "the README is not said to be Markdown"
    said = StringIO()
    if not markdown.render(str(metadata.get_payload()), stream=said):
        yield f"the README cannot be rendered as PyPI does: {said.getvalue().strip()}"
    own = {other.project.name: other for other in others}
    for text in metadata.get_all("Requires-Dist", []):
        requirement = Requirement(text)
        sibling = own.get(canonicalize_name(requirement.name))
        if sibling is None:
            if canonicalize_name(requirement.name).startswith("benchbot-"):
                yield f"it needs {requirement.name}, which is not made here"
        elif not requirement.specifier.contains(sibling.version, prereleases=True):
            yield f"it needs {requirement}, and the version that is made here is {sibling.version}"


def relative_links(built: Built) -> list[str]:
    """Return links of the README that lead nowhere on PyPI, since they are relative to the repository."""
    return _RELATIVE.findall(str(built.metadata().get_payload()))


def problems_together(all_built: Sequence[Built], changelog: Path, *, final: bool) -> Iterator[str]:
    """Yield what is wrong with versions and extras; a `final` release has a heading of its own in the changelog."""
    core = next(built for built in all_built if built.project.name == "benchbot")
    versions = sorted({f"{built.project.name} {built.version}" for built in all_built if built.version != core.version})
    if versions:
        yield f"benchbot is {core.version}, but: {', '.join(versions)}"
    headings = [match["version"] for match in _HEADING.finditer(changelog.read_text("utf-8"))]
    if not headings:
        yield f"{changelog.name} has no heading of a version"
    elif headings[0] is None and final:
        yield f"{changelog.name} begins with 'Unreleased': call it '{core.version}', with the date"
    elif headings[0] is None and core.version in headings:
        yield f"{core.version} is released already, says {changelog.name}: raise the version"
    elif headings[0] is not None and headings[0] != core.version:
        yield f"{changelog.name} begins with {headings[0]}, and the version is {core.version}"
    offered = {
        canonicalize_name(requirement.name)
        for requirements in core.project.extras.values()
        for requirement in requirements
    }
    for built in all_built:
        if built.project.name not in {"benchbot", *offered}:
            yield f"no extra of benchbot brings {built.project.name}"
