"""How the documentation is made: its site from Markdown, its reference from the code."""
