"""Making plug-ins: new projects, checks of declarations, and the conformance kit."""

__all__ = ["comparability", "conformance"]
