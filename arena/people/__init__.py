"""Accounts, roles, sign-in, tokens, invitations and authorships."""
