"""Measures of stored augmentations: checks, displacement, drives."""
