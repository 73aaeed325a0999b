"""Blind voting: planned pairs, decisions, and the page on which they are made."""
