"""Benchmark sets and submissions as folders: what is handed out, what comes in, what it is worth.

In: scenarios, and a folder from outside. Out: files, and a report with an entry for each scenario.
Pure; a folder from outside is read in a process of its own.
"""
