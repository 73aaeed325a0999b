"""Displacement of a modification from its scenario's reference, and summaries over many."""
