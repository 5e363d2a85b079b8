"""Navigation for BenchBot: tasks, episode lists, floor plans, and how runs are scored."""
