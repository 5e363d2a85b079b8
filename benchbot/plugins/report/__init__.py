"""Reports of results: a page for people, tables for papers and programs, test cases for continuous integration."""

__all__ = [
    "compare_command",
    "comparison",
    "diagnosis",
    "episodes",
    "pairing",
    "rendering",
    "result_sets",
    "significance",
]
