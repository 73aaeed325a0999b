"""nuPlan: a log database and the vector map of its city."""
