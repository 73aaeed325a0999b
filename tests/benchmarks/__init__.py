"""Measurements to run by hand; each prints its table: python -m tests.benchmarks.<name>."""
