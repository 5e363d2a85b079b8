"""A viewer of results: a local web application, and the same as files."""
