"""Pairs, pictures and progress of one expert."""
