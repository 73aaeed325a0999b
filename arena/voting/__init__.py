"""What experts see and decide."""
