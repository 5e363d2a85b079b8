"""The conformance kit: what `benchbot.testing` offers, a module for each kind of plug-in."""
