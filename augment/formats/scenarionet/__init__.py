"""ScenarioNet's pickled scenario descriptions."""
