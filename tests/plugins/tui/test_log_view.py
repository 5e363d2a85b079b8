from benchbot.plugins.tui.log_view import LogFilter
from benchbot.plugins.watching.views import LogLine


def test_a_log_is_filtered_by_source_level_and_text() -> None:
    line = LogLine(0.0, "solution", "warning", "No depth for the Table")
    every = LogFilter()
    assert every.passes(line)
    assert not every.with_text("chair").passes(line)
    assert every.with_text(" table ").passes(line)
    assert every.next_level().passes(line)
    assert not every.next_level().next_level().passes(line)
    sources = ["platform", "solution"]
    assert [str(every.next_source(sources)), str(every.next_source(sources).next_source(sources))] == [
        "platform · info and worse",
        "solution · info and worse",
    ]
    assert every.next_source(sources).next_source(sources).next_source(sources) == every
