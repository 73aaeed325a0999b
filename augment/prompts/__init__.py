"""Prompts and answers: Scene -> text, text -> Modification, or an error that says where."""
