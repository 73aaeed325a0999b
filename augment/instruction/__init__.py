"""What a sentence asks for: grammar -> typed Intent, with what was understood and what not."""

from augment.instruction.grammar import parse

__all__ = ["parse"]
