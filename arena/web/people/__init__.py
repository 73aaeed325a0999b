"""Accounts, sign-in and the ways in by a link."""
