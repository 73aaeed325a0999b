"""Who has an account. Every account has a person, however it was made."""

from __future__ import annotations

import uuid
from typing import Any

from django.conf import settings
from django.db import models
from django.db.models.signals import post_save
from django.dispatch import receiver


class Person(models.Model):
    """What an account is beside its login: a public code, a pseudonym and preferences."""

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
