"""What the pages of all subjects share: access, accounts, acts, forms, lists, messages."""
