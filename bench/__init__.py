"""Measurements to run by hand; each prints its table: `python -m bench.<name>`."""
