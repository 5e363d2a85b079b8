"""The cost of importing the kit, which every test run pays."""

import subprocess
import sys

import benchbot.testing


def test_every_name_of_the_kit_is_where_it_says() -> None:
    for name in benchbot.testing._MODULES:
        assert getattr(benchbot.testing, name).__name__ == name


def test_an_unknown_name_is_an_attribute_error() -> None:
    assert not hasattr(benchbot.testing, "check_everything")


def test_importing_the_kit_imports_next_to_nothing() -> None:
    heavy = "{'benchbot', 'numpy', 'yaml', 'pluggy'}"
    code = f"import sys, benchbot.testing; print(sorted(n for n in sys.modules if n.partition('.')[0] in {heavy}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "['benchbot', 'benchbot.testing']\n"
