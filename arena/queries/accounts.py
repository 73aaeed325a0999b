"""Who is signed in: every request asks for the account and its roles, so they come together."""

from __future__ import annotations

from typing import Any

from django.contrib.auth.backends import ModelBackend
from django.contrib.auth.models import User

_ACCOUNT = """
SELECT account.*, auth_group.name AS role
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
        rows: list[Any] = list(User.objects.raw(_ACCOUNT, {"id": user_id}))
        if not rows or not self.user_can_authenticate(rows[0]):
            return None
        user = rows[0]
        user.role_names = frozenset(row.role for row in rows)
        return user  # type: ignore[no-any-return]
