"""New installations run the squashed migrations, older ones those that they replace."""

from django.db.migrations.loader import MigrationLoader


def test_squashed_migrations_end_where_the_replaced_ones_do() -> None:
    squashed = MigrationLoader(None).project_state().models
    replaced = MigrationLoader(None, replace_migrations=False).project_state().models
    assert squashed.keys() == replaced.keys()
    for name, model in squashed.items():
        assert model.fields.keys() == replaced[name].fields.keys(), name
        for field, value in model.fields.items():
            assert value.deconstruct()[1:] == replaced[name].fields[field].deconstruct()[1:], field
        for kind in ("constraints", "indexes"):
            rules = [
                sorted(map(repr, state.options.get(kind, []))) for state in (model, replaced[name])
            ]
            assert rules[0] == rules[1], name
