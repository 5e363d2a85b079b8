from pathlib import Path

from benchbot.plugins.installer.indexes import Indexes, without_credentials


def test_secrets_are_left_out_of_what_is_printed_and_of_the_options_of_processes() -> None:
    assert without_credentials("see https://me:secret@example.org/simple/ and http://token@x/") == (
        "see https://example.org/simple/ and http://x/"
    )
    indexes = Indexes("https://me:secret@example.org/simple", ("https://t@two/",), offline=True, links=(Path("w"),))
    assert indexes.options() == ["--no-index", "--find-links", str(Path("w").absolute())]
    assert indexes.variables("A", "B") == {"A": indexes.url, "B": "https://t@two/"}
