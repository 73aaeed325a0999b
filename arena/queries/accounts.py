"""Who is signed in: every request asks for the account and its roles, so they come together."""

from __future__ import annotations

from typing import Any

from django.contrib.auth.backends import ModelBackend
from django.contrib.auth.models import User

from arena.queries.plain import instances

_COLUMNS = tuple(field.attname for field in User._meta.concrete_fields)
_ACCOUNT = f"""
SELECT {", ".join(f"account.{name}" for name in _COLUMNS)}, auth_group.name
FROM auth_user account
LEFT JOIN auth_user_groups ON auth_user_groups.user_id = account.id
LEFT JOIN auth_group ON auth_group.id = auth_user_groups.group_id
WHERE account.id = %(id)s
"""


class AccountBackend(ModelBackend):
    """Django's accounts and passwords; who is signed in is loaded by one query with the roles."""

    def get_user(self, user_id: Any) -> User | None:
        """The account of a session, None where it is gone or not active.

        Its `role_names` hold the names of its groups for `role_of`, as of this request.
        """
        rows = instances(User, _COLUMNS, _ACCOUNT, {"id": user_id})
        if not rows or not self.user_can_authenticate(rows[0][0]):
            return None
        user: Any = rows[0][0]
        user.role_names = frozenset(role for _, (role,) in rows)
        return user  # type: ignore[no-any-return]
