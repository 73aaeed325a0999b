"""Ratings and what is read from them."""
