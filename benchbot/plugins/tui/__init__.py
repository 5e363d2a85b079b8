"""The screens of `benchbot tui`: choose, start, watch, submit, evaluate and browse, in any terminal."""
