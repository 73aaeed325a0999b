"""interPlan's modification file: read, written, and as an intent."""
