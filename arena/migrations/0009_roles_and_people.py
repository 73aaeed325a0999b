"""The roles as groups, so that Django's admin can give them, and a person for every account."""

from django.db import migrations

ROLES = ("admin", "analyst", "expert")


def complete(apps, schema_editor):
    groups = apps.get_model("auth", "Group").objects
    for role in ROLES:
        groups.get_or_create(name=role)
    people = apps.get_model("arena", "Person").objects
    for account in apps.get_model("auth", "User").objects.filter(person=None):
        name = f"Person {account.pk}"
        person = people.model(user=account)
        is_taken = people.filter(pseudonym=name).exists()
        person.pseudonym = f"{name} {person.code.hex[:8]}" if is_taken else name
        person.save()


class Migration(migrations.Migration):

    dependencies = [
        ("arena", "0008_text_description"),
        ("auth", "0012_alter_user_first_name_max_length"),
    ]

    operations = [migrations.RunPython(complete, migrations.RunPython.noop)]
