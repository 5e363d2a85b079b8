"""Screens are kept small, and a screen that differs from the kept one is drawn for a person to look at."""

import asyncio
from pathlib import Path

import pytest
from textual.app import App, ComposeResult
from textual.pilot import Pilot
from textual.widgets import Static

from tests.plugins.tui import golden


class OneWord(App[None]):
    def compose(self) -> ComposeResult:
        yield Static("[bold red]word[/]", id="word")


def test_a_screen_is_compared_with_the_kept_one_in_words_and_colours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def compared() -> None:
        monkeypatch.setattr(golden, "SNAPSHOTS", tmp_path)
        monkeypatch.delenv("NO_COLOR", raising=False)
        app = OneWord()
        async with app.run_test(size=(20, 3)) as pilot:
            assert isinstance(pilot, Pilot)
            with pytest.raises(AssertionError, match="has no 20x3 dark yet"):
                golden.matches(app, "word")
            with monkeypatch.context() as rewriting:
                rewriting.setenv(golden.REWRITE, "1")
                golden.matches(app, "word")
                once = (tmp_path / "word.json.xz").read_bytes()
                golden.matches(app, "word")
            assert (tmp_path / "word.json.xz").read_bytes() == once
            golden.matches(app, "word")

            app.query_one("#word", Static).update("[bold green]word[/]")
            await pilot.pause()
            with pytest.raises(AssertionError, match="same words in other colours") as raised:
                golden.matches(app, "word")
            folder = Path(str(raised.value).partition("look at ")[2].partition(";")[0])
            assert sorted(path.name for path in folder.iterdir()) == [
                "word-20x3-dark-kept.svg",
                "word-20x3-dark-shown.svg",
            ]
            assert ">word</text>" in (folder / "word-20x3-dark-kept.svg").read_text()
            app.query_one("#word", Static).update("other")
            await pilot.pause()
            with pytest.raises(AssertionError, match=r"\+other"):
                golden.matches(app, "word")

    asyncio.run(compared())
