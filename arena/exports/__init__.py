"""Snapshots and jobs as tables, files and charts."""
