"""Object map quality (OMQ), an evaluation method for BenchBot."""
