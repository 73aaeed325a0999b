"""Pages of contestants and of the endpoints that they ask."""
