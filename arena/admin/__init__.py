"""Django's admin of arena, for rare edits: accounts, and reading what was voted and rated."""

from __future__ import annotations

from arena.admin import accounts, studies

__all__ = ["accounts", "studies"]
