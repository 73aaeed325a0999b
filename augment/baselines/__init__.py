"""Contestants without a language model."""
