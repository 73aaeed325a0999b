"""Django's admin of augment, for rare edits."""
