"""The planner of matchups: a pure function of seed and rules."""
