"""The supervisor: one run behind HTTP on loopback, its platform in a process that may die, its files and its end."""
