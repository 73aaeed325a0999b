"""Django's admin of arena, for rare edits."""
