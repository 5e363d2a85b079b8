"""BEAR environments for BenchBot: furnished rooms to map."""
