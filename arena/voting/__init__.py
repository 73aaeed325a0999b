"""Blind voting: what experts are shown, what they decide, and storing it once."""
