import csv
import io
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from markdown_it.token import Token

from benchbot.core.atomic import write_text
from benchbot.core.errors import BenchbotError
from benchbot.plugins.report import exports
from benchbot.plugins.report.rendering import FORMATS, format_of, render
from tests.made_results import Make, Save
from tests.plugins.report.conftest import Report, provenance


def test_csv_has_a_row_for_each_result_and_score(report: Report, results: list[Path]) -> None:
    rows = list(csv.DictReader(io.StringIO(render(report(results), "csv"))))

    assert len(rows) == 4 * 5
    first, last = rows[0], rows[-1]
    assert (first["environment"], first["place"], first["variant"], first["seed"]) == ("flat:1", "flat", "1", "0")
    assert (first["score"], first["status"], first["robot"]) == ("OMQ", "scored", "carter_lowres")
    assert 0.9 < float(first["value"]) < 1
    assert (last["environment"], last["status"], last["value"], last["failure"]) == ("flat:2", "missing", "", "timeout")
    assert last["source"] == str(results[3])


def test_a_spreadsheet_runs_nothing_that_a_result_says(report: Report, make_result: Make, save: Save) -> None:
    document = make_result(0.0, provenance=provenance(0, ("agent", '=HYPERLINK("http://x","y")')))
    document["provenance"]["selection"]["robot"] = "@SUM(1)\r\n+1"

    text = render(report([save("a.json", document)]), "csv")

    row = next(csv.DictReader(io.StringIO(text)))
    assert row["reason"] == '\'=HYPERLINK("http://x","y")'
    assert row["robot"] == "'@SUM(1)  +1"
    assert len(text.splitlines()) == 1 + 5


def test_latex_is_a_booktabs_table_with_all_text_escaped(report: Report, results: list[Path]) -> None:
    material = report(results, name=r"50% & \input{x} $y_1^2$ #~")

    text = render(material, "tex")

    assert r"50\% \& \textbackslash{}input\{x\} \$y\_1\textasciicircum{}2\$ \#\textasciitilde{}" in text
    assert r"avg\_pairwise" in text
    lines = [line.strip() for line in text.splitlines()]
    assert [line for line in lines if line.endswith("rule")] == [r"\toprule", r"\midrule", r"\midrule", r"\bottomrule"]
    body = [line for line in lines if line.endswith(r"\\")]
    assert [line.split(" & ")[0] for line in body] == ["Environment", "flat:1", "flat:2", "all"]
    assert {line.count(" & ") for line in body} == {6}
    assert "3 of 4 results scored; 1 missing, counted as zero" in text


def test_markdown_has_the_table_and_the_failures(report: Report, results: list[Path]) -> None:
    material = report(results, name="a | b <script> *c*")
    material.scores["intervals"] = {"OMQ": {"low": 0.25, "high": 0.75, "level": 0.95}}

    text = render(material, "md")

    assert text.startswith("# a \\| b \\<script\\> \\*c\\*\n")
    assert "[0.250, 0.750]" in text
    assert "| flat:2 | 0.500 |" in text
    assert "| timeout | 1 | flat:2, seed 1: The episode failed: It took longer than 600 s. |" in text
    assert len({line.count(" | ") for line in text.splitlines() if line.startswith("| ") and "0." in line}) == 1


def test_junit_has_a_case_for_each_expected_episode(
    report: Report, results: list[Path], make_result: Make, save: Save
) -> None:
    died = make_result(0.0, variant=2, provenance=provenance(2, ("platform", "The simulator died.\x00")))
    del died["results"]
    material = report([*results, save("died.json", died)], required_envs=["flat:1", "flat:2", "flat:3"])

    suites = ET.fromstring(render(material, "xml"))

    assert (suites.get("tests"), suites.get("failures"), suites.get("errors")) == ("8", "5", "1")
    cases = {case.get("name"): case for case in suites.iter("testcase")}
    assert len(cases) == 8
    assert cases["flat:1, seed 0"].find("failure") is None
    crashed, late, gone = (cases[f"flat:2, seed {i}"] for i in range(3))
    assert [item.get("value") for item in crashed.iter("property") if item.get("name") == "OMQ"] == ["1.0"]
    found = crashed.find("failure"), late.find("failure"), gone.find("error")
    assert [None if element is None else element.get("type") for element in found] == [
        "collision",
        "timeout",
        "platform",
    ]
    assert found[2] is not None
    assert found[2].get("message") == "The episode failed: The simulator died.\\u0000"
    absent = cases["flat:3, seed 0"].find("failure")
    assert absent is not None
    assert (absent.get("type"), absent.get("message")) == ("missing", "There is no result of this environment.")


FOREIGN = st.text(st.sampled_from("=+-@＝\t\r\n,;'\"\\{}$|`<>[]()!\x1b\x9b\u202e\ud800\x00") | st.characters())


@given(st.lists(FOREIGN | st.integers() | st.floats() | st.none(), min_size=1))
def test_a_row_is_read_back_cell_by_cell_and_no_cell_is_a_formula(values: list[object]) -> None:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerow([*map(exports._cell, values), "end"])

    rows = list(csv.reader(io.StringIO(out.getvalue())))

    assert [len(row) for row in rows] == [len(values) + 1]
    for value, cell in zip(values, rows[0], strict=False):
        if isinstance(value, str):
            assert not [part for part in cell.split(";") if part.lstrip().startswith(("=", "+", "-", "@", "＝"))]
            assert "\x1b" not in cell
        elif value is not None:
            assert cell == str(value)


@given(FOREIGN)
def test_no_text_breaks_a_table(text: str) -> None:
    latex = exports.latex(text)
    assert "\n" not in latex
    bare = re.sub(r"\\[{}]", "", latex)
    assert bare.count("{") == bare.count("}")
    ET.fromstring(ET.tostring(ET.Element("a", {"b": exports._xml(text)})))


HOSTILE = (
    "<script>alert(1)</script> ![x](https://evil.example/x.png) [y](javascript:z) `a` | b\n# c\n"
    "\x1b]52;c;cm0=\x07\x9b2J\u202e0.9\u202c\u2028=1+1"
)


@pytest.mark.parametrize("name", FORMATS)
def test_a_hostile_result_is_inert_in_every_format(
    report: Report, results: list[Path], make_result: Make, save: Save, name: str
) -> None:
    document = make_result(0.0, provenance=provenance(0, ("agent", HOSTILE)))
    document["provenance"]["selection"]["robot"] = HOSTILE
    document["environment_details"][0]["variant"] = HOSTILE

    text = render(report([*results, save("a.json", document)], name=HOSTILE), name)

    assert not {"\x1b", "\x07", "\x9b", "\u202e", "\u202c", "\u2028"} & set(text)
    if name == "md":
        kinds = {kind for token in MarkdownIt("gfm-like").parse(text) for kind in kinds_of(token)}
        assert not {"link_open", "image", "html_inline", "html_block", "code_inline"} & kinds
        assert {"table_open", "heading_open"} < kinds
    if name == "html":
        assert tags_of(text).isdisjoint({"script", "img:https://evil.example/x.png"})
    if name == "csv":
        assert {len(row) for row in csv.reader(io.StringIO(text))} == {len(exports.CSV_COLUMNS)}


def kinds_of(token: Token) -> Iterator[str]:
    yield token.type
    for child in token.children or ():
        yield from kinds_of(child)


def tags_of(page: str) -> set[str]:
    """Return the tags of a page, those of pictures and links with their address."""
    found = set()

    class Reader(HTMLParser):
        def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
            found.add(tag)
            found.update(f"{tag}:{value}" for key, value in attributes if key in ("src", "href"))

    Reader().feed(page)
    return found


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_is_the_same_text_each_time(report: Report, results: list[Path], name: str) -> None:
    assert render(report(results), name) == render(report(results), name)


@pytest.mark.parametrize("name", FORMATS)
def test_text_that_is_no_unicode_can_be_written(
    report: Report, make_result: Make, save: Save, tmp_path: Path, name: str
) -> None:
    document = make_result(0.0, provenance=provenance(0, ("agent", "half \ud800 of a pair, and a \x00")))

    write_text(tmp_path / "report", render(report([save("a.json", document)]), name))

    assert "half" in (tmp_path / "report").read_text("utf-8") or name == "tex"


def test_the_format_is_told_by_the_ending() -> None:
    assert [format_of(Path(f"a.{ending}")) for ending in ("HTML", "htm", "tex", "md", "xml", "csv")] == [
        "html", "html", "tex", "md", "xml", "csv",
    ]  # fmt: skip
    for name in ("report", "report.pdf", "report.htlm"):
        with pytest.raises(BenchbotError, match=r"It is not known what to write"):
            format_of(Path(name))


def test_a_report_that_cannot_be_written_leaves_what_is_there(tmp_path: Path) -> None:
    write_text(tmp_path / "new" / "a.md", "old")
    (tmp_path / "file").write_text("")

    with pytest.raises(BenchbotError, match="Cannot write"):
        write_text(tmp_path / "file" / "a.md", "text")
    with pytest.raises(BenchbotError, match="Cannot write"):
        write_text(tmp_path / "new", "text")

    assert (tmp_path / "new" / "a.md").read_text() == "old"
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.md"]
