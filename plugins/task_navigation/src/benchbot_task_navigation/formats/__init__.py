"""The formats of navigation."""
