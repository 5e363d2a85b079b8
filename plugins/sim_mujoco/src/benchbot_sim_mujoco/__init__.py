"""A second simulator for BenchBot: its rooms in MuJoCo, with contact physics."""
