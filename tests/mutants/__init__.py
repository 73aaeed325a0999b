"""Small mutations of what matters most, each with the tests that must notice it."""
