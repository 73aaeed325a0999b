"""A whole study in one folder: tables for people, and its rows, so that it can be imported.

Only pseudonyms travel. An import on an empty installation and another export give the same bytes.
"""
