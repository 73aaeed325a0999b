"""How far a modification is from its scenario's reference, and what that comes to over many."""
