"""Studies with their plans, voters and results."""
