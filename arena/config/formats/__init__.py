"""How dates and numbers look: the day before the month, and numbers as in the paper's tables."""
