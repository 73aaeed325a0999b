"""People: what an account has beside its login, and the tokens of its programs."""

import secrets
import uuid
from datetime import datetime
from typing import Any, ClassVar

from django.conf import settings
from django.db import models
from django.db.models import Q
from django.db.models.signals import post_save
from django.dispatch import receiver

from augment.models import CodedModel, user_column


class Person(models.Model):
    """Account details beside its login: a public code, a pseudonym and preferences."""

    user = models.OneToOneField(
        settings.AUTH_USER_MODEL, on_delete=models.CASCADE, related_name="person"
    )
    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    pseudonym = models.CharField(max_length=60, unique=True)
    preferences = models.JSONField(default=dict, blank=True)
    is_simulated = models.BooleanField(
        default=False, help_text="votes of this account are made by the machine"
    )

    class Meta:
        ordering = ("pseudonym",)
        verbose_name_plural = "people"

    def __str__(self) -> str:
        return self.pseudonym


@receiver(post_save, sender=settings.AUTH_USER_MODEL)
def give_person(instance: Any, created: bool, raw: bool, using: str, **_: Any) -> None:
    """Give a new account its person: Django's admin and createsuperuser know of none.

    Rows of a fixture are taken as they are.
    """
    if created and not raw:
        people = Person.objects.using(using)
        code = uuid.uuid4()
        name = f"Person {instance.pk}"
        is_taken = people.filter(pseudonym=name).exists()
        pseudonym = f"{name} {code.hex[:8]}" if is_taken else name
        people.create(user=instance, code=code, pseudonym=pseudonym)


def fresh_token() -> str:
    """A token that nobody can guess and that says nothing."""
    return secrets.token_urlsafe(24)


class ApiToken(CodedModel):
    """One token of one account. It is shown once and kept only as a hash.

    The role is never more than the owner's of the moment; see `arena.people.queries`.
    """

    class State(models.TextChoices):
        ALIVE = "alive", "Works"
        EXPIRED = "expired", "Expired"
        REVOKED = "revoked", "Revoked"

    ROLES: ClassVar = ("admin", "researcher", "expert", "entrant")

    owner = user_column("api_tokens", on_delete=models.CASCADE)
    name = models.CharField(max_length=80, help_text="what it is for")
    role = models.CharField(max_length=10, choices=[(role, role) for role in ROLES])
    token_sha256 = models.CharField(max_length=64, unique=True, editable=False)
    made_at = models.DateTimeField(auto_now_add=True)
    expires_at = models.DateTimeField()
    last_used_at = models.DateTimeField(null=True, blank=True)
    revoked_at = models.DateTimeField(null=True, blank=True)
    window_began_at = models.DateTimeField(
        null=True, blank=True, help_text="since when `window_requests` are counted"
    )
    window_requests = models.PositiveIntegerField(default=0)

    class Meta:
        ordering = ("-made_at", "-pk")
        constraints = (
            models.CheckConstraint(
                name="api_token_role_is_known",
                condition=Q(role__in=["admin", "researcher", "expert", "entrant"]),
            ),
        )

    def state(self, now: datetime) -> State:
        """Return whether the token works at that time, and if not, why."""
        if self.revoked_at is not None:
            return self.State.REVOKED
        return self.State.EXPIRED if self.expires_at <= now else self.State.ALIVE


class Receipt(models.Model):
    """The answer to a POST that came with a key; kept a day, so that it counts once."""

    key_hash = models.CharField(max_length=64, unique=True)
    body_hash = models.CharField(max_length=64)
    received_at = models.DateTimeField(db_index=True)
    status = models.PositiveSmallIntegerField(null=True, help_text="null while it is under way")
    answer = models.BinaryField(default=b"", help_text="sealed with the key")
