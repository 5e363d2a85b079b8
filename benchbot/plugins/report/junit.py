"""JUnit XML for continuous integration: a test case for each expected episode.

The form is that which Jenkins and GitLab read: https://github.com/testmoapp/junitxml
"""

import re
from xml.etree import ElementTree as ET

from benchbot.core.errors import FailureClass
from benchbot.plugins.drawing.episodes import Episode, Material
from benchbot.plugins.report import summary

_FAULT_OF_OTHERS = (FailureClass.PLATFORM, FailureClass.INFRASTRUCTURE)
# What XML 1.0 cannot hold, not even escaped (section 2.2).
_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def to_junit(material: Material) -> str:
    """Return the episodes as test cases: those that failed fail, those that are no fault of the solution are errors.

    An episode that failed and was scored all the same fails, too; its scores are properties of the case.
    """
    cases = [_case(episode, material) for episode in material.episodes]
    counts = {
        "tests": str(len(cases)),
        "failures": str(sum(case.find("failure") is not None for case in cases)),
        "errors": str(sum(case.find("error") is not None for case in cases)),
    }
    root = ET.Element("testsuites", {"name": _text(summary.title(material)), **counts})
    name = _text(material.scores["task_details"]["name"])
    suite = ET.SubElement(root, "testsuite", {"name": name, **counts})
    _properties(suite, {name: repr(float(value)) for name, value in material.scores["scores"].items()})
    suite.extend(cases)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _case(episode: Episode, material: Material) -> ET.Element:
    place = _text(f"{material.scores['task_details']['name']}.{episode.robot or 'robot'}")
    name = episode.label if episode.source is None or episode.document else f"{episode.label} ({episode.source})"
    case = ET.Element("testcase", {"classname": place, "name": _text(name)})
    found = {name: repr(float(value)) for name, value in (episode.scores or {}).items()}
    time_s = episode.provenance.get("simulated_time_s")
    _properties(case, found | ({} if time_s is None else {"simulated_time_s": str(time_s)}))
    if episode.failure is not None or episode.scores is None:
        kind = "error" if episode.failure in _FAULT_OF_OTHERS else "failure"
        reason = _text(episode.reason or "There is no result.")
        found_at = {"type": _text(episode.failure or "missing"), "message": reason}
        ET.SubElement(case, kind, found_at).text = _text(episode.source or "")
    return case


def _properties(parent: ET.Element, values: dict[str, str]) -> None:
    if values:
        properties = ET.SubElement(parent, "properties")
        for name, value in values.items():
            ET.SubElement(properties, "property", {"name": _text(name), "value": _text(value)})


def _text(value: object) -> str:
    return _FORBIDDEN.sub("\ufffd", str(value))
