"""Household models for BenchBot's scenes: furniture, kitchenware, electronics, food, people."""
