"""Pages of contestants and endpoints."""
