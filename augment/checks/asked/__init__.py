"""Checks that hold a modification against what an instruction asks for."""
