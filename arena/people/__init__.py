"""Accounts, links and tokens."""
