"""Programs that use the product from outside; nothing of it is imported here."""
