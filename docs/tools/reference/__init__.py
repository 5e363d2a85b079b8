"""The pages of reference that are made from the code, each by a function that returns Markdown."""
