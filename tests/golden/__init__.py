"""Results that a change of the code alone must leave as they are, kept in files.

A changed file is a visible change: look at the difference, then write all of them anew with
`python -m tests.golden`. Prompts have files of their own in tests/prompts/golden.
"""
