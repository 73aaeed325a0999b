"""Run by Label Studio's own interpreter: annotators with tokens, printed as JSON."""

from __future__ import annotations

import json
import sys

import django

django.setup()

from organizations.functions import create_organization  # noqa: E402
from organizations.models import OrganizationMember  # noqa: E402
from rest_framework.authtoken.models import Token  # noqa: E402
from users.models import User  # noqa: E402


def main(annotators: int) -> None:
    people = [
        User.objects.create_user(email=f"person{number}@bench.example", password="bench-pass-1")
        for number in range(annotators + 1)
    ]
    organization = create_organization("Bench", people[0], legacy_api_tokens_enabled=True)
    tokens = []
    for person in people:
        OrganizationMember.objects.get_or_create(user=person, organization=organization)
        person.active_organization = organization
        person.save()
        tokens.append(Token.objects.get_or_create(user=person)[0].key)
    print(json.dumps({"admin": tokens[0], "annotators": tokens[1:]}))


if __name__ == "__main__":
    main(int(sys.argv[1]))
